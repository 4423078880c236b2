//! Tracking: the pose of each frame, from its static features and the map (ORB-SLAM2, IEEE T-RO 2017, section III).
//!
//! In: the features of a frame with their trust. Out: its pose and matches, and whether it becomes a keyframe.
//! The tracker only reads the map. The landmarks that it expected and matched are collected in [`ObservationCounts`].

pub(crate) mod keyframe_policy;
mod local_map;
mod motion;
mod readout_estimator;
pub(crate) mod search;
mod state;
mod tracked_frame;
mod two_view_initialiser;
mod visibility_check;

use crate::context::Context;
use crate::dynamic::{DynamicFilter, FirstPose};
use crate::features::matching::RotationHistogram;
use crate::features::rolling_shutter::{FrameTimes, Velocity};
use crate::geometry::Pose;
use crate::image::DepthImage;
use crate::map::{KeyFrameId, KeyframeRelativePose, LandmarkId, Map};
use keyframe_policy::{FrameSummary, is_keyframe_wanted};
use local_map::LocalMap;
use motion::{Interval, weighted};
use nalgebra::{Matrix6, Vector6};
pub(crate) use readout_estimator::ReadoutEstimator;
use search::{search_keyframe, search_last_frame, search_local_map};
pub use state::{LostReason, TrackingStart, TrackingState};
pub(crate) use tracked_frame::{Match, TrackedFrame};
pub(crate) use two_view_initialiser::{StartFrame, TwoViewInitialiser, TwoViewMap};
use visibility_check::is_free_space;

/// Least time between two frames from which a velocity is measured, as a share of the readout time.
const MIN_READOUT_SHARE: f64 = 0.6;

/// Landmarks that were expected in view, matched, or contradicted by the depth image in recent frames; an id may occur several times.
#[derive(Clone, Debug, Default)]
pub(crate) struct ObservationCounts {
    /// Landmarks expected in view.
    pub visible: Vec<LandmarkId>,
    /// Landmarks that were matched as inliers.
    pub found: Vec<LandmarkId>,
    /// Landmarks that were not matched, and at whose position the depth image shows free space.
    pub in_free_space: Vec<LandmarkId>,
}

impl ObservationCounts {
    /// Removes all.
    pub(crate) fn clear(&mut self) {
        self.visible.clear();
        self.found.clear();
        self.in_free_space.clear();
    }
}

/// Tracker of the camera pose from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tracker {
    /// The frame being tracked.
    pub current: TrackedFrame,
    last: TrackedFrame,
    /// Motion from the last frame to the current one, `t_current_last`; `None` after initialisation or when tracking was lost.
    velocity: Option<Pose>,
    /// Whether the pose of the last frame is known.
    last_is_tracked: bool,
    /// Motion between the last two frames, if both poses are known.
    interval: Option<Interval>,
    /// Covariance of the pose of the last frame.
    last_covariance: Option<Matrix6<f64>>,
    /// Velocity of the last frame, with which it was corrected after the current one was tracked.
    pub last_velocity: Option<Velocity>,
    local_map: LocalMap,
    /// Landmarks expected in view of the current frame, sorted.
    visible: Vec<LandmarkId>,
    /// Landmarks matched in the current frame, sorted.
    found: Vec<LandmarkId>,
    rotation: RotationHistogram,
    reference: Option<KeyFrameId>,
    frames_since_keyframe: u64,
    /// Landmarks of the frames since the owner of the map last counted them.
    pub observation_counts: ObservationCounts,
    /// Number of landmarks matched as inliers in the current frame.
    pub inliers: usize,
}

impl Tracker {
    /// Begins the next frame: the current one becomes the last.
    pub(crate) fn begin_frame(&mut self, timestamp_ns: i64) {
        std::mem::swap(&mut self.current, &mut self.last);
        self.current.begin(timestamp_ns);
        self.last_velocity = None;
        self.frames_since_keyframe += 1;
    }

    /// Predicts the pose of the current frame, `t_cam_world`, by the constant-velocity model.
    pub(crate) fn predict(&self, map: &Map) -> Pose {
        self.velocity.unwrap_or_else(Pose::identity) * self.last.pose_in(map)
    }

    /// Tracks a frame whose predecessor was tracked: estimates a first pose, with which the dynamic filter compares the frame with the map,
    /// then tracks the local map, of which at least `min_inliers` landmarks must be inliers.
    ///
    /// # Errors
    /// The reason why the pose is unknown.
    pub(crate) fn track(
        &mut self,
        context: &Context,
        map: &Map,
        filter: &mut dyn DynamicFilter,
        depth: &DepthImage,
        min_inliers: usize,
    ) -> Result<(), LostReason> {
        if self.correct_shutter(context, self.last_known_velocity(), None) {
            self.current.features.build_grid();
        }
        if !self.estimate_first_pose(context, map) {
            return Err(LostReason::TooFewMatches);
        }
        if self.correct_shutter(context, self.current_velocity(context), Some(depth)) {
            self.current.features.build_grid();
        }
        self.filter_again(context, map, filter);
        if let Some(pose) = filter.corrected_pose() {
            self.track_from(context, map, pose)?;
            self.filter_again(context, map, filter);
        }
        self.track_local_map(context, map, min_inliers)?;
        if self.correct_shutter(context, self.current_velocity(context), None) {
            self.inliers = self.current.polish_pose(context);
            if self.inliers < min_inliers {
                return Err(LostReason::TooFewInliers { found: self.inliers, needed: min_inliers });
            }
        }
        self.correct_last(context, map);
        Ok(())
    }

    /// Lets the dynamic filter compare the frame with the map, and refines the first pose if something that moves was found.
    fn filter_again(&mut self, context: &Context, map: &Map, filter: &mut dyn DynamicFilter) {
        let TrackedFrame { timestamp_ns, t_cam_world, features, .. } = &mut self.current;
        let first = FirstPose { timestamp_ns: *timestamp_ns, sensor: &context.sensor, map, t_cam_world };
        if filter.after_pose(&context.config.dynamic, &first, features) {
            self.current.drop_distrusted();
            self.current.refine_pose(context);
        }
    }

    /// Estimates the first pose anew, near `pose` and from the local map of the last frame: the pose of that frame may have followed an object.
    ///
    /// # Errors
    /// If too few landmarks are inliers.
    fn track_from(&mut self, context: &Context, map: &Map, pose: Pose) -> Result<(), LostReason> {
        self.current.clear_matches();
        self.current.t_cam_world = pose;
        search_local_map(context, map, &self.local_map.landmarks, &mut self.current, &mut self.visible);
        let (found, needed) = (self.current.refine_pose(context), context.config.tracking.motion_min_inliers);
        if found < needed { Err(LostReason::TooFewInliers { found, needed }) } else { Ok(()) }
    }

    /// Time from the last frame to the current one, s.
    fn seconds_since_last(&self) -> f64 {
        // A clock may jump from one end of time to the other.
        self.current.timestamp_ns.saturating_sub(self.last.timestamp_ns) as f64 * 1e-9
    }

    /// Motion from the last frame to the current one, if both poses are known.
    fn current_interval(&self, context: &Context) -> Option<Interval> {
        let max_gap_s = context.config.tracking.max_gap_s;
        let seconds = self.seconds_since_last();
        let ((last, last_s), (current, current_s)) = (self.last.observed_pose(), self.current.observed_pose());
        // No sensor reads two images at once. Over so short a time the errors of the poses would make a velocity that the correction
        // of the next poses makes still worse.
        let is_long_enough = seconds >= MIN_READOUT_SHARE * self.current.features.times().longest_readout_s();
        Interval::between((&last, last_s - seconds), (&current, current_s), max_gap_s)
            .filter(|_| self.last_is_tracked && is_long_enough)
    }

    /// Velocity of the current frame, from its pose and the last two.
    fn current_velocity(&self, context: &Context) -> Option<Velocity> {
        let seconds = self.seconds_since_last();
        let before = self.interval.map(|before| before.earlier_by(seconds));
        let measured = self.current_interval(context)?.velocity_at(0.0, before.as_ref());
        let Some(expected) = self.last_known_velocity() else { return Some(measured) };
        // The velocity at the end of two intervals is (3 x₂ − 4 x₁ + x₀) / 2Δt, of which the last position hardly counts.
        let [of_current, of_last] = self.covariances(context)?;
        let covariance = (of_current * 2.25 + of_last * 4.0) / (seconds * seconds);
        Some(weighted(&expected, &measured, &covariance, seconds))
    }

    /// Velocity of the last frame, if its pose is known.
    fn last_known_velocity(&self) -> Option<Velocity> {
        self.last.features.velocity().copied().filter(|_| self.interval.is_some())
    }

    /// Covariances of the poses of the current frame and the last one, if they are determined.
    fn covariances(&self, context: &Context) -> Option<[Matrix6<f64>; 2]> {
        Some([self.current.covariance(&context.sensor)?, self.last_covariance?])
    }

    /// Brings the features of the current frame to the time of the middle row. Returns whether that has moved them.
    fn correct_shutter(&mut self, context: &Context, velocity: Option<Velocity>, depth: Option<&DepthImage>) -> bool {
        let Some(velocity) = velocity.filter(|_| self.current.features.keeps_measured()) else { return false };
        self.current.correct_shutter(&context.sensor, &velocity, depth);
        !self.current.features.times().is_instant()
    }

    /// Corrects the last frame for its velocity, which is known better now, and refines its pose.
    fn correct_last(&mut self, context: &Context, map: &Map) {
        let Some(next) = self.current_interval(context).filter(|_| self.last.features.keeps_measured()) else { return };
        let seconds = self.seconds_since_last();
        let before = self.interval.map(|before| before.earlier_by(seconds));
        let mut velocity = next.velocity_at(-seconds, before.as_ref());
        if let (Some(expected), Some([of_current, of_last])) = (self.last_known_velocity(), self.covariances(context)) {
            // It is the difference of the positions of two frames that are twice as far apart.
            let covariance = (of_current + of_last) / (4.0 * seconds * seconds);
            velocity = weighted(&expected, &velocity, &covariance, seconds);
        }
        self.last.drop_odometry_points();
        self.last.correct_shutter(&context.sensor, &velocity, None);
        self.last_velocity = Some(velocity);
        let is_corrected = !self.last.features.times().is_instant();
        if is_corrected && !self.last_was_keyframe() && self.last.match_count() > 0 {
            self.last.polish_pose(context);
            if let Some((reference, _)) = self.last.reference {
                self.last.set_reference(reference, map);
            }
        }
    }

    /// Estimates the first pose from the last frame or, if that fails, from the reference keyframe. Returns whether it succeeded.
    fn estimate_first_pose(&mut self, context: &Context, map: &Map) -> bool {
        let config = &context.config;
        if self.seconds_since_last() > config.tracking.max_gap_s {
            self.velocity = None;
        }
        (self.velocity.is_some() && self.track_motion_model(context, map))
            || self.track_reference_keyframe(context, map)
    }

    /// Tracks with the constant-velocity model: searches the points of the last frame around their projections.
    fn track_motion_model(&mut self, context: &Context, map: &Map) -> bool {
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

    /// Tracks the reference keyframe: searches its landmarks in the whole frame by descriptor.
    fn track_reference_keyframe(&mut self, context: &Context, map: &Map) -> bool {
        let c = &context.config.tracking;
        self.last.follow_map(map);
        let Some(keyframe) = self.reference.and_then(|id| map.keyframe(id)) else { return false };
        self.current.clear_matches();
        self.current.t_cam_world = self.last.t_cam_world;
        search_keyframe(c, keyframe, map, &mut self.current, &mut self.rotation) >= c.reference_min_matches
            && self.current.refine_pose(context) >= c.motion_min_inliers
    }

    /// Matches the landmarks of the local map and refines the pose with all matches.
    ///
    /// # Errors
    /// If fewer than `min_inliers` landmarks are inliers.
    pub(crate) fn track_local_map(
        &mut self,
        context: &Context,
        map: &Map,
        min_inliers: usize,
    ) -> Result<(), LostReason> {
        let c = &context.config.tracking;
        // Visual odometry points help the first pose only; the refined pose depends on the map alone.
        self.current.drop_odometry_points();
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
            // Without a pose it is unknown which landmarks were in view, so they are not counted.
            return Err(LostReason::TooFewInliers { found: self.inliers, needed: min_inliers });
        }
        self.observation_counts.visible.extend_from_slice(&self.visible);
        self.observation_counts
            .found
            .extend(self.current.matches.iter().flatten().filter_map(|matched| matched.landmark));
        Ok(())
    }

    /// Checks the visibility of landmarks that the tracked frame did not match: collects those in the measured free space.
    pub(crate) fn check_visibility(&mut self, context: &Context, map: &Map, depth: &DepthImage) {
        let (sensor, config) = (&context.sensor, &context.config.dynamic.full);
        // The largest possible size is reserved, so that later frames do not allocate memory.
        self.found.clear();
        self.found.reserve(self.visible.capacity());
        self.observation_counts.in_free_space.reserve(self.visible.capacity());
        self.found.extend(self.current.matches.iter().flatten().filter_map(|matched| matched.landmark));
        self.found.sort_unstable();
        for &id in self.visible.iter().filter(|id| self.found.binary_search(id).is_err()) {
            let frame = &self.current;
            if map.landmark(id).is_some_and(|l| is_free_space(config, sensor, depth, frame, &l.position)) {
                self.observation_counts.in_free_space.push(id);
            }
        }
    }

    /// Ends a tracked frame: updates the constant-velocity model and the pose relative to the reference keyframe.
    pub(crate) fn accept(&mut self, context: &Context, map: &Map) {
        self.velocity = self.last.reference.map(|_| self.current.t_cam_world * self.last.t_cam_world.inverse());
        self.interval = self.current_interval(context);
        self.last_is_tracked = true;
        self.last_covariance = None;
        if self.current.features.keeps_measured() {
            self.last_covariance = self.current.covariance(&context.sensor);
        }
        if let Some(reference) = self.reference {
            self.current.set_reference(reference, map);
        }
    }

    /// Resets the constant-velocity model, because the pose of the last frame is not suited to measure the motion.
    pub(crate) fn reset_velocity(&mut self) {
        self.velocity = None;
        self.interval = None;
    }

    /// Ends a frame that could not be tracked: it keeps the pose of the last one.
    pub(crate) fn reject(&mut self) {
        self.velocity = None;
        self.interval = None;
        self.last_is_tracked = false;
        self.current.clear_matches();
        self.current.t_cam_world = self.last.t_cam_world;
        self.current.reference = self.last.reference;
        self.inliers = 0;
    }

    /// Sets how the rows of the images are read, once that is known.
    pub(crate) fn set_row_times(&mut self, times: &FrameTimes) {
        self.last.features.set_row_times(times);
        self.current.features.set_row_times(times);
    }

    /// Lets the last frame, whose velocity is known now, tell about the readout time.
    pub(crate) fn estimate_readout(
        &self,
        context: &Context,
        map: &Map,
        estimator: &mut ReadoutEstimator,
    ) -> Option<Vector6<f64>> {
        let (reference, _) = self.last.reference.filter(|_| self.last_velocity.is_some())?;
        estimator.add(context, map, reference, &self.last)
    }

    /// Returns time and relative pose of the last frame.
    pub(crate) fn last_pose(&self) -> (i64, Option<KeyframeRelativePose>) {
        (self.last.timestamp_ns, self.last.reference)
    }

    /// Returns whether the last frame became a keyframe.
    pub(crate) fn last_was_keyframe(&self) -> bool {
        self.frames_since_keyframe == 1
    }

    /// Returns whether the current frame should become a keyframe.
    pub(crate) fn wants_keyframe(&self, context: &Context, map: &Map) -> bool {
        let Some(reference) = self.reference else { return true };
        let frames_since = self.frames_since_keyframe;
        let summary = FrameSummary { inliers: self.inliers, frames_since, fps: context.sensor.camera.fps };
        is_keyframe_wanted(context, map, reference, &self.current, summary)
    }

    /// Records that the insertion of the current frame as a keyframe was requested.
    pub(crate) fn keyframe_requested(&mut self) {
        self.frames_since_keyframe = 0;
    }

    /// Records that an earlier frame became a keyframe, which becomes the reference keyframe.
    pub(crate) fn adopt_reference(&mut self, keyframe: KeyFrameId) {
        self.reference = Some(keyframe);
    }

    /// Records that the current frame became a keyframe, and copies its pose and matches after mapping.
    pub(crate) fn keyframe_inserted(&mut self, keyframe: KeyFrameId, map: &Map) {
        self.reference = Some(keyframe);
        let Some(k) = map.keyframe(keyframe) else { return };
        self.current.t_cam_world = k.t_cam_world;
        self.current.reference = Some((keyframe, Pose::identity()));
        for (matched, landmark) in self.current.matches.iter_mut().zip(&k.landmarks) {
            *matched = landmark.and_then(|id| Some(Match::of(id, map.landmark(id)?)));
        }
    }

    /// Returns the reference keyframe: the one that shares most landmarks with the last tracked frame.
    pub(crate) fn reference(&self) -> Option<KeyFrameId> {
        self.reference
    }

    /// Resets everything except the buffers.
    pub(crate) fn reset(&mut self) {
        self.velocity = None;
        self.interval = None;
        self.last_is_tracked = false;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_at_both_ends_of_time_are_far_apart() {
        let mut tracker = Tracker::default();
        (tracker.last.timestamp_ns, tracker.current.timestamp_ns) = (i64::MIN, i64::MAX);
        assert!(tracker.seconds_since_last() > 9e9, "{}", tracker.seconds_since_last());
    }
}
