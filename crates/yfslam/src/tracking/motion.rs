//! The velocity of the camera, from the poses of successive frames.
//!
//! In: poses and the times between them. Out: the velocity at a frame, as the correction of a rolling shutter needs it.

use nalgebra::{Matrix6, Vector6};

use crate::features::rolling_shutter::Velocity;
use crate::geometry::{Pose, se3_log};

/// Standard deviation of the acceleration of a camera, m/s². Source: chosen: a hand or a robot that changes direction; a certain velocity is
/// hardly changed by it.
const ACCELERATION_M_PER_S2: f64 = 5.0;
/// Standard deviation of the angular acceleration, rad/s². Source: as [`ACCELERATION_M_PER_S2`].
const ACCELERATION_RAD_PER_S2: f64 = 10.0;

/// Mean velocity of the camera between two poses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interval {
    mean: Velocity,
    /// Times of the poses relative to the time of the later frame, s.
    from_s: f64,
    to_s: f64,
}

impl Interval {
    /// Measures the velocity between two poses `t_cam_world` with their times, s after the later frame; `None` if they are more than
    /// `max_gap_s` apart.
    pub(crate) fn between(
        (earlier, from_s): (&Pose, f64),
        (later, to_s): (&Pose, f64),
        max_gap_s: f64,
    ) -> Option<Self> {
        let seconds = to_s - from_s;
        let mean = se3_log(&(earlier * later.inverse())) / seconds;
        let is_usable = seconds > 0.0 && seconds <= max_gap_s && mean.iter().all(|v| v.is_finite());
        is_usable.then_some(Self { mean, from_s, to_s })
    }

    /// Returns the interval relative to a frame that came `seconds` after its own.
    pub(crate) fn earlier_by(self, seconds: f64) -> Self {
        Self { from_s: self.from_s - seconds, to_s: self.to_s - seconds, ..self }
    }

    /// Returns the velocity at a time, for a constant acceleration since the interval `before`.
    pub(crate) fn velocity_at(&self, seconds: f64, before: Option<&Self>) -> Velocity {
        let Some(before) = before else { return self.mean };
        let (middle, middle_before) = (self.middle_s(), before.middle_s());
        // Both times are those of poses, which follow each other.
        self.mean + (self.mean - before.mean) * ((seconds - middle) / (middle - middle_before))
    }

    fn middle_s(&self) -> f64 {
        0.5 * (self.from_s + self.to_s)
    }
}

/// Returns the velocity between the one that is `expected`, because the camera had it `seconds` ago, and the one that was measured with that
/// covariance: the less certain the poses, the less it follows them. Otherwise a poor pose would give a poor velocity, whose correction
/// would make the pose still worse.
pub(crate) fn weighted(expected: &Velocity, measured: &Velocity, covariance: &Matrix6<f64>, seconds: f64) -> Velocity {
    let [linear, angular] = [ACCELERATION_M_PER_S2, ACCELERATION_RAD_PER_S2].map(|a| (a * seconds).powi(2));
    let spread = Matrix6::from_diagonal(&Vector6::new(linear, linear, linear, angular, angular, angular));
    // Without a covariance that can be inverted nothing was measured.
    let inverse = (spread + covariance).try_inverse().filter(|inverse| inverse.iter().all(|v| v.is_finite()));
    let gain = inverse.map(|inverse| spread * inverse).unwrap_or_default();
    expected + gain * (measured - expected)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::se3_exp;

    #[test]
    fn velocities_of_an_accelerated_camera_are_found_at_the_frames() {
        let rate = Velocity::new(0.2, -0.1, 0.3, 0.0, 0.0, 0.0);
        // Position = rate · t², so the velocity is 2 · rate · t.
        let pose = |t: f64| se3_exp(&(rate * (t * t))).inverse();
        let between = |a: f64, b: f64| Interval::between((&pose(a), a - b), (&pose(b), 0.0), 0.5).unwrap();
        let (first, second) = (between(0.0, 0.03).earlier_by(0.05), between(0.03, 0.08));
        assert!((second.velocity_at(-0.05, Some(&first)) - rate * 0.06).norm() < 1e-9);
        assert!((second.velocity_at(0.0, Some(&first)) - rate * 0.16).norm() < 1e-9);
        assert!((second.velocity_at(0.0, None) - rate * 0.11).norm() < 1e-9);
    }

    #[test]
    fn a_velocity_follows_certain_poses_and_not_uncertain_ones() {
        let (expected, measured) = (Velocity::zeros(), Velocity::new(0.5, 0.0, 0.0, 0.0, 0.5, 0.0));
        let follows = |sigma: f64| weighted(&expected, &measured, &(Matrix6::identity() * sigma * sigma), 0.033);
        assert!((follows(0.001) - measured).norm() < 1e-3);
        assert!(follows(30.0).norm() < 0.01 * measured.norm());
        assert_eq!(weighted(&expected, &measured, &Matrix6::from_element(f64::NAN), 0.033), expected);
    }

    #[test]
    fn no_velocity_follows_from_a_gap_or_from_no_time() {
        let pose = Pose::translation(0.1, 0.0, 0.0);
        assert!(Interval::between((&Pose::identity(), -0.6), (&pose, 0.0), 0.5).is_none());
        assert!(Interval::between((&Pose::identity(), 0.0), (&pose, 0.0), 0.5).is_none());
    }
}
