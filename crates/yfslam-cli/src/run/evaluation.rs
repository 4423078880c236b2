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
    /// Alignment with the ground truth; `eval` prints the errors after SE(3) and Sim(3) side by side [default: se3; sim3 for runs with a
    /// single camera].
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
    /// Rotation and translation that bring the first poses together.
    Origin,
    /// None: both trajectories are in the same world.
    None,
}

impl EvaluationArgs {
    /// Returns the alignment for an estimate whose scale is known or not.
    pub fn alignment(self, scale_is_known: bool) -> AlignmentKind {
        match self.align {
            Some(AlignArg::Se3) => AlignmentKind::Se3,
            Some(AlignArg::Sim3) => AlignmentKind::Sim3,
            Some(AlignArg::Origin) => AlignmentKind::Origin,
            Some(AlignArg::None) => AlignmentKind::None,
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

/// Deviation of the scale from 1 above which it is reported.
const MAX_SCALE_ERROR: f64 = 0.1;

/// Number of matches from which on a scale means something.
const MIN_MATCHES: usize = 20;
/// The error that the scale removes, as a multiple of the error that remains, from which on the scale is not that of noise: over a short
/// path it is uncertain by some tenths.
const MIN_SCALE_ERROR_SHARE: f64 = 2.0;

/// Common depth units per metre.
const FACTORS: [f64; 9] = [1.0, 100.0, 256.0, 1000.0, 4000.0, 5000.0, 5208.0, 6553.5, 10_000.0];

/// What gave an estimate its scale.
#[derive(Clone, Copy, Debug)]
pub enum ScaleSource {
    /// Depth images with these units per metre.
    DepthFactor(f64),
    /// The baseline of a stereo camera, m.
    Baseline(f64),
    /// Unknown, of a file.
    Unknown,
}

/// Describes a scale that differs from that of the ground truth by more than a tenth, with the likely cause.
pub fn scale_warning(evaluation: &Evaluation, source: ScaleSource) -> Option<String> {
    let sim3 = [Some(&evaluation.ate), evaluation.beside.as_ref()].into_iter().flatten();
    let sim3 = sim3.into_iter().find(|ate| ate.alignment.kind == AlignmentKind::Sim3)?;
    let scale = sim3.alignment.scale;
    let errors = [evaluation.ate, evaluation.beside?].map(|ate| ate.translation_m.rmse);
    let [smaller, larger] =
        [errors.iter().copied().fold(f64::MAX, f64::min), errors.iter().copied().fold(0.0, f64::max)];
    let removed = (larger * larger - smaller * smaller).sqrt();
    let is_certain = evaluation.matches >= MIN_MATCHES && removed >= MIN_SCALE_ERROR_SHARE * smaller;
    if !is_certain || (1.0 - MAX_SCALE_ERROR..=1.0 / (1.0 - MAX_SCALE_ERROR)).contains(&scale) {
        return None;
    }
    let lengths =
        if scale > 1.0 { format!("{scale:.2} times too short") } else { format!("{:.2} times too long", 1.0 / scale) };
    let cause = match source {
        ScaleSource::DepthFactor(factor) => {
            let wanted = factor / scale;
            // A scale that was estimated over a short path is uncertain by some tenths.
            let is_near = |common: &f64| (common / wanted - 1.0).abs() < 0.25 && (common / factor - 1.0).abs() > 0.05;
            let mut common: Vec<f64> = FACTORS.into_iter().filter(is_near).collect();
            common.sort_by(|a, b| (a / wanted - 1.0).abs().total_cmp(&(b / wanted - 1.0).abs()));
            let common: Vec<String> = common.iter().map(f64::to_string).collect();
            match &common[..] {
                [] => format!("check the depth factor {factor} (about {wanted:.0} would fit) and the focal length"),
                _ => format!(
                    "the depth factor {factor} is probably wrong: about {wanted:.0} would fit; try --depth-factor {}",
                    common.join(" or ")
                ),
            }
        }
        ScaleSource::Baseline(baseline_m) => {
            format!("check the baseline {baseline_m:.4} m of the camera ({:.4} m would fit)", baseline_m * scale)
        }
        ScaleSource::Unknown => match scale {
            4.5..=5.5 | 0.18..=0.22 => {
                "depth images of 5000 units per metre were probably read as millimetres, or the reverse".into()
            }
            _ => "for a single camera use --align sim3; else check depth factor, baseline and focal length".into(),
        },
    };
    Some(format!("the scale differs from that of the ground truth: lengths are {lengths}; {cause}"))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    #[test]
    fn a_scale_that_is_wrong_is_reported_with_the_factor_that_fits() {
        let pose = |k: u32, scale: f64| {
            let t = f64::from(k) * 0.1;
            let position = Vector3::new(t.sin(), t.cos(), 0.2 * t) * scale;
            StampedPose::new(i64::from(k) * 100_000_000, Isometry3::new(position, Vector3::zeros()))
        };
        let truth: Vec<StampedPose> = (0..60).map(|k| pose(k, 1.0)).collect();
        let warning = |scale: f64, source| {
            let estimate: Vec<StampedPose> = (0..60).map(|k| pose(k, scale)).collect();
            let options = EvalOptions { rpe: Vec::new(), ..EvalOptions::default() };
            scale_warning(&evaluate(&truth, &estimate, &options).unwrap(), source)
        };
        let text = warning(5.0, ScaleSource::DepthFactor(1000.0)).unwrap();
        assert!(text.contains("5.00 times too long") && text.contains("try --depth-factor 5000"), "{text}");
        let text = warning(0.5, ScaleSource::Baseline(0.11)).unwrap();
        assert!(text.contains("2.00 times too short") && text.contains("0.2200 m would fit"), "{text}");
        assert!(warning(0.2, ScaleSource::Unknown).unwrap().contains("millimetres"));
        assert_eq!(warning(1.05, ScaleSource::DepthFactor(5000.0)), None);
    }
}
