//! Similarity between a keyframe's surroundings and a loop candidate when depth is not measured: from landmarks that both have
//! (ORB-SLAM, IEEE T-RO 2015, section VII-B), by Horn's closed form in RANSAC, refined by the reprojection errors in the images of
//! both.
//!
//! In: a keyframe localised among the landmarks of a candidate, so that some of its features are matched twice: with a landmark of
//! its own surroundings and with one of the candidate. Out: the similarity from the candidate's world into the keyframe's camera,
//! in the unit of the keyframe's surroundings.

use super::place_recognition::Candidate;
use super::verify::ransac;
use crate::context::{Context, SensorModel};
use crate::geometry::{Similarity, absolute_orientation};
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::optimize::similarity::{Correspondence, optimize_similarity};
use crate::tracking::TrackedFrame;

/// Returns the similarity `s_cam_candidate` from the world of the candidate into the camera of `keyframe`, localised there as
/// `localised`. `None` if too few landmarks agree on it.
pub(super) fn measure(
    context: &Context,
    map: &Map,
    keyframe: KeyFrameId,
    candidate: &Candidate,
    localised: &TrackedFrame,
) -> Option<Similarity> {
    let Context { sensor, config } = context;
    let (camera, needed) = (&sensor.pinhole, config.monocular.loop_min_pairs);
    let mut pairs = correspondences(sensor, map, keyframe, candidate, localised);
    let mut s_candidate_cam = ransac(
        &config.place_recognition,
        pairs.len(),
        needed,
        |sample| absolute_orientation(&sample.map(|i| (pairs[i].in_a, pairs[i].in_b))),
        |s_candidate_cam, i| pairs[i].fits(camera, s_candidate_cam),
    );
    let s_candidate_cam = s_candidate_cam.as_mut()?;
    let inliers = optimize_similarity(camera, &config.pose_optimizer, s_candidate_cam, &mut pairs);
    tracing::debug!(
        pairs = pairs.len(),
        inliers,
        scale = s_candidate_cam.scaling(),
        "similarity to the loop candidate"
    );
    // The camera frame is the same on both sides except for its unit and for the error of `localised`.
    (inliers >= needed).then(|| s_candidate_cam.inverse() * localised.t_cam_world)
}

/// Returns the pairs of a landmark of the keyframe and one of the candidate that the same feature of the keyframe shows.
fn correspondences(
    sensor: &SensorModel,
    map: &Map,
    keyframe: KeyFrameId,
    candidate: &Candidate,
    localised: &TrackedFrame,
) -> Vec<Correspondence> {
    let Some(k) = map.keyframe(keyframe) else { return Vec::new() };
    let t_candidate_cam = localised.t_cam_world.inverse();
    let pair = |(feature, near): (usize, LandmarkId)| {
        let far = localised.matches.get(feature).copied().flatten()?.landmark.filter(|far| *far != near)?;
        let (near, far) = (map.landmark(near)?, map.landmark(far)?);
        let views = candidate.group.iter().filter_map(|id| Some((map.keyframe(*id)?, far.feature_in(*id)?)));
        let (view, seen) = views.into_iter().next()?;
        Some(Correspondence {
            in_a: k.t_cam_world * near.position,
            seen_in_a: sensor.measurement(&k.features.features[feature]),
            in_b: localised.t_cam_world * far.position,
            t_view_b: view.t_cam_world * t_candidate_cam,
            seen_in_b: sensor.measurement(&view.features.features[seen]),
            inlier: false,
        })
    };
    k.observed().filter_map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Config, DepthSource};
    use crate::geometry::{Pose, rigid, se3_exp, sim3_from_tangent, sim3_tangent, unscaled};
    use crate::map::scene::{Scene, camera};
    use crate::tracking::Match;
    use nalgebra::Vector6;

    /// Returns a candidate, and a keyframe whose surroundings are the candidate's transformed by `s_near_candidate`, localised
    /// among the candidate's landmarks.
    fn scene_with_similarity(s_near_candidate: &Similarity) -> (Context, Map, KeyFrameId, Candidate, TrackedFrame) {
        let mut config = Config::default();
        // All depths of the scene are beyond this range, so that none is used.
        (config.depth.source, config.depth.max_m) = (DepthSource::Motion, 1.0);
        let context = Context::new(&camera(), &config, &[1.0]);
        let (scene, mut map) = (Scene::new(), Map::default());
        let (mut candidate, mut near) = (Vec::new(), Vec::new());
        for k in 0..4 {
            candidate.push(scene.add(&mut map, k, &scene.pose(k), &candidate));
        }
        for k in 2..5 {
            near.push(scene.add(&mut map, k, &scene.pose(k), &near));
        }
        for id in map.landmarks_of(&near) {
            let position = s_near_candidate * map.landmark(id).unwrap().position;
            map.set_position(id, position);
        }
        for &id in &near {
            let s_cam_near = unscaled(&map.keyframe(id).unwrap().t_cam_world) * s_near_candidate.inverse();
            map.set_pose(id, rigid(&s_cam_near));
        }
        let mut localised = TrackedFrame::default();
        localised.features.clone_from(&map.keyframe(near[1]).unwrap().features);
        localised.t_cam_world = scene.pose(3);
        localised.clear_matches();
        for (_, landmark) in candidate.iter().flat_map(|id| map.keyframe(*id).unwrap().observed()) {
            let l = map.landmark(landmark).unwrap();
            if let Some(i) = localised.features.descriptors.iter().position(|d| *d == l.descriptor) {
                localised.matches[i] = Some(Match::of(landmark, l));
            }
        }
        let candidate = Candidate { keyframe: candidate[3], group: candidate, matches: Vec::new() };
        (context, map, near[1], candidate, localised)
    }

    #[test]
    fn the_scale_is_estimated_although_the_localisation_has_a_small_error() {
        let s_near_candidate = sim3_from_tangent(&[0.5, -0.3, 1.0, 0.2, -0.5, 0.1, 0.8].into());
        let (context, map, keyframe, candidate, mut localised) = scene_with_similarity(&s_near_candidate);
        let truth = unscaled(&map.keyframe(keyframe).unwrap().t_cam_world) * s_near_candidate;
        localised.t_cam_world =
            se3_exp(&Vector6::new(0.004, -0.003, 0.005, 0.001, 0.001, -0.001)) * localised.t_cam_world;
        let found = measure(&context, &map, keyframe, &candidate, &localised).unwrap();
        assert!(sim3_tangent(&(found * truth.inverse())).norm() < 1e-3, "{found} {truth}");
    }

    #[test]
    fn landmarks_that_are_not_the_same_give_no_similarity() {
        let (context, mut map, keyframe, candidate, localised) = scene_with_similarity(&Similarity::identity());
        assert!(measure(&context, &map, keyframe, &candidate, &localised).is_some());
        let near: Vec<LandmarkId> = map.keyframe(keyframe).unwrap().observed().map(|(_, id)| id).collect();
        let positions: Vec<_> = near.iter().map(|id| map.landmark(*id).unwrap().position).collect();
        for (id, position) in near.iter().zip(positions.iter().cycle().skip(7)) {
            map.set_position(*id, *position);
        }
        assert!(measure(&context, &map, keyframe, &candidate, &localised).is_none());
        // Without features matched twice there are no pairs.
        let mut unmatched = localised;
        unmatched.clear_matches();
        unmatched.t_cam_world = Pose::identity();
        assert!(measure(&context, &map, keyframe, &candidate, &unmatched).is_none());
    }
}
