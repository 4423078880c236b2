//! Landmark creation from measured depth (ORB-SLAM2, IEEE T-RO 2017, section III-D).
//!
//! In: a new keyframe. Out: landmarks for its features with depth.

use crate::context::Context;
use crate::image::RgbImage;
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::mapping::color_at;

/// Creates landmarks for the static features of `keyframe` that have a depth and no landmark. Features are processed in the order of depth:
/// all within the close limit, and at least the first `min_depth_landmarks`.
pub(super) fn new_landmarks(
    context: &Context,
    map: &mut Map,
    keyframe: KeyFrameId,
    color: &RgbImage,
) -> Vec<LandmarkId> {
    let (sensor, config) = (&context.sensor, &context.config.mapping);
    let mut created = Vec::new();
    let Some(k) = map.keyframe(keyframe) else { return created };
    let t_world_cam = k.t_cam_world.inverse();
    let mut by_depth: Vec<(f32, usize)> = k
        .features
        .features
        .iter()
        .enumerate()
        .filter(|(_, f)| f.trust > 0.0)
        .filter_map(|(i, f)| Some((f.depth_m?, i)))
        .collect();
    by_depth.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    for (n, (z, i)) in by_depth.into_iter().enumerate() {
        if f64::from(z) > sensor.close_limit_m && n >= config.min_depth_landmarks {
            break;
        }
        let Some(k) = map.keyframe(keyframe) else { break };
        if k.landmarks[i].is_some() {
            continue;
        }
        let f = k.features.features[i];
        let point = t_world_cam * sensor.pinhole.unproject(f64::from(f.u), f64::from(f.v), f64::from(z));
        created.extend(map.insert_landmark(point, keyframe, i, color_at(color, f.raw), &sensor.scale_factors));
    }
    created
}
