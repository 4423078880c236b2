//! Fusion of duplicate landmarks: the landmarks of a keyframe are projected into its neighbours and merged with matching landmarks
//! (ORB-SLAM, IEEE T-RO 2015, section VI-C).
//!
//! In: a keyframe, or landmarks and a target keyframe. Out: further observations and merged landmarks in the map.

use fearless_simd::{Level, Simd, dispatch};

use crate::config::Config;
use crate::context::Context;
use crate::geometry::{CHI2_PIXEL, CHI2_PIXEL_DEPTH};
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::tracking::search::{BestTwo, MAX_DISTANCE_FACTOR, MIN_DISTANCE_FACTOR, Projector};

/// Fuses duplicates between `keyframe` and its first and second neighbours, in both directions.
pub(crate) fn duplicates(context: &Context, map: &mut Map, keyframe: KeyFrameId) {
    let Context { sensor, config } = context;
    let targets = neighbours(config, map, keyframe);
    for &target in &targets {
        let own = landmarks_of(map, keyframe);
        fuse_into(context, map, target, &own);
    }
    let mut of_targets: Vec<LandmarkId> = targets.iter().flat_map(|&t| landmarks_of(map, t)).collect();
    of_targets.sort_unstable();
    of_targets.dedup();
    fuse_into(context, map, keyframe, &of_targets);
    for id in landmarks_of(map, keyframe) {
        map.update_landmark(id, &sensor.scale_factors);
    }
}

fn landmarks_of(map: &Map, keyframe: KeyFrameId) -> Vec<LandmarkId> {
    map.keyframe(keyframe).map(|k| k.observed().map(|(_, id)| id).collect()).unwrap_or_default()
}

/// Returns the best covisible keyframes, and the best covisible keyframes of each of these.
fn neighbours(config: &Config, map: &Map, keyframe: KeyFrameId) -> Vec<KeyFrameId> {
    let best = |id: KeyFrameId, n: usize| {
        map.keyframe(id).into_iter().flat_map(move |k| k.covisible.iter().take(n).map(|(id, _)| *id))
    };
    let mut targets: Vec<KeyFrameId> = Vec::new();
    for first in best(keyframe, config.mapping.fuse_neighbours) {
        for id in std::iter::once(first).chain(best(first, config.mapping.fuse_second_neighbours)) {
            if id != keyframe && !targets.contains(&id) {
                targets.push(id);
            }
        }
    }
    targets
}

/// Projects landmarks into `target`: a matching feature without landmark gets an observation of it; a matching feature with another
/// landmark leads to the merging of both.
pub(crate) fn fuse_into(context: &Context, map: &mut Map, target: KeyFrameId, landmarks: &[LandmarkId]) {
    // The inner loop compares descriptors, for which baseline x86-64 has no population count instruction.
    dispatch!(Level::new(), simd => fuse_all(simd, context, map, target, landmarks));
}

#[inline(always)]
fn fuse_all<S: Simd>(_: S, context: &Context, map: &mut Map, target: KeyFrameId, landmarks: &[LandmarkId]) {
    let Context { sensor, config } = context;
    let Some(k) = map.keyframe(target) else { return };
    let t_cam_world = k.t_cam_world;
    let projector = Projector::new(sensor, &t_cam_world);
    for &id in landmarks {
        let (Some(k), Some(landmark)) = (map.keyframe(target), map.landmark(id)) else { continue };
        let Some(projection) = projector.project(&landmark.position) else { continue };
        let ray = landmark.position - projector.center_world;
        let distance = ray.norm();
        if distance < MIN_DISTANCE_FACTOR * landmark.min_distance_m
            || distance > MAX_DISTANCE_FACTOR * landmark.max_distance_m
            || ray.dot(&landmark.normal) < config.tracking.min_view_cosine * distance
            || landmark.feature_in(target).is_some()
        {
            continue;
        }
        let octave = sensor.predict_octave(landmark.max_distance_m, distance);
        let radius = config.mapping.fuse_radius_px * sensor.scale(octave);
        let p = (t_cam_world * landmark.position).coords;
        let mut best = BestTwo::new();
        k.features.for_each_near(projection.u, projection.v, radius, octave.saturating_sub(1)..=octave, |j| {
            let f = &k.features.features[j];
            let m = sensor.measurement(f);
            let limit = if m.weight_disparity > 0.0 { CHI2_PIXEL_DEPTH } else { CHI2_PIXEL };
            if f.trust > 0.0 && m.chi2(&m.residual(&sensor.pinhole, &p)) <= limit {
                best.add(j, landmark.descriptor.distance(&k.features.descriptors[j]), f.octave);
            }
        });
        if best.distance > config.tracking.hamming_low {
            continue;
        }
        match k.landmarks[best.index] {
            Some(other) => {
                let weight = |id| map.landmark(id).map_or(0, |l| map.observation_weight(l));
                if weight(other) > weight(id) { map.merge_landmarks(other, id) } else { map.merge_landmarks(id, other) }
            }
            None => map.add_observation(id, target, best.index),
        }
    }
}
