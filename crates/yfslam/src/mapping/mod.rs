//! Growth and refinement of the map, one keyframe at a time (ORB-SLAM, IEEE T-RO 2015, section VI).
//!
//! In: a tracked frame that was found worth keeping. Out: a keyframe in the map with new landmarks, a local bundle adjustment, and
//! what became superfluous taken away.

mod cull;
mod depth;
pub(crate) mod fuse;
mod triangulate;
mod window;

use crate::config::Config;
use crate::image::RgbImage;
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::sensor::SensorModel;
use crate::tracking::{StartFrame, TrackedFrame, TwoViewStart};
pub use window::Window;

/// Grows and refines the map.
#[derive(Clone, Debug, Default)]
pub struct Mapper {
    /// Landmarks still on probation.
    young: Vec<LandmarkId>,
}

impl Mapper {
    /// Takes a frame into the map and refines the surroundings. Returns the new keyframe.
    pub fn insert(
        &mut self,
        sensor: &SensorModel,
        config: &Config,
        map: &mut Map,
        frame: &TrackedFrame,
        color: &RgbImage,
    ) -> KeyFrameId {
        let keyframe = self.add_keyframe(sensor, config, map, frame, color);
        self.young = cull::young_landmarks(&config.mapping, map, keyframe, std::mem::take(&mut self.young));
        self.young.extend(triangulate::new_landmarks(sensor, config, map, keyframe, color));
        fuse::duplicates(sensor, config, map, keyframe);
        map.update_covisibility(keyframe);
        if map.keyframe_count() > 2
            && let Some(mut window) = Window::copy(sensor, &config.mapping, map, keyframe)
        {
            window.adjust(&config.bundle);
            window.merge(sensor, map);
        }
        cull::redundant_keyframes(sensor, &config.mapping, map, keyframe);
        keyframe
    }

    /// Begins a map, or a submap, with the two frames of a camera without depth. Returns the second keyframe.
    pub fn begin(&mut self, sensor: &SensorModel, map: &mut Map, start: &TwoViewStart) -> KeyFrameId {
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
    pub fn reset(&mut self) {
        self.young.clear();
    }

    /// The keyframe itself, its observations and its landmarks from depth.
    fn add_keyframe(
        &mut self,
        sensor: &SensorModel,
        config: &Config,
        map: &mut Map,
        frame: &TrackedFrame,
        color: &RgbImage,
    ) -> KeyFrameId {
        let keyframe = map.insert_keyframe(frame.timestamp_ns, frame.t_cam_world, frame.features.clone());
        for (feature, sight) in frame.sights.iter().enumerate() {
            if let Some(id) = sight.and_then(|s| s.landmark) {
                map.add_observation(id, keyframe, feature);
                map.update_landmark(id, &sensor.scale_factors);
            }
        }
        self.young.extend(depth::new_landmarks(sensor, &config.mapping, map, keyframe, color));
        map.update_covisibility(keyframe);
        keyframe
    }
}

/// Colour of the pixel at a raw feature position.
fn color_at(color: &RgbImage, raw: [f32; 2]) -> [u8; 3] {
    color.get((raw[0] + 0.5) as usize, (raw[1] + 0.5) as usize).copied().unwrap_or_default()
}
