//! In: two trajectories. Out: pairs of poses of (nearly) the same time.
//!
//! Each pose of the trajectory with fewer poses (the estimate if they are equal) takes the pose of the other one with the nearest
//! stamp, the earlier at a tie, if it is near enough. So a pose of the longer one can serve twice; `evo` does the same.

use crate::{EvalError, StampedPose, Trajectory, pose};

/// Tolerance of `evo` and our default, ns. Some recordings need more: the stamps of the Bonn ground truth are up to 20 ms off.
pub const DEFAULT_MAX_DIFF_NS: u64 = 10_000_000;

/// A reference pose and an estimated pose of the same time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// The reference pose.
    pub reference: StampedPose,
    /// The estimated pose.
    pub estimate: StampedPose,
}

/// Pairs the poses of two trajectories, each sorted by time, whose stamps differ by at most `max_diff_ns`.
///
/// Returns at least one match, in order of time.
///
/// # Errors
/// Empty, unsorted or non-finite trajectories; no overlap in time; no match within the tolerance.
pub fn associate(
    reference: &[StampedPose],
    estimate: &[StampedPose],
    max_diff_ns: u64,
) -> Result<Vec<Match>, EvalError> {
    pose::check(reference, Trajectory::Reference)?;
    pose::check(estimate, Trajectory::Estimate)?;
    let estimate_leads = estimate.len() <= reference.len();
    let (shorter, longer) = if estimate_leads { (estimate, reference) } else { (reference, estimate) };
    let mut closest_ns = u64::MAX;
    let mut matches = Vec::with_capacity(shorter.len());
    for &pose in shorter {
        let Some(&partner) = nearest(longer, pose.timestamp_ns).and_then(|i| longer.get(i)) else { continue };
        let diff_ns = pose.timestamp_ns.abs_diff(partner.timestamp_ns);
        closest_ns = closest_ns.min(diff_ns);
        if diff_ns <= max_diff_ns {
            let (reference, estimate) = if estimate_leads { (partner, pose) } else { (pose, partner) };
            matches.push(Match { reference, estimate });
        }
    }
    if !matches.is_empty() {
        return Ok(matches);
    }
    match (span_ns(reference), span_ns(estimate)) {
        (Some(r), Some(e)) if r[1] < e[0] || e[1] < r[0] => {
            Err(EvalError::NoOverlap { reference_ns: r, estimate_ns: e })
        }
        _ => Err(EvalError::NoMatch { max_diff_ns, closest_ns }),
    }
}

/// Index of the pose nearest in time, the earlier at a tie; `None` if there are no poses.
pub(crate) fn nearest(sorted: &[StampedPose], timestamp_ns: i64) -> Option<usize> {
    let after = sorted.partition_point(|p| p.timestamp_ns < timestamp_ns);
    let candidates = [after.checked_sub(1), Some(after)].into_iter().flatten();
    candidates
        .filter(|&i| i < sorted.len())
        .min_by_key(|&i| sorted.get(i).map(|p| p.timestamp_ns.abs_diff(timestamp_ns)))
}

fn span_ns(poses: &[StampedPose]) -> Option<[i64; 2]> {
    Some([poses.first()?.timestamp_ns, poses.last()?.timestamp_ns])
}
