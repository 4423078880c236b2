//! The pose type of this crate, and the check of trajectories before they are compared.

use crate::{EvalError, Trajectory};
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

/// Largest distance of a position from the origin, m; below it no square or sum over poses overflows.
const MAX_DISTANCE_M: f64 = 1e9;

/// Pose of the camera in the world at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StampedPose {
    /// Time, ns.
    pub timestamp_ns: i64,
    /// Maps points of the camera frame into the world frame, m.
    pub t_world_cam: Isometry3<f64>,
}

impl StampedPose {
    /// Creates a pose at a time in ns; `t_world_cam` maps points of the camera frame into the world frame.
    pub fn new(timestamp_ns: i64, t_world_cam: Isometry3<f64>) -> Self {
        Self { timestamp_ns, t_world_cam }
    }
}

/// Refuses trajectories without poses, with times that run backward, or with values that are not finite.
pub(crate) fn check(poses: &[StampedPose], trajectory: Trajectory) -> Result<(), EvalError> {
    if poses.is_empty() {
        return Err(EvalError::Empty { trajectory });
    }
    for (index, pose) in poses.iter().enumerate() {
        let rotation_norm = pose.t_world_cam.rotation.norm();
        let distance_m = pose.t_world_cam.translation.vector.norm();
        // Written so that NaN fails.
        if !(distance_m < MAX_DISTANCE_M && (rotation_norm - 1.0).abs() < 1e-3) {
            return Err(EvalError::BadPose { trajectory, index, timestamp_ns: pose.timestamp_ns });
        }
    }
    match poses.windows(2).position(|w| matches!(w, [a, b] if b.timestamp_ns < a.timestamp_ns)) {
        Some(before) => Err(EvalError::Unsorted { trajectory, index: before + 1 }),
        None => Ok(()),
    }
}
