//! Growth and refinement of the map, one keyframe at a time (ORB-SLAM, IEEE T-RO 2015, section VI).
//!
//! In: a tracked frame that was found worth keeping. Out: a keyframe in the map with new landmarks, a local bundle adjustment, and
//! what became superfluous taken away.

mod cull;
mod depth;
pub(crate) mod fuse;
mod triangulate;
mod window;

use crate::context::{Context, SensorModel};
use crate::image::RgbImage;
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::tracking::{StartFrame, TrackedFrame, TwoViewMap};
pub(crate) use window::Window;

/// Grows and refines the map.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mapper {
    /// Landmarks still on probation.
    young: Vec<LandmarkId>,
}

impl Mapper {
    /// Takes a frame into the map and refines the surroundings. Returns the new keyframe.
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
            window.adjust(&config.bundle);
            window.merge(sensor, map);
        }
        cull::redundant_keyframes(context, map, keyframe);
        keyframe
    }

    /// Begins a map, or a submap, with the two frames of a camera without depth. Returns the second keyframe.
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

    /// Starts over with an empty list of young landmarks.
    pub(crate) fn reset(&mut self) {
        self.young.clear();
    }

    /// The keyframe itself, its observations and its landmarks from depth.
    fn add_keyframe(&mut self, context: &Context, map: &mut Map, frame: &TrackedFrame, color: &RgbImage) -> KeyFrameId {
        let Context { sensor, config: _ } = context;
        let keyframe = map.insert_keyframe(frame.timestamp_ns, frame.t_cam_world, frame.features.clone());
        for (feature, matched) in frame.matches.iter().enumerate() {
            if let Some(id) = matched.and_then(|s| s.landmark) {
                map.add_observation(id, keyframe, feature);
                map.update_landmark(id, &sensor.scale_factors);
            }
        }
        self.young.extend(depth::new_landmarks(context, map, keyframe, color));
        map.update_covisibility(keyframe);
        keyframe
    }
}

/// Colour of the pixel at a raw feature position.
fn color_at(color: &RgbImage, raw: [f32; 2]) -> [u8; 3] {
    color.get((raw[0] + 0.5) as usize, (raw[1] + 0.5) as usize).copied().unwrap_or_default()
}
