//! Local mapping, one keyframe at a time (ORB-SLAM, IEEE T-RO 2015, section VI).
//!
//! In: a tracked frame that becomes a keyframe. Out: the map after keyframe insertion, landmark creation, local bundle adjustment and
//! culling.

mod cull;
mod depth;
pub(crate) mod fuse;
mod retime;
mod triangulate;
mod window;

use crate::context::{Context, SensorModel};
use crate::image::RgbImage;
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::tracking::{StartFrame, TrackedFrame, TwoViewMap};
pub(crate) use retime::{retime, retime_all};
pub(crate) use window::Window;

/// Local mapping.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mapper {
    /// Recent landmarks, which may still be culled.
    young: Vec<LandmarkId>,
}

impl Mapper {
    /// Inserts a frame as a keyframe and refines the map around it. Returns the new keyframe.
    pub(crate) fn insert(
        &mut self,
        context: &Context,
        map: &mut Map,
        frame: &TrackedFrame,
        color: &RgbImage,
    ) -> KeyFrameId {
        let Context { sensor, config } = context;
        let keyframe = self.add_keyframe(context, map, frame, color);
        self.young = cull::young_landmarks(&config.mapping, map, keyframe, std::mem::take(&mut self.young));
        self.young.extend(triangulate::new_landmarks(context, map, keyframe, color));
        fuse::duplicates(context, map, keyframe);
        map.update_covisibility(keyframe);
        if map.keyframe_count() > 2
            && let Some(mut window) = Window::copy(context, map, keyframe)
        {
            window.adjust(&config.bundle, &|| true);
            window.merge(sensor, map);
        }
        cull::redundant_keyframes(context, map, keyframe);
        keyframe
    }

    /// Begins a map or a submap with two frames of a camera without depth. Returns the second keyframe.
    pub(crate) fn begin(&mut self, sensor: &SensorModel, map: &mut Map, start: &TwoViewMap) -> KeyFrameId {
        let [first, second] = [&start.first, &start.second].map(|StartFrame { frame, .. }| {
            map.insert_keyframe(frame.timestamp_ns, frame.t_cam_world, frame.features.clone())
        });
        for &(i, j, point) in &start.points {
            let color = color_at(&start.second.color, start.second.frame.features.features[j].raw);
            if let Some(id) = map.insert_landmark(point, second, j, color, &sensor.scale_factors) {
                map.add_observation(id, first, i);
                map.update_landmark(id, &sensor.scale_factors);
                self.young.push(id);
            }
        }
        map.update_covisibility(second);
        second
    }

    /// Removes all landmarks from the list of recent ones.
    pub(crate) fn reset(&mut self) {
        self.young.clear();
    }

    /// Inserts the keyframe with its observations and the landmarks from its measured depths.
    fn add_keyframe(&mut self, context: &Context, map: &mut Map, frame: &TrackedFrame, color: &RgbImage) -> KeyFrameId {
        let sensor = &context.sensor;
        let keyframe = map.insert_keyframe(frame.timestamp_ns, frame.t_cam_world, frame.features.clone());
        for (feature, matched) in frame.matches.iter().enumerate() {
            if let Some(id) = matched.and_then(|m| m.landmark) {
                map.add_observation(id, keyframe, feature);
                map.update_landmark(id, &sensor.scale_factors);
            }
        }
        self.young.extend(depth::new_landmarks(context, map, keyframe, color));
        map.update_covisibility(keyframe);
        keyframe
    }
}

/// Returns the colour of the pixel at a distorted feature position; black outside the image.
fn color_at(color: &RgbImage, raw: [f32; 2]) -> [u8; 3] {
    color.get((raw[0] + 0.5) as usize, (raw[1] + 0.5) as usize).copied().unwrap_or_default()
}
