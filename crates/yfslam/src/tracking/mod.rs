//! The pose of each frame, from its trusted features and the map (ORB-SLAM2, IEEE T-RO 2017, section III).
//!
//! In: a frame's features with trust. Out: its pose and matches, and whether it should become a keyframe.
//! The tracker only reads the map; what it saw of it is noted in [`ObservationCounts`].

pub(crate) mod keyframe_policy;
mod local_map;
pub(crate) mod search;
mod state;
mod tracked_frame;
mod two_view_initialiser;
mod visibility_check;

use crate::context::Context;
use crate::dynamic::{DynamicFilter, FirstPose};
use crate::features::matching::RotationHistogram;
use crate::geometry::Pose;
use crate::image::DepthImage;
use crate::map::{KeyFrameId, LandmarkId, Map};
use keyframe_policy::{FrameSummary, is_keyframe_wanted};
use local_map::LocalMap;
use search::{search_keyframe, search_last_frame, search_local_map};
pub use state::{LostReason, TrackingState};
pub(crate) use tracked_frame::{Match, TrackedFrame};
pub(crate) use two_view_initialiser::{StartFrame, TwoViewInitialiser, TwoViewMap};
use visibility_check::is_free_space;

/// Landmarks that frames should have seen, and those that they saw; one may stand there more than once.
#[derive(Clone, Debug, Default)]
pub(crate) struct ObservationCounts {
    /// In view.
    pub visible: Vec<LandmarkId>,
    /// FrameDetections, and fitting the pose.
    pub found: Vec<LandmarkId>,
    /// Not found, and what is behind them is seen.
    pub in_free_space: Vec<LandmarkId>,
}

impl ObservationCounts {
    /// Forgets all.
    pub(crate) fn clear(&mut self) {
        self.visible.clear();
        self.found.clear();
        self.in_free_space.clear();
    }
}

/// Follows the camera from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tracker {
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
    pub observation_counts: ObservationCounts,
    /// Landmarks that the current frame sees.
    pub inliers: usize,
}

impl Tracker {
    /// Makes room for the next frame: the current one becomes the last.
    pub(crate) fn begin_frame(&mut self, timestamp_ns: i64) {
        std::mem::swap(&mut self.current, &mut self.last);
        self.current.begin(timestamp_ns);
        self.frames_since_keyframe += 1;
    }

    /// The constant-velocity prediction of the pose of the current frame, `t_cam_world`.
    pub(crate) fn predict(&self, map: &Map) -> Pose {
        self.velocity.unwrap_or_else(Pose::identity) * self.last.pose_in(map)
    }

    /// Tracks a frame whose predecessor was tracked: a first pose, by which the filter compares the frame with the map, then the local
    /// map, of which at least `min_inliers` landmarks must fit.
    ///
    /// # Errors
    /// The reason, if the pose is not known.
    pub(crate) fn track(
        &mut self,
        context: &Context,
        map: &Map,
        filter: &mut dyn DynamicFilter,
        min_inliers: usize,
    ) -> Result<(), LostReason> {
        if !self.estimate(context, map) {
            return Err(LostReason::TooFewMatches);
        }
        let first = FirstPose { sensor: &context.sensor, map, t_cam_world: &self.current.t_cam_world };
        if filter.after_pose(&context.config.dynamic, &first, &mut self.current.features) {
            self.current.drop_distrusted();
            self.current.refine_pose(context);
        }
        self.track_local_map(context, map, min_inliers)
    }

    /// A first pose from the last frame, else from the reference keyframe. Returns whether one was found.
    fn estimate(&mut self, context: &Context, map: &Map) -> bool {
        let config = &context.config;
        let gap_s = (self.current.timestamp_ns - self.last.timestamp_ns) as f64 * 1e-9;
        if gap_s > config.tracking.max_gap_s {
            self.velocity = None;
        }
        (self.velocity.is_some() && self.track_motion(context, map)) || self.track_reference(context, map)
    }

    /// Constant-velocity model: the points of the last frame are sought around their projection.
    fn track_motion(&mut self, context: &Context, map: &Map) -> bool {
        let Context { sensor, config } = context;
        let c = &config.tracking;
        let prediction = self.predict(map);
        self.last.follow_map(map);
        self.last.add_odometry_points(sensor, c.odometry_points);
        for factor in [1.0, 2.0] {
            self.current.clear_matches();
            self.current.t_cam_world = prediction;
            let radius = factor * c.motion_radius_px;
            if search_last_frame(context, &self.last, &mut self.current, radius, &mut self.rotation)
                >= c.motion_min_matches
            {
                return self.current.refine_pose(context) >= c.motion_min_inliers;
            }
        }
        false
    }

    /// Descriptors alone: the landmarks of the reference keyframe are sought everywhere in the frame.
    fn track_reference(&mut self, context: &Context, map: &Map) -> bool {
        let c = &context.config.tracking;
        self.last.follow_map(map);
        let Some(keyframe) = self.reference.and_then(|id| map.keyframe(id)) else { return false };
        self.current.clear_matches();
        self.current.t_cam_world = self.last.t_cam_world;
        search_keyframe(c, keyframe, map, &mut self.current, &mut self.rotation) >= c.reference_min_matches
            && self.current.refine_pose(context) >= c.motion_min_inliers
    }

    /// Matches the local map and refines the pose with all of it.
    ///
    /// # Errors
    /// If fewer than `min_inliers` landmarks fit.
    pub(crate) fn track_local_map(
        &mut self,
        context: &Context,
        map: &Map,
        min_inliers: usize,
    ) -> Result<(), LostReason> {
        let c = &context.config.tracking;
        for matched in &mut self.current.matches {
            // Borrowed points have done their work: the refined pose rests on the map alone.
            if matched.is_some_and(|s| s.landmark.is_none()) {
                *matched = None;
            }
        }
        if let Some(reference) = self.local_map.update(c, map, &self.current) {
            self.reference = Some(reference);
        }
        search_local_map(context, map, &self.local_map.landmarks, &mut self.current, &mut self.visible);
        for matched in self.current.matches.iter().flatten() {
            self.visible.extend(matched.landmark);
        }
        self.visible.sort_unstable();
        self.visible.dedup();
        self.inliers = self.current.refine_pose(context);
        if self.inliers < min_inliers {
            // The pose is not known, hence neither is what should have been in view.
            return Err(LostReason::TooFewInliers { found: self.inliers, needed: min_inliers });
        }
        self.observation_counts.visible.extend_from_slice(&self.visible);
        self.observation_counts
            .found
            .extend(self.current.matches.iter().flatten().filter_map(|matched| matched.landmark));
        Ok(())
    }

    /// Notes landmarks that the frame, once tracked, sees through.
    pub(crate) fn check_visibility(&mut self, context: &Context, map: &Map, depth: &DepthImage) {
        let (sensor, config) = (&context.sensor, &context.config.dynamic.full);
        // As much as there can be: later frames shall not have to ask for memory.
        self.found.clear();
        self.found.reserve(self.visible.capacity());
        self.observation_counts.in_free_space.reserve(self.visible.capacity());
        self.found.extend(self.current.matches.iter().flatten().filter_map(|matched| matched.landmark));
        self.found.sort_unstable();
        for &id in self.visible.iter().filter(|id| self.found.binary_search(id).is_err()) {
            let pose = &self.current.t_cam_world;
            if map.landmark(id).is_some_and(|l| is_free_space(config, sensor, depth, pose, &l.position)) {
                self.observation_counts.in_free_space.push(id);
            }
        }
    }

    /// Ends a tracked frame: relative_poses it to its reference and learns the motion.
    pub(crate) fn accept(&mut self, map: &Map) {
        self.velocity = self.last.reference.map(|_| self.current.t_cam_world * self.last.t_cam_world.inverse());
        if let Some(reference) = self.reference {
            self.current.attach_to(reference, map);
        }
    }

    /// Forgets the motion: the last frame's pose is not one to measure it from.
    pub(crate) fn reset_velocity(&mut self) {
        self.velocity = None;
    }

    /// Ends a frame that could not be tracked: its pose stays that of the last one.
    pub(crate) fn reject(&mut self) {
        self.velocity = None;
        self.current.clear_matches();
        self.current.t_cam_world = self.last.t_cam_world;
        self.current.reference = self.last.reference;
        self.inliers = 0;
    }

    /// Whether the current frame should become a keyframe.
    pub(crate) fn wants_keyframe(&self, context: &Context, map: &Map) -> bool {
        let Some(reference) = self.reference else { return true };
        let frames_since = self.frames_since_keyframe;
        let summary = FrameSummary { inliers: self.inliers, frames_since, fps: context.sensor.camera.fps };
        is_keyframe_wanted(context, map, reference, &self.current, summary)
    }

    /// Notes that the current frame was handed over to become a keyframe.
    pub(crate) fn keyframe_requested(&mut self) {
        self.frames_since_keyframe = 0;
    }

    /// Notes that an earlier frame became a keyframe.
    pub(crate) fn adopt_reference(&mut self, keyframe: KeyFrameId) {
        self.reference = Some(keyframe);
    }

    /// Notes that the current frame became a keyframe, and takes the pose and matches that mapping gave it.
    pub(crate) fn keyframe_inserted(&mut self, keyframe: KeyFrameId, map: &Map) {
        self.reference = Some(keyframe);
        let Some(k) = map.keyframe(keyframe) else { return };
        self.current.t_cam_world = k.t_cam_world;
        self.current.reference = Some((keyframe, Pose::identity()));
        for (matched, landmark) in self.current.matches.iter_mut().zip(&k.landmarks) {
            *matched = landmark.and_then(|id| Some(Match::of(id, map.landmark(id)?)));
        }
    }

    /// The keyframe that the last tracked frame shares most with.
    pub(crate) fn reference(&self) -> Option<KeyFrameId> {
        self.reference
    }

    /// Forgets everything but its buffers, as after a start.
    pub(crate) fn reset(&mut self) {
        self.velocity = None;
        self.reference = None;
        self.frames_since_keyframe = 0;
        self.observation_counts.clear();
        self.inliers = 0;
        self.last.reference = None;
        self.current.reference = None;
        self.current.t_cam_world = Pose::identity();
        self.current.clear_matches();
    }
}
