//! In: true and estimated trajectories in one world frame. Out: views from above and from the side (paper Fig. 5 a to c).

use nalgebra::Vector3;

use super::axis::{Axis, length};
use super::ink::{ERROR_STEPS, Ink};
use super::path::Point;
use super::plot::{Figure, Mark, height_for, plot_size};
use super::scene::{Captioned, Scene, WIDTH, bounds};
use super::series::{At, ErrorAt};

/// Extent of a view relative to that of the ground truth, beyond which estimates are clipped: otherwise a very large error of one method
/// would shrink the other trajectories to a dot.
const ROOM: f64 = 2.5;
/// Most poses of a part of a trajectory that is drawn in the colours of its error; of more, every n-th is drawn.
const MAX_SHADED: usize = 1500;
/// Ratio of the errors of two colours.
const STEP_FACTOR: f64 = 2.5;
/// Smallest extent of a view, m.
const LEAST_M: f64 = 0.02;

/// A direction in the world and its name.
struct Direction {
    name: &'static str,
    along: Vector3<f64>,
}

impl Direction {
    fn of(&self, at: &At) -> f64 {
        self.along.dot(&at.position_m)
    }
}

/// Draws both views; no view without a trajectory.
pub fn views(scene: &Scene) -> Vec<Captioned> {
    let [first, second, up] = directions(scene);
    let spread = |d: &Direction| bounds(shown(scene).map(|at| d.of(at))).map_or(0.0, |[low, high]| high - low);
    let along = if spread(&first) >= spread(&second) { &first } else { &second };
    let pairs = [("From above", &first, &second), ("From the side", along, &up)];
    pairs.into_iter().filter_map(|(title, x, y)| view(scene, title, x, y)).collect()
}

/// The trajectory of each method by itself, from above, in the colours of its error; nothing for a single method or without ground truth.
pub struct Multiples {
    pub figures: Vec<Captioned>,
    /// Each colour with the errors that it stands for.
    pub legend: Vec<(String, Ink)>,
}

/// Draws each method by itself, since trajectories with small errors cover each other.
pub fn multiples(scene: &Scene) -> Multiples {
    let none = || Multiples { figures: Vec::new(), legend: Vec::new() };
    let errors =
        || scene.methods.iter().filter_map(|m| m.series.all_errors().map(|e| e.translation_m).reduce(f64::max));
    let worst: Vec<f64> = errors().collect();
    let Some(largest) = worst.iter().copied().reduce(f64::max).filter(|largest| worst.len() > 1 && *largest > 0.0)
    else {
        return none();
    };
    // Each step is a factor: the methods often differ by more than ten times.
    let limit = |step: usize| largest / STEP_FACTOR.powi((ERROR_STEPS - 1 - step) as i32);
    let step_of = |error_m: f64| (0..ERROR_STEPS - 1).find(|step| error_m <= limit(*step)).unwrap_or(ERROR_STEPS - 1);
    let [x, y, _] = directions(scene);
    let figures = scene.methods.iter().enumerate().filter(|(_, method)| !method.series.errors.is_empty());
    let figures = figures.filter_map(|(index, method)| {
        let mut captioned = view(scene, method.name, &x, &y)?;
        let flat = |at: &At| [x.of(at), y.of(at)];
        captioned.figure.marks = shaded(scene, index, &flat, &step_of);
        captioned.figure.description = format!("{} from above, in the colours of its error", method.name);
        Some(captioned)
    });
    let figures = figures.collect();
    let legend = (0..ERROR_STEPS).map(|step| (format!("≤ {}", length(limit(step))), Ink::Error(step)));
    Multiples { figures, legend: legend.collect() }
}

/// Returns the ground truth, and the trajectory of a method in lines of one step of the error each.
fn shaded(scene: &Scene, index: usize, flat: &impl Fn(&At) -> Point, step_of: &impl Fn(f64) -> usize) -> Vec<Mark> {
    let truth = scene.truth.iter().map(|truth| Mark::Line {
        points: truth.iter().map(flat).collect(),
        ink: Ink::Axis,
        width: 1.0,
        opacity: 1.0,
    });
    let mut marks: Vec<Mark> = truth.collect();
    let Some(method) = scene.methods.get(index) else { return marks };
    let errors: Vec<&ErrorAt> = method.series.all_errors().collect();
    for part in &method.series.track {
        let mut line: (Vec<Point>, usize) = (Vec::new(), 0);
        for at in part.iter().step_by(part.len().div_ceil(MAX_SHADED).max(1)) {
            // The errors are in order of time, and one may be missing.
            let next = errors.partition_point(|error| error.time_s < at.time_s - 1e-6);
            let step = errors.get(next).map_or(line.1, |error| step_of(error.translation_m));
            line.0.push(flat(at));
            if step != line.1 {
                let points = std::mem::replace(&mut line.0, vec![flat(at)]);
                marks.push(Mark::Line { points, ink: Ink::Error(line.1), width: 2.6, opacity: 1.0 });
                line.1 = step;
            }
        }
        marks.push(Mark::Line { points: line.0, ink: Ink::Error(line.1), width: 2.6, opacity: 1.0 });
    }
    marks
}

fn view(scene: &Scene, title: &str, x: &Direction, y: &Direction) -> Option<Captioned> {
    let extent_m = |d| bounds(shown(scene).map(|at| Direction::of(d, at))).map(|[low, high]| high - low);
    let room_m = (ROOM - 1.0) / 2.0 * extent_m(x)?.max(extent_m(y)?).max(LEAST_M);
    let ((x_range, x_cut), (y_range, y_cut)) = (range(scene, x, room_m)?, range(scene, y, room_m)?);
    // Both axes have the same scale; the height follows from the width within limits.
    let [plot_width, _] = plot_size([WIDTH, WIDTH]);
    let extent = |[low, high]: [f64; 2]| (high - low).max(LEAST_M) * 1.12;
    let plot_height = (plot_width * extent(y_range) / extent(x_range)).clamp(180.0, 380.0);
    let m_per_px = (extent(x_range) / plot_width).max(extent(y_range) / plot_height);
    let around = |[low, high]: [f64; 2], px: f64| {
        let (middle, half) = ((low + high) / 2.0, m_per_px * px / 2.0);
        [middle - half, middle + half]
    };
    let figure = Figure {
        description: format!("{title}: trajectory in {} and {}, m", x.name, y.name),
        size: [WIDTH, height_for(plot_height)],
        x: Axis::linear(format!("{} (m)", x.name), around(x_range, plot_width), 6, 1.0),
        y: Axis::linear(format!("{} (m)", y.name), around(y_range, plot_height), (plot_height / 55.0) as usize, 1.0),
        marks: marks(scene, |at| [x.of(at), y.of(at)]),
        legend: Vec::new(),
    };
    let note = if x_cut || y_cut { "Clipped where an estimate is far from the ground truth." } else { "" };
    Some(Captioned { figure, title: title.into(), note: note.into() })
}

fn marks(scene: &Scene, flat: impl Fn(&At) -> Point) -> Vec<Mark> {
    let line =
        |part: &[At], ink, width| Mark::Line { points: part.iter().map(&flat).collect(), ink, width, opacity: 1.0 };
    let mut marks: Vec<Mark> = scene.truth.iter().map(|truth| line(truth, Ink::Truth, 2.4)).collect();
    for method in &scene.methods {
        let parts = &method.series.track;
        for pair in parts.windows(2) {
            let [before, after] = pair else { continue };
            let points = before.last().into_iter().chain(after.first()).map(&flat).collect();
            marks.push(Mark::Line { points, ink: method.ink, width: 1.2, opacity: 0.35 });
        }
        marks.extend(parts.iter().map(|part| line(part, method.ink, 1.6)));
        let is_loss = |end: &&At| method.series.lost.iter().any(|[from, _]| (from - end.time_s).abs() < 1e-3);
        let losses = parts.iter().filter_map(|part| part.last()).filter(is_loss);
        marks.extend(losses.map(|end| Mark::Cross { at: flat(end), ink: method.ink, radius: 5.0 }));
    }
    let of_methods = || scene.methods.iter().find_map(|m| m.series.track.first()?.first());
    let start = scene.truth.as_ref().map_or_else(of_methods, |truth| truth.first());
    marks.extend(start.map(|at| Mark::Dot { at: flat(at), ink: Ink::Truth, radius: 4.5 }));
    marks
}

/// Returns the ground truth, or else the estimates.
fn shown<'a>(scene: &'a Scene) -> Box<dyn Iterator<Item = &'a At> + 'a> {
    match &scene.truth {
        Some(truth) => Box::new(truth.iter()),
        None => Box::new(scene.methods.iter().flat_map(|m| m.series.track.iter().flatten())),
    }
}

/// Returns the range along a direction, at most `room` beyond the ground truth, and whether estimates are clipped.
fn range(scene: &Scene, direction: &Direction, room: f64) -> Option<([f64; 2], bool)> {
    let [low, high] = bounds(shown(scene).map(|at| direction.of(at)))?;
    let all = scene.methods.iter().flat_map(|m| m.series.track.iter().flatten());
    let [lowest, highest] = bounds(all.map(|at| direction.of(at))).unwrap_or([low, high]);
    let cut = scene.truth.is_some() && (lowest < low - room || highest > high + room);
    Some(match scene.truth {
        Some(_) => ([low.min(lowest).max(low - room), high.max(highest).min(high + room)], cut),
        None => ([low, high], false),
    })
}

/// Returns two horizontal directions, the second to the left of the first, and up: the world axis nearest to the up direction of the images.
fn directions(scene: &Scene) -> [Direction; 3] {
    const NAMES: [&str; 3] = ["x", "y", "z"];
    let up: Vector3<f64> = shown(scene).map(|at| at.up).sum();
    let k = up.iamax();
    let axis = |k: usize| {
        let mut along = Vector3::zeros();
        along[k % 3] = 1.0;
        Direction { name: NAMES[k % 3], along }
    };
    let (a, b) = (axis(k + 1), axis(k + 2));
    let height = Direction { name: "height", along: axis(k).along * up[k].signum() };
    if up[k] >= 0.0 { [a, b, height] } else { [b, a, height] }
}
