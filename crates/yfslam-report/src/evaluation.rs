//! In: an evaluation, or errors. Out: their table.

use yfslam_eval::{AlignmentKind, Ate, Evaluation, Rpe, Statistics};

use crate::table::{Table, TableStyle};

/// Returns the errors as a table, with a line below it on the association and the tracked frames.
pub fn evaluation_table(evaluation: &Evaluation, style: TableStyle) -> String {
    let row = |ate: &Ate| (format!("ATE, {} (m)", ate.alignment.kind), ate.translation_m);
    let both = [row(&evaluation.ate)].into_iter().chain(evaluation.beside.iter().map(row));
    let errors = both.chain(evaluation.rpe.iter().flat_map(rpe_errors));
    errors_table(errors).render(style) + &association(evaluation)
}

/// Returns names and statistics of a relative error: translation, then rotation.
pub fn rpe_errors(rpe: &Rpe) -> [(String, Statistics); 2] {
    let pairs = if rpe.options.all_pairs { "all pairs" } else { "consecutive" };
    let name = |unit: &str| format!("RPE per {}, {pairs} ({unit})", rpe.options.delta);
    [(name("m"), rpe.translation_m), (name("deg"), rpe.rotation_deg)]
}

/// Returns a table with a row for each error.
///
/// Errors have four decimals: 0.1 mm is the resolution of the usual ground truth.
pub fn errors_table(errors: impl IntoIterator<Item = (String, Statistics)>) -> Table {
    let mut table = Table::new(["error", "RMSE", "mean", "median", "S.D.", "min", "max", "n"]);
    for (name, s) in errors {
        let figures = [s.rmse, s.mean, s.median, s.std, s.min, s.max].map(|v| format!("{v:.4}"));
        table.push([name].into_iter().chain(figures).chain([s.count.to_string()]));
    }
    table
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
    } else if let Some(scale) = evaluation.scale() {
        text += &format!("; Sim(3) has the scale s = {scale:.4}");
    }
    if let Some(c) = &evaluation.coverage {
        text += &format!("; tracked {} of {} frames ({:.1} %)", c.tracked, c.expected, 100.0 * c.fraction);
    }
    text + "\n"
}
