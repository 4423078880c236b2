//! Errors of the comparison of two trajectories: every message names the values and what to do.

use std::fmt;
use thiserror::Error;

/// Which of the two trajectories an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trajectory {
    /// The reference (ground truth).
    Reference,
    /// The estimate.
    Estimate,
}

impl fmt::Display for Trajectory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Reference => "reference",
            Self::Estimate => "estimate",
        })
    }
}

/// Why two trajectories cannot be compared.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum EvalError {
    /// A trajectory without poses.
    #[error("the {trajectory} has no poses: check that it is the right file and that the run reached a first pose")]
    Empty {
        /// The trajectory without poses.
        trajectory: Trajectory,
    },
    /// NaN, infinity, a position beyond 1e9 m or a rotation that is not a unit quaternion.
    #[error(
        "pose {index} of the {trajectory}, at {} s, is not finite, is beyond 1e9 m or has no unit quaternion: \
         remove poses of frames that were not tracked",
        seconds(*timestamp_ns)
    )]
    BadPose {
        /// The trajectory with the bad pose.
        trajectory: Trajectory,
        /// Index of the pose, from 0.
        index: usize,
        /// Its time, ns.
        timestamp_ns: i64,
    },
    /// Time runs backward.
    #[error("pose {index} of the {trajectory} is older than the one before it: sort the trajectory by time")]
    Unsorted {
        /// The unsorted trajectory.
        trajectory: Trajectory,
        /// Index of the first pose that is older than its predecessor, from 0.
        index: usize,
    },
    /// The time spans do not overlap.
    #[error(
        "no overlap in time: the reference covers {} to {} s, the estimate {} to {} s; they are of different recordings, \
         or of different clocks; in that case shift the estimate, by about {} s if both start together",
        seconds(reference_ns[0]), seconds(reference_ns[1]), seconds(estimate_ns[0]), seconds(estimate_ns[1]),
        seconds(reference_ns[0].saturating_sub(estimate_ns[0]))
    )]
    NoOverlap {
        /// First and last time of the reference, ns.
        reference_ns: [i64; 2],
        /// First and last time of the estimate, ns.
        estimate_ns: [i64; 2],
    },
    /// The time spans overlap, but no two stamps are close enough.
    #[error(
        "no two stamps are within {} ms of each other, the closest are {} ms apart: raise the tolerance if the reference is \
         that sparse, or correct an offset between the clocks",
        *max_diff_ns as f64 / 1e6, *closest_ns as f64 / 1e6
    )]
    NoMatch {
        /// Requested tolerance, ns.
        max_diff_ns: u64,
        /// Smallest difference of two stamps, ns.
        closest_ns: u64,
    },
    /// Fewer matches than the metric needs.
    #[error(
        "{found} matched poses, at least {needed} are needed: check how much of the sequence was tracked, or raise the tolerance \
         of the association"
    )]
    TooFewMatches {
        /// Number of matches.
        found: usize,
        /// Number of matches that are needed.
        needed: usize,
    },
    /// Positions that do not determine the rotation of the alignment.
    #[error(
        "the matched positions lie on one line or at one point, so no unique rotation aligns them (rms spread: reference \
         {reference_spread_m:.3e} m, estimate {estimate_spread_m:.3e} m): use the relative pose error, which needs no alignment"
    )]
    Degenerate {
        /// Root mean square distance of the reference positions from their centroid, m.
        reference_spread_m: f64,
        /// Root mean square distance of the estimated positions from their centroid, m.
        estimate_spread_m: f64,
    },
    /// A delta or tolerance that is zero, negative or not finite.
    #[error(
        "a relative pose error over {delta} with tolerance {relative_tolerance} is undefined: give a positive delta and a tolerance of 0 or more"
    )]
    BadDelta {
        /// The requested delta.
        delta: crate::Delta,
        /// The requested tolerance, as a fraction of the delta.
        relative_tolerance: f64,
    },
    /// No two poses are that far apart.
    #[error(
        "no two of the {matches} matched poses are {delta} apart; they span {duration_s:.3} s and {path_m:.3} m: choose a smaller \
         delta or a larger tolerance"
    )]
    NoPairs {
        /// The requested delta.
        delta: crate::Delta,
        /// Number of matched poses.
        matches: usize,
        /// Time from the first to the last, s.
        duration_s: f64,
        /// Length of the estimated path through them, m.
        path_m: f64,
    },
    /// The expected number of frames contradicts the trajectories.
    #[error(
        "{tracked} tracked frames of {expected} expected: give the stamps or the number of the frames that the reference covers"
    )]
    BadExpectation {
        /// Frames with a matched pose.
        tracked: usize,
        /// Frames expected.
        expected: usize,
    },
}

/// Formats a time in seconds, exact to the nanosecond.
fn seconds(ns: i64) -> String {
    let sign = if ns < 0 { "-" } else { "" };
    format!("{sign}{}.{:09}", ns.unsigned_abs() / 1_000_000_000, ns.unsigned_abs() % 1_000_000_000)
}
