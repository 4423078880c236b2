//! The velocity of the camera, from the poses of successive frames.
//!
//! In: poses and the times between them. Out: the velocity at a frame, as the correction of a rolling shutter needs it.

use crate::features::rolling_shutter::Velocity;
use crate::geometry::{Pose, se3_log};

/// Mean velocity of the camera between two frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interval {
    mean: Velocity,
    seconds: f64,
}

impl Interval {
    /// Measures the velocity between the poses `t_cam_world` of two frames; `None` if they are more than `max_gap_s` apart.
    pub(crate) fn between(earlier: &Pose, later: &Pose, seconds: f64, max_gap_s: f64) -> Option<Self> {
        let mean = se3_log(&(earlier * later.inverse())) / seconds;
        (seconds > 0.0 && seconds <= max_gap_s && mean.iter().all(|v| v.is_finite())).then_some(Self { mean, seconds })
    }

    /// Returns the velocity at the end of this interval, with the acceleration since the interval `before`.
    pub(crate) fn at_end(&self, before: Option<&Self>) -> Velocity {
        let Some(before) = before else { return self.mean };
        self.mean + (self.mean - before.mean) * (self.seconds / (self.seconds + before.seconds))
    }

    /// Returns the velocity at the frame between this interval and the `next`.
    pub(crate) fn at_joint(&self, next: &Self) -> Velocity {
        (self.mean * next.seconds + next.mean * self.seconds) / (self.seconds + next.seconds)
    }

    /// The mean velocity.
    pub(crate) fn mean(&self) -> Velocity {
        self.mean
    }
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
        let between = |a: f64, b: f64| Interval::between(&pose(a), &pose(b), b - a, 0.5).unwrap();
        let (first, second) = (between(0.0, 0.03), between(0.03, 0.08));
        assert!((first.at_joint(&second) - rate * 0.06).norm() < 1e-9);
        assert!((second.at_end(Some(&first)) - rate * 0.16).norm() < 1e-9);
        assert!((second.at_end(None) - rate * 0.11).norm() < 1e-9);
    }

    #[test]
    fn no_velocity_follows_from_a_gap_or_from_no_time() {
        let pose = Pose::translation(0.1, 0.0, 0.0);
        assert!(Interval::between(&Pose::identity(), &pose, 0.6, 0.5).is_none());
        assert!(Interval::between(&Pose::identity(), &pose, 0.0, 0.5).is_none());
    }
}
