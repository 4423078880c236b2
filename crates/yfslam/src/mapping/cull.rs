//! Culling of recent landmarks and of redundant keyframes (ORB-SLAM, IEEE T-RO 2015, sections VI-B and VI-E).
//!
//! In: a new keyframe. Out: the map without unreliable landmarks and redundant keyframes.

use crate::config::MappingConfig;
use crate::context::Context;
use crate::map::{KeyFrameId, LandmarkId, Map};

/// Number of keyframes after which a landmark must have enough observations (ORB-SLAM, IEEE T-RO 2015, section VI-B).
const MIN_AGE_KEYFRAMES: u64 = 2;

/// Removes recent landmarks that are rarely matched or have few observations. Returns those that are still recent after `keyframe`.
pub(super) fn young_landmarks(
    config: &MappingConfig,
    map: &mut Map,
    keyframe: KeyFrameId,
    young: Vec<LandmarkId>,
) -> Vec<LandmarkId> {
    let now = map.keyframe(keyframe).map_or(0, |k| k.sequence);
    let mut still_young = Vec::with_capacity(young.len());
    for id in young {
        let Some(landmark) = map.landmark(id) else { continue };
        let age = now.saturating_sub(landmark.born);
        let is_rarely_matched = f64::from(landmark.found) < config.min_found_ratio * f64::from(landmark.visible);
        let has_few_observations =
            age >= MIN_AGE_KEYFRAMES && map.observation_weight(landmark) < config.min_observation_weight;
        if is_rarely_matched || has_few_observations {
            map.remove_landmark(id);
        } else if age < config.probation_keyframes {
            still_young.push(id);
        }
    }
    still_young
}

/// Removes the covisible keyframes of `keyframe` that are redundant: enough other keyframes observe nearly all of their close landmarks at
/// the same or a finer scale. Without depth all landmarks count.
pub(super) fn redundant_keyframes(context: &Context, map: &mut Map, keyframe: KeyFrameId) {
    let Some(k) = map.keyframe(keyframe) else { return };
    let candidates: Vec<KeyFrameId> = k.covisible.iter().map(|(id, _)| *id).collect();
    for candidate in candidates {
        if is_redundant(context, map, candidate) {
            map.remove_keyframe(candidate);
        }
    }
}

fn is_redundant(context: &Context, map: &Map, candidate: KeyFrameId) -> bool {
    let (sensor, config) = (&context.sensor, &context.config.mapping);
    let Some(k) = map.keyframe(candidate) else { return false };
    let (mut total, mut redundant) = (0usize, 0usize);
    for (i, id) in k.observed() {
        let Some(landmark) = map.landmark(id) else { continue };
        let f = &k.features.features[i];
        if sensor.measures_depth && f.depth_m.is_none_or(|z| f64::from(z) > sensor.close_limit_m) {
            continue;
        }
        total += 1;
        let views = landmark
            .observations
            .iter()
            .filter(|(other, _)| *other != candidate)
            .filter_map(|&(other, g)| map.keyframe(other).map(|o| o.features.features[g as usize].octave))
            .filter(|octave| *octave <= f.octave + 1)
            .take(config.redundant_views)
            .count();
        redundant += usize::from(views >= config.redundant_views);
    }
    total > 0 && redundant as f64 > config.redundant_share * total as f64
}
