//! In: a report. Out: the data of all figures, with one clock, one world frame, and one colour for each method.

use super::ink::Ink;
use super::orientation::BodyRotation;
use super::plot::Figure;
use super::series::{At, Clock, Series};
use crate::content::Report;

/// Width of every figure, px: two fit side by side on a wide page, and one on a phone.
pub const WIDTH: f64 = 560.0;
/// Ratio of the largest to the smallest error from which axes are logarithmic: a linear axis would hide the smallest.
pub const LOG_FROM_RATIO: f64 = 20.0;

/// The data of all figures.
pub struct Scene<'a> {
    pub clock: Clock,
    /// Rotation of the camera relative to the body of the ground truth.
    pub body_rotation: BodyRotation,
    pub truth: Option<Vec<At>>,
    pub methods: Vec<Drawn<'a>>,
}

/// A method in the figures.
pub struct Drawn<'a> {
    pub name: &'a str,
    pub ink: Ink,
    pub series: Series,
}

/// A figure with title and note.
pub struct Captioned {
    pub figure: Figure,
    pub title: String,
    pub note: String,
}

impl<'a> Scene<'a> {
    /// Prepares the data.
    pub fn new(report: &'a Report) -> Self {
        let clock = Clock::new(report);
        let body_rotation = BodyRotation::of(report);
        let drawn = |(index, method): (usize, &'a crate::content::MethodReport)| Drawn {
            name: method.name,
            ink: Ink::method(method.name, index),
            series: Series::new(report, method, &clock, &body_rotation),
        };
        let methods = report.methods.iter().enumerate().map(drawn).collect();
        Self { truth: report.truth.map(|truth| clock.truth(truth, &body_rotation)), methods, body_rotation, clock }
    }

    /// Returns whether any method was lost.
    pub fn any_lost(&self) -> bool {
        self.methods.iter().any(|m| !m.series.lost.is_empty())
    }
}

/// Returns the smallest and the largest value; `None` if there are no values.
pub fn bounds(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.fold(None, |found, v| Some(found.map_or([v, v], |[low, high]: [f64; 2]| [low.min(v), high.max(v)])))
}
