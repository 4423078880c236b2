//! The decision when to insert a keyframe (ORB-SLAM2, IEEE T-RO 2017, section III-E).
//!
//! In: a tracked frame and its reference keyframe. Out: whether the frame becomes a keyframe.

use crate::context::Context;
use crate::map::{KeyFrameId, Map};
use crate::tracking::tracked_frame::TrackedFrame;

/// Number of keyframes up to which a submap is young: its landmarks have had time for few observations. Source: ORB-SLAM2.
const YOUNG_SUBMAP_KEYFRAMES: usize = 2;

/// Values on which the decision is based.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameSummary {
    /// Number of matched landmarks that are inliers.
    pub inliers: usize,
    /// Number of frames since the last keyframe.
    pub frames_since: u64,
    /// Frames per second of the camera.
    pub fps: f64,
}

/// Decides from the share of the landmarks of the reference keyframe that are tracked, and from the number of close features that are not.
pub(crate) fn is_keyframe_wanted(
    context: &Context,
    map: &Map,
    reference: KeyFrameId,
    frame: &TrackedFrame,
    summary: FrameSummary,
) -> bool {
    let (sensor, config, tracking) = (&context.sensor, &context.config.keyframes, &context.config.tracking);
    let submap_keyframes = map.submap_size(reference, YOUNG_SUBMAP_KEYFRAMES + 1);
    let is_young = submap_keyframes <= YOUNG_SUBMAP_KEYFRAMES;
    let min_weight =
        if is_young { config.min_observation_weight.saturating_sub(1) } else { config.min_observation_weight };
    let reference_landmarks = map.keyframe(reference).map_or(0, |k| {
        k.observed().filter_map(|(_, l)| map.landmark(l)).filter(|l| map.observation_weight(l) >= min_weight).count()
    });
    let (mut close_tracked, mut close_untracked) = (0, 0);
    for (feature, matched) in frame.features.features.iter().zip(&frame.matches) {
        if feature.trust > 0.0 && feature.depth_m.is_some_and(|z| f64::from(z) < sensor.close_limit_m) {
            if matched.is_some_and(|m| m.landmark.is_some()) { close_tracked += 1 } else { close_untracked += 1 }
        }
    }
    let needs_close = close_tracked < config.close_tracked && close_untracked > config.close_untracked;
    let ratio =
        if submap_keyframes < YOUNG_SUBMAP_KEYFRAMES { config.first_reference_ratio } else { config.reference_ratio };
    let weak = (summary.inliers as f64) < reference_landmarks as f64 * ratio;
    let urgent = (summary.inliers as f64) < reference_landmarks as f64 * config.urgent_ratio || needs_close;
    if summary.frames_since < config.min_frames && !urgent {
        return false;
    }
    let overdue = summary.frames_since as f64 >= summary.fps;
    let min_inliers = config.min_inliers.max(tracking.local_min_inliers / 2);
    (weak || needs_close || (overdue && summary.inliers < reference_landmarks)) && summary.inliers > min_inliers
}
