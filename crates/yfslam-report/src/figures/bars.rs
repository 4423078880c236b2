//! In: errors of all methods. Out: bars of RMSE and S.D. (paper Fig. 6).

use super::axis::Axis;
use super::plot::{Figure, Mark};
use super::scene::{Captioned, LOG_FROM_RATIO, Scene, WIDTH, bounds};
use crate::content::Report;

const HEIGHT: f64 = 330.0;
/// Width of a bar, as a share of the distance between two groups of bars.
const WIDEST_BAR: f64 = 0.24;

/// Draws the bars; `None` if fewer than two methods have errors.
pub fn bars(report: &Report, scene: &Scene) -> Option<Captioned> {
    let methods: Vec<_> = scene
        .methods
        .iter()
        .zip(&report.methods)
        .filter_map(|(drawn, method)| Some((drawn, method.evaluation?.ate.translation_m)))
        .collect();
    if methods.len() < 2 {
        return None;
    }
    let [smallest, largest] = bounds(methods.iter().flat_map(|(_, s)| [s.rmse, s.std]))?;
    let is_log = smallest > 0.0 && largest / smallest > LOG_FROM_RATIO;
    let y = if is_log {
        Axis::log_lengths("ATE, logarithmic", [smallest * 0.4, largest * 1.6])
    } else {
        Axis::linear("ATE (m)", [0.0, largest.max(1e-6) * 1.15], 4, 1.0)
    };
    let width = (0.8 / methods.len() as f64).min(WIDEST_BAR);
    let mut marks = Vec::new();
    for (index, (drawn, s)) in methods.iter().enumerate() {
        let offset = (index as f64 - (methods.len() as f64 - 1.0) / 2.0) * width;
        for (group, height) in [(0.0, s.rmse), (1.0, s.std)] {
            let [from, to] = [group + offset - 0.44 * width, group + offset + 0.44 * width];
            marks.push(Mark::Bar { from, to, height, ink: drawn.ink, text: format!("{height:.4}") });
        }
    }
    let title = "RMSE and standard deviation of the ATE".to_owned();
    let x = Axis::groups(&["RMSE", "S.D."]);
    let figure = Figure { description: title.clone(), size: [WIDTH, HEIGHT], x, y, marks, legend: Vec::new() };
    Some(Captioned { figure, title, note: String::new() })
}
