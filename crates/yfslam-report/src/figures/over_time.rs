//! In: errors of all methods. Out: figures of the errors over time (paper Fig. 5 d to f).

use super::axis::{Axis, length, length_unit};
use super::ink::Ink;
use super::path::Point;
use super::plot::{Figure, Mark};
use super::scene::{Captioned, Drawn, LOG_FROM_RATIO, Scene, WIDTH};
use super::series::ErrorAt;

const HEIGHT: f64 = 250.0;

/// Draws errors of translation, roll, pitch and yaw; no figures without ground truth.
pub fn over_time(scene: &Scene) -> Vec<Captioned> {
    let mut figures: Vec<Captioned> = translation(scene).into_iter().collect();
    let names = ["Roll error", "Pitch error", "Yaw error"];
    figures.extend(names.iter().enumerate().filter_map(|(k, name)| angle(scene, name, k)));
    figures
}

fn translation(scene: &Scene) -> Option<Captioned> {
    let of = |error: &ErrorAt| error.translation_m;
    let worst = largest(scene, of)?;
    let rms: Vec<f64> = scene.methods.iter().filter_map(|m| root_mean_square(m, of)).collect();
    let best = rms.iter().copied().fold(f64::INFINITY, f64::min);
    let is_log = rms.iter().any(|rms| rms / best > LOG_FROM_RATIO);
    let axis = if is_log {
        Axis::log_lengths("error, logarithmic", [best / 5.0, worst * 1.1])
    } else {
        let (unit, per_m) = length_unit(worst);
        Axis::linear(format!("error ({unit})"), [0.0, worst.max(1e-6) * 1.05], 4, per_m)
    };
    let each = scene.methods.iter().filter_map(|m| {
        let largest = m.series.all_errors().map(of).reduce(f64::max)?;
        Some(format!("{} {}", m.name, length(largest)))
    });
    let note = format!("Largest: {}.", each.collect::<Vec<_>>().join(", "));
    Some(figure(scene, "Translation error", axis, note, of))
}

fn angle(scene: &Scene, name: &'static str, k: usize) -> Option<Captioned> {
    let of = move |error: &ErrorAt| error.rotation_deg[k];
    let size = move |error: &ErrorAt| error.rotation_deg[k].abs();
    let worst = largest(scene, size)?;
    let each: Vec<(&str, f64)> = scene
        .methods
        .iter()
        .filter_map(|m| Some((m.name, m.series.all_errors().map(size).reduce(f64::max)?)))
        .collect();
    let best = each.iter().map(|(_, v)| *v).fold(f64::INFINITY, f64::min).max(1e-6);
    let mut scale = String::new();
    let axis = if worst / best > LOG_FROM_RATIO {
        // Below the smallest of the largest errors, so that there is something of every method in the logarithmic part.
        let threshold = 10f64.powf(best.log10().floor());
        scale = format!(" Logarithmic beyond ±{threshold}°.");
        Axis::symlog_degrees("error (°), logarithmic", worst, threshold)
    } else {
        let limit = worst.max(1e-6) * 1.1;
        Axis::linear("error (°)", [-limit, limit], 4, 1.0)
    };
    let largest: Vec<_> = each.iter().map(|(name, v)| format!("{name} {v:.2}°")).collect();
    let note = format!("Largest: {}.{scale}", largest.join(", "));
    Some(figure(scene, name, axis, note, of))
}

fn figure(scene: &Scene, title: &str, y: Axis, note: String, of: impl Fn(&ErrorAt) -> f64) -> Captioned {
    let mut marks = Vec::new();
    for method in &scene.methods {
        let spans = method.series.lost.iter().map(|&[from, to]| Mark::Span { from, to, ink: method.ink });
        marks.extend(spans);
    }
    if y.range[0] < 0.0 {
        let points = vec![[0.0, 0.0], [scene.clock.end_s(), 0.0]];
        marks.push(Mark::Line { points, ink: Ink::Axis, width: 1.0, opacity: 1.0 });
    }
    for method in &scene.methods {
        let line = |part: &Vec<ErrorAt>| {
            let points: Vec<Point> = part.iter().map(|error| [error.time_s, of(error)]).collect();
            Mark::Line { points, ink: method.ink, width: 1.5, opacity: 1.0 }
        };
        marks.extend(method.series.errors.iter().map(line));
    }
    let x = Axis::linear("time (s)", [0.0, scene.clock.end_s().max(1e-3)], 7, 1.0);
    let figure = Figure {
        description: format!("{title} over time. {note}"),
        size: [WIDTH, HEIGHT],
        x,
        y,
        marks,
        legend: Vec::new(),
    };
    Captioned { figure, title: title.into(), note }
}

fn largest(scene: &Scene, of: impl Fn(&ErrorAt) -> f64) -> Option<f64> {
    scene.methods.iter().flat_map(|m| m.series.all_errors()).map(of).reduce(f64::max)
}

fn root_mean_square(method: &Drawn, of: impl Fn(&ErrorAt) -> f64) -> Option<f64> {
    let errors = method.series.all_errors().map(|error| of(error) * of(error));
    let count = errors.clone().count();
    (count > 0).then(|| (errors.sum::<f64>() / count as f64).sqrt())
}
