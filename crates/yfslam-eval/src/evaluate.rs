//! In: two trajectories and what to measure. Out: every figure of one run.

use crate::{
    AlignmentKind, Ate, Coverage, DEFAULT_MAX_DIFF_NS, EvalError, Match, Rpe, RpeOptions, StampedPose, associate, ate,
    rpe,
};
use serde::{Deserialize, Serialize};

/// The frames that the estimate should have a pose for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExpectedFrames {
    /// Not known; there is no tracked fraction.
    #[default]
    Unknown,
    /// Stamps of all frames of the sequence, ns; those without a reference pose do not count.
    StampsNs(Vec<i64>),
    /// Number of the frames that the reference covers.
    Count(usize),
}

/// Options of an evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvalOptions {
    /// Largest difference between the stamps of a match, ns.
    pub max_diff_ns: u64,
    /// Alignment before the absolute trajectory error. Its scale, if it has one, is also used for the relative errors.
    pub alignment: AlignmentKind,
    /// Relative pose errors to compute.
    pub rpe: Vec<RpeOptions>,
    /// Frames for the tracked fraction.
    pub expected: ExpectedFrames,
}

impl Default for EvalOptions {
    fn default() -> Self {
        Self {
            max_diff_ns: DEFAULT_MAX_DIFF_NS,
            alignment: AlignmentKind::default(),
            rpe: vec![RpeOptions::per_frame(), RpeOptions::per_second()],
            expected: ExpectedFrames::default(),
        }
    }
}

/// All errors of one estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Number of poses of the reference.
    pub reference_poses: usize,
    /// Number of poses of the estimate.
    pub estimate_poses: usize,
    /// Number of pairs of poses that were compared.
    pub matches: usize,
    /// Largest allowed difference between the stamps of a match, ns.
    pub max_diff_ns: u64,
    /// Absolute trajectory error.
    pub ate: Ate,
    /// Absolute trajectory error after the other alignment by least squares: Sim(3) beside SE(3), SE(3) beside Sim(3); `None` without
    /// such an alignment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beside: Option<Ate>,
    /// Relative pose errors, in the order of the options.
    pub rpe: Vec<Rpe>,
    /// Length of the estimated path divided by that of the reference, both through the matched poses and with the scale of the
    /// alignment; `None` if the reference does not move.
    pub path_ratio: Option<f64>,
    /// Tracked fraction, if the expected frames are known.
    pub coverage: Option<Coverage>,
}

impl Evaluation {
    /// Returns the scale of the Sim(3) alignment: by how much the estimate has to be enlarged to fit the reference.
    pub fn scale(&self) -> Option<f64> {
        let both = [Some(&self.ate), self.beside.as_ref()];
        both.into_iter().flatten().find(|ate| ate.alignment.kind == AlignmentKind::Sim3).map(|ate| ate.alignment.scale)
    }
}

/// Associates, aligns and measures; both trajectories are sorted by time.
///
/// # Errors
/// Those of [`associate()`], [`ate`], [`rpe()`] and [`Coverage`].
pub fn evaluate(
    reference: &[StampedPose],
    estimate: &[StampedPose],
    options: &EvalOptions,
) -> Result<Evaluation, EvalError> {
    let matches = associate(reference, estimate, options.max_diff_ns)?;
    let coverage = match &options.expected {
        ExpectedFrames::Unknown => None,
        ExpectedFrames::StampsNs(frames_ns) => {
            Some(Coverage::of_frames(frames_ns, reference, estimate, options.max_diff_ns)?)
        }
        ExpectedFrames::Count(expected) => Some(Coverage::of_count(matches.len(), *expected)?),
    };
    let other = match options.alignment {
        AlignmentKind::Se3 => Some(AlignmentKind::Sim3),
        AlignmentKind::Sim3 => Some(AlignmentKind::Se3),
        AlignmentKind::Origin | AlignmentKind::None => None,
    };
    let beside = other.and_then(|kind| ate(&matches, kind).ok());
    let ate = ate(&matches, options.alignment)?;
    let scaled = ate.alignment.scaled(&matches);
    Ok(Evaluation {
        reference_poses: reference.len(),
        estimate_poses: estimate.len(),
        matches: matches.len(),
        max_diff_ns: options.max_diff_ns,
        ate,
        beside,
        path_ratio: path_ratio(&scaled),
        rpe: options.rpe.iter().map(|o| rpe(&scaled, o)).collect::<Result<_, _>>()?,
        coverage,
    })
}

fn path_ratio(matches: &[Match]) -> Option<f64> {
    let (reference, estimate) = matches.windows(2).fold((0.0, 0.0), |(reference, estimate), pair| {
        let step = |a: &StampedPose, b: &StampedPose| {
            (b.t_world_cam.translation.vector - a.t_world_cam.translation.vector).norm()
        };
        (
            reference + step(&pair[0].reference, &pair[1].reference),
            estimate + step(&pair[0].estimate, &pair[1].estimate),
        )
    });
    (reference > 0.0).then(|| estimate / reference)
}
