//! The pose of each frame, from its trusted features and the map (ORB-SLAM2, IEEE T-RO 2017, section III).
//!
//! In: a frame's features with trust. Out: its pose and matches, and whether it should become a keyframe.
//! The tracker only reads the map; what it saw of it is noted in [`Sightings`].

mod frame;
mod initialise;
pub mod keyframe_policy;
mod local_map;
pub mod search;
mod seen_through;

use crate::config::{Config, FullConfig};
use crate::features::matching::RotationHistogram;
use crate::geometry::Pose;
use crate::image::DepthImage;
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::sensor::SensorModel;
pub use frame::{Sight, TrackedFrame};
pub use initialise::{Initialiser, StartFrame, TwoViewStart};
use keyframe_policy::{FrameSummary, is_keyframe_wanted};
use local_map::LocalMap;
use search::{search_keyframe, search_last_frame, search_local_map};
use seen_through::is_seen_through;

/// What the system knows of its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrackingState {
    /// No map yet.
    #[default]
    NotInitialized,
    /// The pose is known.
    Tracking,
    /// The pose is unknown; the map waits.
    Lost,
}

/// Landmarks that frames should have seen, and those that they saw; one may stand there more than once.
#[derive(Clone, Debug, Default)]
pub struct Sightings {
    /// In view.
    pub visible: Vec<LandmarkId>,
    /// Found, and fitting the pose.
    pub found: Vec<LandmarkId>,
    /// Not found, and what is behind them is seen.
    pub seen_through: Vec<LandmarkId>,
}

impl Sightings {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.visible.clear();
        self.found.clear();
        self.seen_through.clear();
    }
}

/// Follows the camera from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Tracker {
    /// The frame being tracked.
    pub current: TrackedFrame,
    last: TrackedFrame,
    /// Motion from the last frame to this one, `t_current_last`; `None` after a start or a loss.
    velocity: Option<Pose>,
    local_map: LocalMap,
    /// Landmarks in view of the current frame, and those found in it, in order.
    visible: Vec<LandmarkId>,
    found: Vec<LandmarkId>,
    rotation: RotationHistogram,
    reference: Option<KeyFrameId>,
    frames_since_keyframe: u64,
    /// What was seen since the map's owner took note.
    pub sightings: Sightings,
    /// Landmarks that the current frame sees.
    pub inliers: usize,
}

impl Tracker {
    /// Makes room for the next frame: the current one becomes the last.
    pub fn begin_frame(&mut self, timestamp_ns: i64) {
        std::mem::swap(&mut self.current, &mut self.last);
        self.current.timestamp_ns = timestamp_ns;
        self.frames_since_keyframe += 1;
    }

    /// The constant-velocity prediction of the pose of the current frame, `t_cam_world`.
    pub fn predict(&self, map: &Map) -> Pose {
        self.velocity.unwrap_or_else(Pose::identity) * self.last.pose_in(map)
    }

    /// A first pose from the last frame, else from the reference keyframe. Returns whether one was found.
    pub fn estimate(&mut self, sensor: &SensorModel, config: &Config, map: &Map) -> bool {
        let gap_s = (self.current.timestamp_ns - self.last.timestamp_ns) as f64 * 1e-9;
        if gap_s > config.tracking.max_gap_s {
            self.velocity = None;
        }
        (self.velocity.is_some() && self.track_motion(sensor, config, map)) || self.track_reference(sensor, config, map)
    }

    /// Constant-velocity model: the points of the last frame are sought around their projection.
    fn track_motion(&mut self, sensor: &SensorModel, config: &Config, map: &Map) -> bool {
        let c = &config.tracking;
        let prediction = self.predict(map);
        self.last.follow_map(map);
        self.last.borrow_depth_points(sensor, c.borrowed_points);
        for factor in [1.0, 2.0] {
            self.current.clear_sights();
            self.current.t_cam_world = prediction;
            let radius = factor * c.motion_radius_px;
            if search_last_frame(sensor, c, &self.last, &mut self.current, radius, &mut self.rotation)
                >= c.motion_min_matches
            {
                return self.current.refine_pose(sensor, &config.pose) >= c.motion_min_inliers;
            }
        }
        false
    }

    /// Descriptors alone: the landmarks of the reference keyframe are sought everywhere in the frame.
    fn track_reference(&mut self, sensor: &SensorModel, config: &Config, map: &Map) -> bool {
        let c = &config.tracking;
        self.last.follow_map(map);
        let Some(keyframe) = self.reference.and_then(|id| map.keyframe(id)) else { return false };
        self.current.clear_sights();
        self.current.t_cam_world = self.last.t_cam_world;
        search_keyframe(c, keyframe, map, &mut self.current, &mut self.rotation) >= c.reference_min_matches
            && self.current.refine_pose(sensor, &config.pose) >= c.motion_min_inliers
    }

    /// Matches the local map and refines the pose with all of it. Returns whether the frame is tracked: at least `min_inliers`
    /// landmarks fit.
    pub fn track_local_map(&mut self, sensor: &SensorModel, config: &Config, map: &Map, min_inliers: usize) -> bool {
        let c = &config.tracking;
        for sight in &mut self.current.sights {
            // Borrowed points have done their work: the refined pose rests on the map alone.
            if sight.is_some_and(|s| s.landmark.is_none()) {
                *sight = None;
            }
        }
        if let Some(reference) = self.local_map.update(c, map, &self.current) {
            self.reference = Some(reference);
        }
        search_local_map(sensor, c, map, &self.local_map.landmarks, &mut self.current, &mut self.visible);
        for sight in self.current.sights.iter().flatten() {
            self.visible.extend(sight.landmark);
        }
        self.visible.sort_unstable();
        self.visible.dedup();
        self.inliers = self.current.refine_pose(sensor, &config.pose);
        if self.inliers < min_inliers {
            return false; // The pose is not known, nor what should have been seen from there.
        }
        self.sightings.visible.extend_from_slice(&self.visible);
        self.sightings.found.extend(self.current.sights.iter().flatten().filter_map(|sight| sight.landmark));
        true
    }

    /// Notes landmarks that the frame, once tracked, sees through.
    pub fn look_through(&mut self, sensor: &SensorModel, config: &FullConfig, map: &Map, depth: &DepthImage) {
        // As much as there can be: later frames shall not have to ask for memory.
        self.found.clear();
        self.found.reserve(self.visible.capacity());
        self.sightings.seen_through.reserve(self.visible.capacity());
        self.found.extend(self.current.sights.iter().flatten().filter_map(|sight| sight.landmark));
        self.found.sort_unstable();
        for &id in self.visible.iter().filter(|id| self.found.binary_search(id).is_err()) {
            let pose = &self.current.t_cam_world;
            if map.landmark(id).is_some_and(|l| is_seen_through(config, sensor, depth, pose, &l.position)) {
                self.sightings.seen_through.push(id);
            }
        }
    }

    /// Ends a tracked frame: ties it to its reference and learns the motion.
    pub fn accept(&mut self, map: &Map) {
        self.velocity = self.last.reference.map(|_| self.current.t_cam_world * self.last.t_cam_world.inverse());
        if let Some(reference) = self.reference {
            self.current.tie_to(reference, map);
        }
    }

    /// Forgets the motion: the last frame's pose is not one to measure it from.
    pub fn forget_motion(&mut self) {
        self.velocity = None;
    }

    /// Ends a frame that could not be tracked: its pose stays that of the last one.
    pub fn reject(&mut self) {
        self.velocity = None;
        self.current.clear_sights();
        self.current.t_cam_world = self.last.t_cam_world;
        self.current.reference = self.last.reference;
        self.inliers = 0;
    }

    /// Whether the current frame should become a keyframe.
    pub fn wants_keyframe(&self, sensor: &SensorModel, config: &Config, map: &Map) -> bool {
        let Some(reference) = self.reference else { return true };
        let summary =
            FrameSummary { inliers: self.inliers, frames_since: self.frames_since_keyframe, fps: sensor.camera.fps };
        is_keyframe_wanted(&config.keyframes, &config.tracking, sensor, map, reference, &self.current, summary)
    }

    /// Notes that the current frame was handed over to become a keyframe.
    pub fn offered_keyframe(&mut self) {
        self.frames_since_keyframe = 0;
    }

    /// Notes that an earlier frame became a keyframe.
    pub fn gained_keyframe(&mut self, keyframe: KeyFrameId) {
        self.reference = Some(keyframe);
    }

    /// Notes that the current frame became a keyframe, and takes the pose and matches that mapping gave it.
    pub fn became_keyframe(&mut self, keyframe: KeyFrameId, map: &Map) {
        self.reference = Some(keyframe);
        let Some(k) = map.keyframe(keyframe) else { return };
        self.current.t_cam_world = k.t_cam_world;
        self.current.reference = Some((keyframe, Pose::identity()));
        for (sight, landmark) in self.current.sights.iter_mut().zip(&k.landmarks) {
            *sight = landmark.and_then(|id| Some(Sight::of(id, map.landmark(id)?)));
        }
    }

    /// The keyframe that the last tracked frame shares most with.
    pub fn reference(&self) -> Option<KeyFrameId> {
        self.reference
    }

    /// Forgets everything but its buffers, as after a start.
    pub fn reset(&mut self) {
        self.velocity = None;
        self.reference = None;
        self.frames_since_keyframe = 0;
        self.sightings.clear();
        self.inliers = 0;
        self.last.reference = None;
        self.current.reference = None;
        self.current.t_cam_world = Pose::identity();
        self.current.clear_sights();
    }
}
