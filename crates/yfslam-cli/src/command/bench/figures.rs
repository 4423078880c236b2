//! Figures of a bench: for each sequence the trajectories and errors of all systems with the first seed, and the errors over all
//! seeds.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::Result;
use yfslam_eval::{Evaluation, StampedPose};
use yfslam_io::TrajectoryFile;
use yfslam_io::trajectory::TrajectoryFormat;
use yfslam_report::{FigureFile, errors_over_runs};

use super::cell::{Cell, Group};
use super::external::External;
use super::table::rows;
use crate::command::run::RunArgs;
use crate::output::plots::{Plotted, figures, write_figures};
use crate::run::evaluation::evaluate_possible;
use crate::ui::terminal::Terminal;

/// The figures of a sequence.
pub struct SequenceFigures {
    pub sequence: String,
    pub figures: Vec<FigureFile>,
}

/// Draws the figures of every sequence and writes them into `out/figures`; a sequence without results has none.
///
/// # Errors
/// A file cannot be written.
pub fn draw(
    out: &Path,
    groups: &[Group],
    cells: &[Cell],
    externals: &[External],
    extra: &[String],
    terminal: Terminal,
) -> Result<Vec<SequenceFigures>> {
    let mut drawn: Vec<SequenceFigures> = Vec::new();
    for group in groups {
        if drawn.iter().any(|one| one.sequence == group.sequence) {
            continue;
        }
        let mut figures = of_group(out, group, externals, extra, terminal).unwrap_or_default();
        figures.extend(errors_over_runs(&errors(cells, &group.sequence)));
        write_figures(&out.join("figures"), &format!("{}-", group.key()), &figures)?;
        drawn.push(SequenceFigures { sequence: group.sequence.clone(), figures });
    }
    Ok(drawn)
}

/// Returns the errors of each system on a sequence, over the seeds.
fn errors(cells: &[Cell], sequence: &str) -> Vec<(String, Vec<f64>)> {
    let rows = rows(cells);
    let of_sequence = rows.iter().filter(|row| row.sequence == sequence);
    of_sequence
        .map(|row| (row.method.to_owned(), row.cells.iter().filter_map(|cell| cell.ate_rmse_m).collect()))
        .collect()
}

/// Returns the figures of a group; none if it has no ground truth or no result.
fn of_group(
    out: &Path,
    group: &Group,
    externals: &[External],
    extra: &[String],
    terminal: Terminal,
) -> Result<Vec<FigureFile>> {
    let arguments: Vec<OsString> = group.arguments(&["none"], extra).into_iter().skip(1).map(Into::into).collect();
    let (stamps_ns, truth, options) = RunArgs::parse(&arguments)?.reference(terminal)?;
    let runs = out.join("runs").join(group.key());
    let own = group.methods.iter().map(|method| (method.clone(), runs.join(method).join("trajectory.txt")));
    let others = externals.iter().filter_map(|external| Some((external.name.clone(), external.file(group, true)?)));
    let files: Vec<(String, PathBuf)> = own.chain(others).collect();
    let evaluated = |(name, path): &(String, PathBuf)| -> Option<(String, Vec<StampedPose>, Evaluation)> {
        let file = TrajectoryFile::read(path).ok()?;
        let file = if file.format == TrajectoryFormat::Kitti { file.with_times(&stamps_ns, path).ok()? } else { file };
        let evaluation = evaluate_possible(&truth.poses, &file.poses, options.clone()).ok()?;
        Some((name.clone(), file.poses, evaluation))
    };
    let estimates: Vec<_> = files.iter().filter_map(evaluated).collect();
    let plotted =
        estimates.iter().map(|(name, trajectory, evaluation)| Plotted { name: name.clone(), trajectory, evaluation });
    let plotted: Vec<Plotted> = plotted.collect();
    Ok(if plotted.is_empty() { Vec::new() } else { figures(&group.sequence, &truth.poses, &plotted) })
}
