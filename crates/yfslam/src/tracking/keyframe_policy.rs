//! Whether a frame is worth a keyframe (ORB-SLAM2, IEEE T-RO 2017, section III-E).

use crate::context::Context;
use crate::map::{KeyFrameId, Map};
use crate::tracking::tracked_frame::TrackedFrame;

/// What the decision is made from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameSummary {
    /// Matched landmarks that fit the pose.
    pub inliers: usize,
    /// Frames since the last keyframe.
    pub frames_since: u64,
    /// Frames per second of the camera.
    pub fps: f64,
}

/// Decides from the share of the reference keyframe's landmarks still tracked, and from close features not tracked.
pub(crate) fn is_keyframe_wanted(
    context: &Context,
    map: &Map,
    reference: KeyFrameId,
    frame: &TrackedFrame,
    summary: FrameSummary,
) -> bool {
    let (sensor, config, tracking) = (&context.sensor, &context.config.keyframes, &context.config.tracking);
    let known = map.submap_size(reference, 3);
    let few = known <= 2;
    let min_weight = if few { config.min_observation_weight.saturating_sub(1) } else { config.min_observation_weight };
    let reference_landmarks = map.keyframe(reference).map_or(0, |k| {
        k.observed().filter_map(|(_, l)| map.landmark(l)).filter(|l| map.observation_weight(l) >= min_weight).count()
    });
    let (mut close_tracked, mut close_untracked) = (0, 0);
    for (feature, matched) in frame.features.features.iter().zip(&frame.matches) {
        if feature.trust > 0.0 && feature.depth_m.is_some_and(|z| f64::from(z) < sensor.close_limit_m) {
            if matched.is_some_and(|s| s.landmark.is_some()) { close_tracked += 1 } else { close_untracked += 1 }
        }
    }
    let need_close = close_tracked < config.close_tracked && close_untracked > config.close_untracked;
    let ratio = if known < 2 { config.first_reference_ratio } else { config.reference_ratio };
    let weak = (summary.inliers as f64) < reference_landmarks as f64 * ratio;
    let urgent = (summary.inliers as f64) < reference_landmarks as f64 * config.urgent_ratio || need_close;
    if summary.frames_since < config.min_frames && !urgent {
        return false;
    }
    let overdue = summary.frames_since as f64 >= summary.fps;
    let floor = config.min_inliers.max(tracking.local_min_inliers / 2);
    (weak || need_close || (overdue && summary.inliers < reference_landmarks)) && summary.inliers > floor
}
