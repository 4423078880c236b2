//! Estimates against the truth, with the options that `run`, `eval` and `demo` share.

use anyhow::{Result, bail};
use clap::Args;
use yfslam_eval::{Delta, EvalError, EvalOptions, Evaluation, ExpectedFrames, RpeOptions, StampedPose, evaluate};

/// How stamps of estimate and ground truth are matched.
#[derive(Args, Clone, Copy, Debug)]
pub struct MatchArgs {
    /// How far apart the stamps of an estimated and a true pose may be, ms. The tool of the TUM benchmark takes 20, `evo` 10; the
    /// ground truth of Bonn needs 20.
    #[arg(long, value_name = "MS", default_value_t = 20.0, allow_negative_numbers = true, help_heading = "Evaluation")]
    pub max_difference_ms: f64,
}

impl MatchArgs {
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

/// Evaluates an estimate with the absolute error and the drift per frame and per second; a drift over a span that the trajectory
/// does not have is left out.
///
/// # Errors
/// Estimate and truth do not belong together, or are too short or too straight to be aligned.
pub fn judge(
    truth: &[StampedPose],
    estimate: &[StampedPose],
    expected: ExpectedFrames,
    max_diff_ns: u64,
) -> Result<Evaluation, EvalError> {
    let spans = [RpeOptions::per_frame(), RpeOptions::per_second()];
    let mut options = EvalOptions { max_diff_ns, rpe: spans.to_vec(), expected, ..Default::default() };
    loop {
        match evaluate(truth, estimate, &options) {
            Err(EvalError::NoPairs { delta: Delta::Seconds(_), .. }) if options.rpe.len() > 1 => {
                options.rpe.truncate(1);
            }
            result => return result,
        }
    }
}

/// Poses in the type of the evaluator.
pub fn to_eval(poses: &[yfslam_io::StampedPose]) -> Vec<StampedPose> {
    poses.iter().map(|p| StampedPose::new(p.timestamp_ns, p.pose)).collect()
}
