//! The result of one frame.

use nalgebra::Matrix6;

use super::{FrameHealth, StageTimes};
use crate::geometry::Pose;
use crate::loops::LoopClosure;
use crate::tracking::{LostReason, TrackingStart, TrackingState};

/// The result of one frame.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Tracked {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// Whether the pose is known.
    pub state: TrackingState,
    /// Pose of the camera in the world as known now; `None` unless tracking.
    pub t_world_cam: Option<Pose>,
    /// Covariance of the pose error δ in `t_world_cam · exp(δ)`, δ = (translation in m, rotation in rad) along the camera's axes: it
    /// follows from the noise of the matched features, the map taken as exact. Zero for the frame that defines the world. `None` unless
    /// tracking, and where the matches leave a direction open.
    pub covariance: Option<Matrix6<f64>>,
    /// Matched landmarks that fit the pose.
    pub inliers: usize,
    /// Whether the frame became a keyframe, or was handed over to become one.
    pub is_keyframe: bool,
    /// How tracking began with this frame; `None` if the frame before was tracked too, or this one is not.
    pub start: Option<TrackingStart>,
    /// Why the pose is not known; `None` while tracking.
    pub lost_reason: Option<LostReason>,
    /// The loop that a keyframe closed, this one or, with mapping on its own thread, an earlier one: all poses may have changed.
    pub loop_closure: Option<LoopClosure>,
    /// Signs that the result may be wrong although no stage reports an error.
    pub health: FrameHealth,
    /// Wall time of the stages.
    pub times: StageTimes,
}
