//! How the surroundings of a keyframe lie in an old place when neither has a scale: a similarity from landmarks that both have (ORB-SLAM,
//! IEEE T-RO 2015, section VII-B), by Horn's closed form in RANSAC, refined in the pictures of both.
//!
//! In: a keyframe located among the landmarks of an old place, by which features of it are matched twice: to a landmark of its own
//! surroundings and to one of the place. Out: where the place's world is in the keyframe's camera, in the unit of its surroundings.

use super::recognise::Candidate;
use super::verify::ransac;
use crate::config::Config;
use crate::geometry::{Similarity, absolute_orientation};
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::optimize::similarity::{Correspondence, optimize_similarity};
use crate::sensor::SensorModel;
use crate::tracking::TrackedFrame;

/// The similarity `s_cam_place` from the world of the old place into the camera of `keyframe`, located there as `located`. `None` if too
/// few landmarks agree on it.
pub fn measure(
    sensor: &SensorModel,
    config: &Config,
    map: &Map,
    keyframe: KeyFrameId,
    place: &Candidate,
    located: &TrackedFrame,
) -> Option<Similarity> {
    let (camera, needed) = (&sensor.pinhole, config.monocular.loop_min_pairs);
    let mut pairs = correspondences(sensor, map, keyframe, place, located);
    let mut s_place_cam = ransac(
        &config.places,
        pairs.len(),
        needed,
        |sample| absolute_orientation(&sample.map(|i| (pairs[i].in_a, pairs[i].in_b))),
        |s_place_cam, i| pairs[i].fits(camera, s_place_cam),
    );
    let s_place_cam = s_place_cam.as_mut()?;
    let inliers = optimize_similarity(camera, &config.pose, s_place_cam, &mut pairs);
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
        let far = located.sights.get(feature).copied().flatten()?.landmark.filter(|far| *far != near)?;
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
    k.sights().filter_map(pair).collect()
}
