//! Evaluation of estimates against the ground truth, with the options that `run`, `eval` and `demo` share.

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use yfslam_eval::{AlignmentKind, Delta, EvalError, EvalOptions, Evaluation, StampedPose, evaluate};

/// How an estimate is associated and aligned with the ground truth.
#[derive(Args, Clone, Copy, Debug)]
pub struct EvaluationArgs {
    /// Largest difference between the time stamps of an estimated and a true pose, ms.
    #[arg(long, value_name = "MS", default_value_t = 20.0, allow_negative_numbers = true, help_heading = "Evaluation")]
    pub max_difference_ms: f64,
    /// Alignment with the ground truth [default: se3; sim3 for runs with a single camera].
    #[arg(long, value_enum, value_name = "KIND", help_heading = "Evaluation")]
    pub align: Option<AlignArg>,
}

/// Which transformation an alignment estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AlignArg {
    /// Rotation and translation, for cameras that measure lengths.
    Se3,
    /// Rotation, translation and scale, for a single camera; it hides an unknown scale and part of its drift.
    Sim3,
}

impl EvaluationArgs {
    /// Returns the alignment for an estimate whose scale is known or not.
    pub fn alignment(self, scale_is_known: bool) -> AlignmentKind {
        match self.align {
            Some(AlignArg::Se3) => AlignmentKind::Se3,
            Some(AlignArg::Sim3) => AlignmentKind::Sim3,
            None if scale_is_known => AlignmentKind::Se3,
            None => AlignmentKind::Sim3,
        }
    }

    /// Returns the largest difference between time stamps, ns.
    ///
    /// # Errors
    /// The value is negative or not a number.
    pub fn max_diff_ns(self) -> Result<u64> {
        let ms = self.max_difference_ms;
        if !(0.0..=1e9).contains(&ms) {
            bail!("--max-difference-ms is {ms}; give milliseconds, such as 20");
        }
        Ok((ms * 1e6) as u64)
    }
}

/// Evaluates an estimate; relative errors over seconds are left out where no two poses are so far apart.
///
/// # Errors
/// Estimate and ground truth do not overlap in time, or are too short or too straight to be aligned.
pub fn evaluate_possible(
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
