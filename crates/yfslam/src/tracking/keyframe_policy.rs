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
    /// The most of them in a frame since the last keyframe.
    pub best_inliers: usize,
    /// Number of frames since the last keyframe.
    pub frames_since: u64,
    /// Frames per second of the camera.
    pub fps: f64,
}

/// Decides from the share of the landmarks of the reference keyframe that are tracked, and from the number of close features that are not.
///
/// Not all of these landmarks can be matched again, however near the camera is to the reference keyframe. What a keyframe would bring is
/// therefore measured against what was tracked since the last one: in a known place, where each frame finds as many landmarks as the
/// one before, few keyframes are made. A camera without depth needs them close together, because landmarks are triangulated between them.
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
    let is_beginning = submap_keyframes < YOUNG_SUBMAP_KEYFRAMES;
    let ratio = if is_beginning { config.first_reference_ratio } else { config.reference_ratio };
    let trackable = if is_beginning || !sensor.measures_depth {
        reference_landmarks
    } else {
        reference_landmarks.min(summary.best_inliers)
    };
    let weak = (summary.inliers as f64) < trackable as f64 * ratio;
    let urgent = (summary.inliers as f64) < reference_landmarks as f64 * config.urgent_ratio || needs_close;
    if summary.frames_since < config.min_frames && !urgent {
        return false;
    }
    let overdue = summary.frames_since as f64 >= summary.fps;
    let min_inliers = config.min_inliers.max(tracking.local_min_inliers / 2);
    (weak || needs_close || (overdue && summary.inliers < reference_landmarks)) && summary.inliers > min_inliers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::map::scene::Scene;

    #[test]
    fn a_keyframe_is_made_when_fewer_landmarks_are_tracked_than_since_the_last_one() {
        let (scene, mut map) = (Scene::new(), Map::default());
        let mut keyframes = Vec::new();
        for k in 0..4 {
            keyframes.push(scene.add(&mut map, k, &scene.pose(k), &keyframes));
        }
        let reference = keyframes[3];
        let landmarks = map.keyframe(reference).map_or(0, |keyframe| keyframe.observed().count());
        let mut context = Context { sensor: scene.sensor.clone(), config: Config::default() };
        assert!(context.sensor.measures_depth);
        let wanted = |context: &Context, inliers: usize, best_inliers: usize| {
            let summary = FrameSummary { inliers, best_inliers, frames_since: 10, fps: 30.0 };
            is_keyframe_wanted(context, &map, reference, &TrackedFrame::default(), summary)
        };
        assert!(!wanted(&context, landmarks, landmarks));
        assert!(wanted(&context, landmarks / 2, landmarks), "the camera sees less of the map");
        assert!(!wanted(&context, landmarks / 2, landmarks / 2 + 2), "nothing is gained by a keyframe");
        context.sensor.measures_depth = false;
        assert!(wanted(&context, landmarks / 2, landmarks / 2 + 2), "landmarks must be triangulated");
    }
}
