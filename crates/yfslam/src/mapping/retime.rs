//! A keyframe whose velocity is known better once the next frame has come.
//!
//! In: the keyframe inserted last, and its velocity. Out: its features at the time of the middle row, its pose, and the landmarks that it
//! alone has seen.

use nalgebra::Point3;

use crate::context::Context;
use crate::features::rolling_shutter::{FrameTimes, Velocity};
use crate::map::{KeyFrameId, Map};
use crate::optimize::pose_only::{PoseObservation, optimize_pose};

/// Corrects all keyframes that still have their features as measured, once it is known how the rows of the images are read.
pub(crate) fn retime_all(context: &Context, map: &mut Map, times: &FrameTimes) {
    let known = map.keyframes().filter_map(|(id, k)| Some((k.sequence, id, *k.features.velocity()?)));
    let mut known: Vec<(u64, KeyFrameId, Velocity)> = known.collect();
    known.sort_unstable_by_key(|(sequence, ..)| *sequence);
    for (_, id, velocity) in known {
        map.set_row_times(id, times);
        retime(context, map, id, &velocity);
    }
}

/// Corrects a keyframe of a rolling-shutter camera for the velocity that it had.
pub(crate) fn retime(context: &Context, map: &mut Map, keyframe: KeyFrameId, velocity: &Velocity) {
    let Context { sensor, config } = context;
    let Some(k) = map.keyframe(keyframe) else { return };
    let depths: Vec<Option<f64>> = k
        .landmarks
        .iter()
        .map(|l| l.and_then(|id| map.landmark(id)).map(|l| (k.t_cam_world * l.position).z).filter(|z| *z > 0.0))
        .collect();
    let typical_depth_m = map.median_depth(k);
    map.retime_features(keyframe, velocity, &sensor.pinhole, |i| depths[i].unwrap_or(typical_depth_m));
    let Some(k) = map.keyframe(keyframe).filter(|k| !k.features.times().is_instant()) else { return };
    let mut observations = Vec::new();
    let mut own = Vec::new();
    for (i, id) in k.observed() {
        let (Some(landmark), feature) = (map.landmark(id), &k.features.features[i]) else { continue };
        if landmark.observations.len() == 1 {
            own.extend(
                feature.depth_m.map(|z| (id, sensor.pinhole.unproject(feature.u.into(), feature.v.into(), z.into()))),
            );
            continue;
        }
        observations.push(PoseObservation {
            point_world: landmark.position,
            measurement: sensor.measurement(feature),
            trust: f64::from(feature.trust * landmark.trust()),
            inlier: true,
        });
    }
    let mut pose = k.t_cam_world;
    // The root defines the world.
    if k.parent.is_some()
        && optimize_pose(&sensor.pinhole, &config.pose_optimizer, &mut pose, &mut observations)
            >= config.tracking.local_min_inliers
    {
        map.set_pose(keyframe, pose);
    } else {
        pose = k.t_cam_world;
    }
    let t_world_cam = pose.inverse();
    for (id, point_cam) in own {
        let point: Point3<f64> = t_world_cam * point_cam;
        map.set_position(id, point);
        map.update_landmark(id, &sensor.scale_factors);
    }
}
