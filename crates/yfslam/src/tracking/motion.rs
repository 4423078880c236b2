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
