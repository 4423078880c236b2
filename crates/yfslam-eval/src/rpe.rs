//! In: matched poses. Out: the relative pose error over a span of frames, seconds or metres.
//!
//! For a pair (i, j) of matches with reference poses Q and estimated poses P, the error is (Qᵢ⁻¹ Qⱼ)⁻¹ (Pᵢ⁻¹ Pⱼ) (Sturm et al. 2012,
//! §V-A): its translation is the drift in m, its rotation angle the drift in degrees, over that span. No alignment is involved, except
//! that the estimate of a single camera is scaled before ([`crate::Alignment::scaled`]).
//!
//! *All pairs* starts a pair at every match i, so that spans overlap; *consecutive* starts each pair at the end of the last one.
//!
//! | delta | j of a pair that starts at i |
//! |---|---|
//! | frames | i + delta. Frames are counted among the matches, so a gap in tracking counts as one step. |
//! | seconds | the j > i whose estimated stamp is nearest to that of i plus delta, the earlier in a tie, if it is within `relative_tolerance · delta` of it; if there is none, no pair starts at i |
//! | metres, consecutive | the first with at least delta of path from i, measured along the estimate |
//! | metres, all pairs | the j > i whose path from i is nearest to delta, if it is within `relative_tolerance · delta` of it |
//!
//! Frames and metres select the same pairs as `evo`. "Per second" (m/s, °/s in the papers) is all pairs at 1 s, as in the tool of the
//! TUM benchmark with a fixed delta; the error is not divided by the exact time difference.

use crate::associate::nearest;
use crate::{Delta, EvalError, Match, StampedPose, Statistics};
use serde::{Deserialize, Serialize};

/// Options of a relative pose error: which pairs are compared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RpeOptions {
    /// Span of a pair.
    pub delta: Delta,
    /// Whether a pair starts at every pose and not at the end of the last pair.
    pub all_pairs: bool,
    /// Tolerance of a span in seconds, or in metres with all pairs, as a fraction of delta. Source: 0.1 as in `evo`.
    pub relative_tolerance: f64,
}

impl RpeOptions {
    /// Selects pairs of the given span with a tolerance of 0.1.
    pub fn new(delta: Delta, all_pairs: bool) -> Self {
        Self { delta, all_pairs, relative_tolerance: 0.1 }
    }

    /// Selects all pairs of neighbours: drift per frame.
    pub fn per_frame() -> Self {
        Self::new(Delta::Frames(1), false)
    }

    /// Selects all pairs that are 1 s apart: drift per second. The tolerance of 0.05 suits every frame rate from 10 Hz on and excludes
    /// spans that are shortened by a gap in tracking or by the end of the trajectory.
    pub fn per_second() -> Self {
        Self { relative_tolerance: 0.05, ..Self::new(Delta::Seconds(1.0), true) }
    }
}

/// Relative pose error over one span.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rpe {
    /// The pairs that were compared.
    pub options: RpeOptions,
    /// Translations of the errors, m.
    pub translation_m: Statistics,
    /// Rotation angles of the errors, degrees.
    pub rotation_deg: Statistics,
}

/// Computes the relative pose error of matches, which are in order of time as [`crate::associate`] returns them.
///
/// # Errors
/// There are fewer than two matches, the delta or tolerance is out of range, or no two poses are that far apart.
pub fn rpe(matches: &[Match], options: &RpeOptions) -> Result<Rpe, EvalError> {
    if matches.len() < 2 {
        return Err(EvalError::TooFewMatches { found: matches.len(), needed: 2 });
    }
    let positive = match options.delta {
        Delta::Frames(n) => n > 0,
        Delta::Seconds(d) | Delta::Metres(d) => d > 0.0 && d.is_finite(),
    };
    if !positive || options.relative_tolerance.is_nan() || options.relative_tolerance < 0.0 {
        let RpeOptions { delta, relative_tolerance, .. } = *options;
        return Err(EvalError::BadDelta { delta, relative_tolerance });
    }
    let spans = Spans::of(matches);
    let (translations_m, rotations_deg): (Vec<f64>, Vec<f64>) =
        spans.pairs(options).filter_map(|(i, j)| Some(error(matches.get(i)?, matches.get(j)?))).unzip();
    match (Statistics::of(&translations_m), Statistics::of(&rotations_deg)) {
        (Some(translation_m), Some(rotation_deg)) => Ok(Rpe { options: *options, translation_m, rotation_deg }),
        _ => Err(spans.no_pairs(options.delta)),
    }
}

/// Returns the translation (m) and rotation angle (degrees) of the relative pose error between two matches.
fn error(from: &Match, to: &Match) -> (f64, f64) {
    let motion_reference = from.reference.t_world_cam.inv_mul(&to.reference.t_world_cam);
    let motion_estimate = from.estimate.t_world_cam.inv_mul(&to.estimate.t_world_cam);
    let error = motion_reference.inv_mul(&motion_estimate);
    (error.translation.vector.norm(), error.rotation.angle().to_degrees())
}

/// The place of each match along the estimate, in time and in path.
struct Spans {
    poses: Vec<StampedPose>,
    path_m: Vec<f64>,
}

impl Spans {
    fn of(matches: &[Match]) -> Self {
        let poses: Vec<StampedPose> = matches.iter().map(|m| m.estimate).collect();
        let mut travelled_m = 0.0;
        let mut last = None;
        let path_m = poses
            .iter()
            .map(|p| {
                let position = p.t_world_cam.translation.vector;
                travelled_m += last.replace(position).map_or(0.0, |l| (position - l).norm());
                travelled_m
            })
            .collect();
        Self { poses, path_m }
    }

    fn pairs(&self, options: &RpeOptions) -> impl Iterator<Item = (usize, usize)> {
        let mut start = 0;
        std::iter::from_fn(move || {
            while start < self.poses.len() {
                let from = start;
                let to = self.partner(from, options);
                start = to.filter(|_| !options.all_pairs).unwrap_or(from + 1);
                if let Some(to) = to {
                    return Some((from, to));
                }
            }
            None
        })
    }

    /// Returns the end of the pair that starts at `from`; it is always after `from`.
    fn partner(&self, from: usize, options: &RpeOptions) -> Option<usize> {
        let to = match options.delta {
            Delta::Frames(n) => from.checked_add(n)?,
            Delta::Seconds(delta_s) => {
                let delta_ns = (delta_s * 1e9).round() as i64;
                let target_ns = self.poses.get(from)?.timestamp_ns.saturating_add(delta_ns);
                let to = from + 1 + nearest(self.poses.get(from + 1..)?, target_ns)?;
                let miss_ns = self.poses.get(to)?.timestamp_ns.abs_diff(target_ns);
                (miss_ns as f64 <= options.relative_tolerance * delta_s * 1e9).then_some(to)?
            }
            Delta::Metres(delta_m) => {
                let start_m = self.path_m.get(from)?;
                let first_beyond = from + 1 + self.path_m.get(from + 1..)?.partition_point(|p| p - start_m < delta_m);
                if !options.all_pairs {
                    first_beyond
                } else {
                    let miss_m = |i: usize| self.path_m.get(i).map_or(f64::INFINITY, |p| (p - start_m - delta_m).abs());
                    let before = first_beyond - 1;
                    let to =
                        if before > from && miss_m(before) <= miss_m(first_beyond) { before } else { first_beyond };
                    (miss_m(to) <= options.relative_tolerance * delta_m).then_some(to)?
                }
            }
        };
        (to < self.poses.len()).then_some(to)
    }

    fn no_pairs(&self, delta: Delta) -> EvalError {
        let duration_ns = match (self.poses.first(), self.poses.last()) {
            (Some(first), Some(last)) => last.timestamp_ns.saturating_sub(first.timestamp_ns),
            _ => 0,
        };
        let path_m = self.path_m.last().copied().unwrap_or(0.0);
        EvalError::NoPairs { delta, matches: self.poses.len(), duration_s: duration_ns as f64 / 1e9, path_m }
    }
}
