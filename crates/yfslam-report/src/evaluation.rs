//! In: an evaluation. Out: its table.

use yfslam_eval::{AlignmentKind, Evaluation, Statistics};

use crate::table::{Table, TableStyle};

/// Returns the errors as a table, with a line below it on the association and the tracked frames.
///
/// Errors have four decimals: 0.1 mm is the resolution of the usual ground truth.
pub fn evaluation_table(evaluation: &Evaluation, style: TableStyle) -> String {
    let mut table = Table::new(["error", "RMSE", "mean", "median", "S.D.", "min", "max", "n"]);
    let mut push = |name: String, s: &Statistics| {
        let figures = [s.rmse, s.mean, s.median, s.std, s.min, s.max].map(|v| format!("{v:.4}"));
        table.push([name].into_iter().chain(figures).chain([s.count.to_string()]));
    };
    push(format!("ATE, {} (m)", evaluation.ate.alignment.kind), &evaluation.ate.translation_m);
    for rpe in &evaluation.rpe {
        let pairs = if rpe.options.all_pairs { "all pairs" } else { "consecutive" };
        push(format!("RPE per {}, {pairs} (m)", rpe.options.delta), &rpe.translation_m);
        push(format!("RPE per {}, {pairs} (deg)", rpe.options.delta), &rpe.rotation_deg);
    }
    table.render(style) + &association(evaluation)
}

/// Describes how the poses were associated, and how much was tracked.
fn association(evaluation: &Evaluation) -> String {
    let mut text = format!(
        "\n{} matches of {} estimated and {} reference poses within {} ms",
        evaluation.matches,
        evaluation.estimate_poses,
        evaluation.reference_poses,
        evaluation.max_diff_ns as f64 / 1e6
    );
    if evaluation.ate.alignment.kind == AlignmentKind::Sim3 {
        text += &format!("; {}", evaluation.ate.alignment);
    }
    if let Some(c) = &evaluation.coverage {
        text += &format!("; tracked {} of {} frames ({:.1} %)", c.tracked, c.expected, 100.0 * c.fraction);
    }
    text + "\n"
}
