//! In: the frames of a sequence and the trajectories. Out: the fraction of frames that were tracked, without which an error means little.

use crate::associate::nearest;
use crate::{EvalError, StampedPose};
use serde::{Deserialize, Serialize};

/// An estimated pose belongs to a frame if their stamps agree up to the rounding of trajectory files, ns.
const SAME_FRAME_NS: u64 = 1_000_000;

/// How many of the frames with a reference pose were tracked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Frames with an estimated pose.
    pub tracked: usize,
    /// Frames that the reference covers.
    pub expected: usize,
    /// `tracked / expected`.
    pub fraction: f64,
}

impl Coverage {
    /// Counts the frames with a reference pose within `max_diff_ns`, and those of them with an estimated pose; both trajectories are
    /// sorted by time.
    ///
    /// # Errors
    /// The reference covers no frame.
    pub fn of_frames(
        frames_ns: &[i64],
        reference: &[StampedPose],
        estimate: &[StampedPose],
        max_diff_ns: u64,
    ) -> Result<Self, EvalError> {
        let has = |poses: &[StampedPose], frame_ns: i64, within_ns: u64| {
            let closest = nearest(poses, frame_ns).and_then(|i| poses.get(i));
            closest.is_some_and(|p| p.timestamp_ns.abs_diff(frame_ns) <= within_ns)
        };
        let covered = || frames_ns.iter().filter(|&&t| has(reference, t, max_diff_ns));
        Self::of_count(covered().filter(|&&t| has(estimate, t, SAME_FRAME_NS)).count(), covered().count())
    }

    /// Computes the fraction from the number of matched poses and the number of frames that the reference covers.
    ///
    /// # Errors
    /// No frames are expected, or fewer than were matched.
    pub fn of_count(tracked: usize, expected: usize) -> Result<Self, EvalError> {
        if expected == 0 || tracked > expected {
            return Err(EvalError::BadExpectation { tracked, expected });
        }
        Ok(Self { tracked, expected, fraction: tracked as f64 / expected as f64 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;

    fn at_ms(stamps_ms: &[i64]) -> Vec<StampedPose> {
        stamps_ms.iter().map(|t| StampedPose::new(t * 1_000_000, Isometry3::identity())).collect()
    }

    #[test]
    fn frames_without_a_reference_pose_do_not_count() {
        let frames_ns: Vec<i64> = (0..10).map(|i| i * 33_000_000).collect();
        let (reference, estimate) = (at_ms(&[0, 30, 60, 100]), at_ms(&[0, 66, 132, 165]));
        let coverage = Coverage::of_frames(&frames_ns, &reference, &estimate, 10_000_000).unwrap();
        assert_eq!((coverage.tracked, coverage.expected, coverage.fraction), (2, 4, 0.5));
    }

    #[test]
    fn an_impossible_expectation_is_refused() {
        assert!(Coverage::of_count(3, 2).is_err());
        assert!(Coverage::of_frames(&[], &at_ms(&[0]), &at_ms(&[0]), 1).is_err());
    }
}
