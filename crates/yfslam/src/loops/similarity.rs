//! How the surroundings of a keyframe lie in an old place when neither has a scale: a similarity from landmarks that both have (ORB-SLAM,
//! IEEE T-RO 2015, section VII-B), by Horn's closed form in RANSAC, refined in the pictures of both.
//!
//! In: a keyframe located among the landmarks of an old place, by which features of it are matched twice: to a landmark of its own
//! surroundings and to one of the place. Out: where the place's world is in the keyframe's camera, in the unit of its surroundings.

use super::place_recognition::Candidate;
use super::verify::ransac;
use crate::context::{Context, SensorModel};
use crate::geometry::{Similarity, absolute_orientation};
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::optimize::similarity::{Correspondence, optimize_similarity};
use crate::tracking::TrackedFrame;

/// The similarity `s_cam_place` from the world of the old place into the camera of `keyframe`, located there as `located`. `None` if too
/// few landmarks agree on it.
pub(super) fn measure(
    context: &Context,
    map: &Map,
    keyframe: KeyFrameId,
    place: &Candidate,
    located: &TrackedFrame,
) -> Option<Similarity> {
    let Context { sensor, config } = context;
    let (camera, needed) = (&sensor.pinhole, config.monocular.loop_min_pairs);
    let mut pairs = correspondences(sensor, map, keyframe, place, located);
    let mut s_place_cam = ransac(
        &config.place_recognition,
        pairs.len(),
        needed,
        |sample| absolute_orientation(&sample.map(|i| (pairs[i].in_a, pairs[i].in_b))),
        |s_place_cam, i| pairs[i].fits(camera, s_place_cam),
    );
    let s_place_cam = s_place_cam.as_mut()?;
    let inliers = optimize_similarity(camera, &config.pose_optimizer, s_place_cam, &mut pairs);
    tracing::debug!(pairs = pairs.len(), inliers, scale = s_place_cam.scaling(), "surroundings and old place");
    // The camera's frame is the same on both sides but for its unit, and for what locating it left over.
    (inliers >= needed).then(|| s_place_cam.inverse() * located.t_cam_world)
}

/// Landmarks of the keyframe and of the place that one feature of the keyframe shows.
fn correspondences(
    sensor: &SensorModel,
    map: &Map,
    keyframe: KeyFrameId,
    place: &Candidate,
    located: &TrackedFrame,
) -> Vec<Correspondence> {
    let Some(k) = map.keyframe(keyframe) else { return Vec::new() };
    let t_place_cam = located.t_cam_world.inverse();
    let pair = |(feature, near): (usize, LandmarkId)| {
        let far = located.matches.get(feature).copied().flatten()?.landmark.filter(|far| *far != near)?;
        let (near, far) = (map.landmark(near)?, map.landmark(far)?);
        let views = place.group.iter().filter_map(|id| Some((map.keyframe(*id)?, far.feature_in(*id)?)));
        let (view, seen) = views.into_iter().next()?;
        Some(Correspondence {
            in_a: k.t_cam_world * near.position,
            seen_in_a: sensor.measurement(&k.features.features[feature]),
            in_b: located.t_cam_world * far.position,
            t_view_b: view.t_cam_world * t_place_cam,
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

    /// An old place, and a keyframe whose surroundings are the place's by `s_near_place`, located in the place by what both see.
    fn apart(s_near_place: &Similarity) -> (Context, Map, KeyFrameId, Candidate, TrackedFrame) {
        let mut config = Config::default();
        // The scene has depths; all are beyond this range.
        (config.depth.source, config.depth.max_m) = (DepthSource::Motion, 1.0);
        let context = Context::new(&camera(), &config, &[1.0]);
        let (scene, mut map) = (Scene::new(), Map::default());
        let (mut place, mut near) = (Vec::new(), Vec::new());
        for k in 0..4 {
            place.push(scene.add(&mut map, k, &scene.pose(k), &place));
        }
        for k in 2..5 {
            near.push(scene.add(&mut map, k, &scene.pose(k), &near));
        }
        for id in map.landmarks_of(&near) {
            let position = s_near_place * map.landmark(id).unwrap().position;
            map.set_position(id, position);
        }
        for &id in &near {
            let s_cam_near = unscaled(&map.keyframe(id).unwrap().t_cam_world) * s_near_place.inverse();
            map.set_pose(id, rigid(&s_cam_near));
        }
        let mut located = TrackedFrame::default();
        located.features.clone_from(&map.keyframe(near[1]).unwrap().features);
        located.t_cam_world = scene.pose(3);
        located.clear_matches();
        for (_, landmark) in place.iter().flat_map(|id| map.keyframe(*id).unwrap().observed()) {
            let l = map.landmark(landmark).unwrap();
            if let Some(i) = located.features.descriptors.iter().position(|d| *d == l.descriptor) {
                located.matches[i] = Some(Match::of(landmark, l));
            }
        }
        let place = Candidate { keyframe: place[3], group: place, matches: Vec::new() };
        (context, map, near[1], place, located)
    }

    #[test]
    fn the_scale_between_two_maps_is_found_though_locating_was_a_little_off() {
        let s_near_place = sim3_from_tangent(&[0.5, -0.3, 1.0, 0.2, -0.5, 0.1, 0.8].into());
        let (context, map, keyframe, place, mut located) = apart(&s_near_place);
        let truth = unscaled(&map.keyframe(keyframe).unwrap().t_cam_world) * s_near_place;
        located.t_cam_world = se3_exp(&Vector6::new(0.004, -0.003, 0.005, 0.001, 0.001, -0.001)) * located.t_cam_world;
        let found = measure(&context, &map, keyframe, &place, &located).unwrap();
        assert!(sim3_tangent(&(found * truth.inverse())).norm() < 1e-3, "{found} {truth}");
    }

    #[test]
    fn landmarks_that_are_not_the_same_give_no_scale() {
        let (context, mut map, keyframe, place, located) = apart(&Similarity::identity());
        assert!(measure(&context, &map, keyframe, &place, &located).is_some());
        let near: Vec<LandmarkId> = map.keyframe(keyframe).unwrap().observed().map(|(_, id)| id).collect();
        let positions: Vec<_> = near.iter().map(|id| map.landmark(*id).unwrap().position).collect();
        for (id, position) in near.iter().zip(positions.iter().cycle().skip(7)) {
            map.set_position(*id, *position);
        }
        assert!(measure(&context, &map, keyframe, &place, &located).is_none());
        // And where nothing is matched twice there is nothing to go by.
        let mut unmatched = located;
        unmatched.clear_matches();
        unmatched.t_cam_world = Pose::identity();
        assert!(measure(&context, &map, keyframe, &place, &unmatched).is_none());
    }
}
