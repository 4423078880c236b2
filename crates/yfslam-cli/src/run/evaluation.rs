//! Estimates against the truth, with the options that `run`, `eval` and `demo` share.

use std::path::Path;

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use yfslam_eval::{AlignmentKind, Delta, EvalError, EvalOptions, Evaluation, StampedPose, evaluate};
use yfslam_io::TrajectoryFile;

use crate::ui::terminal::Terminal;

/// How estimate and ground truth are brought together.
#[derive(Args, Clone, Copy, Debug)]
pub struct MatchArgs {
    /// How far apart the stamps of an estimated and a true pose may be, ms. The tool of the TUM benchmark takes 20, `evo` 10; the
    /// ground truth of Bonn needs 20.
    #[arg(long, value_name = "MS", default_value_t = 20.0, allow_negative_numbers = true, help_heading = "Evaluation")]
    pub max_difference_ms: f64,
    /// What the alignment with the ground truth may choose [default: se3; sim3 for runs with a single camera].
    #[arg(long, value_enum, value_name = "KIND", help_heading = "Evaluation")]
    pub align: Option<AlignArg>,
}

/// What an alignment may choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AlignArg {
    /// Rotation and translation, for cameras that measure lengths.
    Se3,
    /// The scale, too, for a single camera. It hides that scale is not known, and how it drifts on the whole.
    Sim3,
}

impl MatchArgs {
    /// What the alignment may choose, for an estimate that knows its scale or not.
    pub fn alignment(self, knows_scale: bool) -> AlignmentKind {
        match self.align {
            Some(AlignArg::Se3) => AlignmentKind::Se3,
            Some(AlignArg::Sim3) => AlignmentKind::Sim3,
            None if knows_scale => AlignmentKind::Se3,
            None => AlignmentKind::Sim3,
        }
    }

    /// The tolerance, ns.
    ///
    /// # Errors
    /// A tolerance that is none.
    pub fn max_diff_ns(self) -> Result<u64> {
        let ms = self.max_difference_ms;
        if !(0.0..=1e9).contains(&ms) {
            bail!("--max-difference-ms is {ms}; give milliseconds, such as 20");
        }
        Ok((ms * 1e6) as u64)
    }
}

/// Evaluates an estimate; a drift per second is left out where no two poses are a second apart.
///
/// # Errors
/// Estimate and truth do not belong together, or are too short or too straight to be aligned.
pub fn judge(
    truth: &[StampedPose],
    estimate: &[StampedPose],
    mut options: EvalOptions,
) -> Result<Evaluation, EvalError> {
    match evaluate(truth, estimate, &options) {
        Err(EvalError::NoPairs { delta: Delta::Seconds(_), .. }) => {
            options.rpe.retain(|rpe| !matches!(rpe.delta, Delta::Seconds(_)));
            evaluate(truth, estimate, &options)
        }
        result => result,
    }
}

/// Reads a trajectory and tells of the poses in it that cannot be used.
///
/// # Errors
/// The file cannot be read or holds values that are no pose.
pub fn read_poses(path: &Path, terminal: Terminal) -> Result<Vec<yfslam_io::StampedPose>> {
    Ok(checked_poses(TrajectoryFile::read(path)?, path, terminal))
}

/// The poses that were read from `path`; warns of what was left out.
pub fn checked_poses(file: TrajectoryFile, path: &Path, terminal: Terminal) -> Vec<yfslam_io::StampedPose> {
    let TrajectoryFile { poses, duplicates_skipped, backward_skipped } = file;
    if duplicates_skipped + backward_skipped > 0 {
        terminal.warn(&format!(
            "{}: {duplicates_skipped} poses skipped because their stamp repeats, {backward_skipped} because it runs backward",
            path.display()
        ));
    }
    poses
}

/// Poses in the type of the evaluator.
pub fn to_eval(poses: &[yfslam_io::StampedPose]) -> Vec<StampedPose> {
    poses.iter().map(|p| StampedPose::new(p.timestamp_ns, p.pose)).collect()
}
