//! In: two trajectories. Out: pairs of poses at nearly the same time.
//!
//! Each pose of the trajectory with fewer poses (the estimate if they are equal) is matched with the pose of the other one that has the
//! nearest stamp, the earlier in a tie, if it is within the tolerance. A pose of the longer trajectory can be matched twice, as in `evo`.
//!
//! Differences are computed in seconds as `f64`, as in `evo` and the tools of the TUM benchmark. With ground truth stamps of four
//! decimals an estimate often lies exactly between two of them; then rounding decides, and only the same rounding gives the same matches.

use crate::{EvalError, StampedPose, Trajectory, pose};

/// Default tolerance, ns, as in `evo`. Some recordings need more: the stamps of the Bonn ground truth are up to 20 ms off.
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
/// A trajectory is empty, unsorted or not finite, they do not overlap in time, or there is no match within the tolerance.
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
        let diff_s = |p: &StampedPose| (seconds(p.timestamp_ns) - seconds(pose.timestamp_ns)).abs();
        let candidates = around(longer, pose.timestamp_ns).filter_map(|i| longer.get(i));
        let Some(&partner) = candidates.min_by(|a, b| diff_s(a).total_cmp(&diff_s(b))) else { continue };
        closest_ns = closest_ns.min(pose.timestamp_ns.abs_diff(partner.timestamp_ns));
        if diff_s(&partner) <= max_diff_ns as f64 / 1e9 {
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

/// Returns the indices of the last pose up to a time and of the first after it.
fn around(sorted: &[StampedPose], timestamp_ns: i64) -> impl Iterator<Item = usize> {
    let after = sorted.partition_point(|p| p.timestamp_ns <= timestamp_ns);
    [after.checked_sub(1), Some(after)].into_iter().flatten().filter(|&i| i < sorted.len())
}

/// Returns the index of the pose nearest in time, the earlier in a tie; `None` without poses.
pub(crate) fn nearest(sorted: &[StampedPose], timestamp_ns: i64) -> Option<usize> {
    around(sorted, timestamp_ns).min_by_key(|&i| sorted.get(i).map(|p| p.timestamp_ns.abs_diff(timestamp_ns)))
}

/// Converts a time to the nearest `f64`, s.
fn seconds(timestamp_ns: i64) -> f64 {
    let whole = timestamp_ns.div_euclid(1_000_000_000);
    whole as f64 + timestamp_ns.rem_euclid(1_000_000_000) as f64 / 1e9
}

fn span_ns(poses: &[StampedPose]) -> Option<[i64; 2]> {
    Some([poses.first()?.timestamp_ns, poses.last()?.timestamp_ns])
}
