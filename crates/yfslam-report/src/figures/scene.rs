//! In: a report. Out: what all its figures are made of: one clock, one world, one colour a method.

use super::ink::Ink;
use super::orientation::Mount;
use super::series::{At, Clock, Series};
use crate::content::Report;

/// Width of every figure, px: two stand side by side on a wide page, and one fits a phone.
pub const WIDTH: f64 = 560.0;
/// From this ratio of the worst to the best on, an even axis would hide the best.
pub const LOG_FROM_RATIO: f64 = 20.0;

/// What all figures are made of.
pub struct Scene<'a> {
    pub clock: Clock,
    /// How the frame that the truth follows is turned against the camera's.
    pub mount: Mount,
    pub truth: Option<Vec<At>>,
    pub methods: Vec<Drawn<'a>>,
}

/// A method to draw.
pub struct Drawn<'a> {
    pub name: &'a str,
    pub ink: Ink,
    pub series: Series,
}

/// A figure with its title, and what to say below it.
pub struct Captioned {
    pub svg: String,
    pub title: String,
    pub note: String,
}

impl<'a> Scene<'a> {
    /// Prepares what there is to draw.
    pub fn new(report: &'a Report) -> Self {
        let clock = Clock::new(report);
        let mount = Mount::of(report);
        let drawn = |(place, method): (usize, &'a crate::content::MethodReport)| Drawn {
            name: method.name,
            ink: Ink::method(method.name, place),
            series: Series::new(report, method, &clock, &mount),
        };
        let methods = report.methods.iter().enumerate().map(drawn).collect();
        Self { truth: report.truth.map(|truth| clock.truth(truth, &mount)), methods, mount, clock }
    }

    /// Whether any method has a stretch without a pose.
    pub fn any_lost(&self) -> bool {
        self.methods.iter().any(|m| !m.series.lost.is_empty())
    }
}

/// Smallest and largest; `None` if there are no values.
pub fn bounds(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.fold(None, |found, v| Some(found.map_or([v, v], |[low, high]: [f64; 2]| [low.min(v), high.max(v)])))
}
