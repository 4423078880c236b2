//! Second stage: the pose of the frame, from the last frame and the local map, or by place recognition when the camera is lost.

use std::sync::PoisonError;

use nalgebra::Point3;

use super::{MapUse, Pass, Slam};
use crate::frame::Frame;
use crate::image::DepthImage;
use crate::loops::{SearchRegion, relocalise};
use crate::tracking::{LostReason, TrackedFrame, TrackingState};

impl Slam {
    /// Estimates the pose of the frame.
    ///
    /// # Errors
    /// The reason, if it is not known.
    pub(super) fn localise(&mut self, frame: &Frame, pass: &mut Pass) -> Result<(), LostReason> {
        if let Some(inserted) = self.owner.poll() {
            self.tracker.adopt_reference(inserted.keyframe);
            pass.loop_closure = pass.times.add(&inserted);
        }
        let localised = match self.state {
            TrackingState::NotInitialized => self.initialise(frame, pass),
            TrackingState::Tracking => self.track_frame(&pass.depth),
            TrackingState::Lost => self.relocalise_frame(pass),
        };
        self.owner.count(&mut self.tracker.observation_counts);
        if localised.is_ok() {
            self.correct_last_frame();
        }
        let (config, was_tracking) = (&self.context.config.dynamic, self.state == TrackingState::Tracking);
        if localised.is_ok() {
            self.tracker.accept(&self.context, self.owner.map());
            self.gravity.add(&self.tracker.current.t_cam_world);
            if let Some(relative_pose) = self.tracker.current.reference {
                self.filter.end_frame(config, frame.timestamp_ns, relative_pose);
            }
            if !was_tracking {
                self.tracker.reset_velocity();
            }
        } else {
            self.tracker.reject();
        }
        pass.times.tracking = pass.clock.lap();
        localised
    }

    /// Tracks a frame whose predecessor was tracked, and checks the visibility of landmarks that were not matched.
    fn track_frame(&mut self, depth: &DepthImage) -> Result<(), LostReason> {
        let min_inliers = self.context.config.tracking.local_min_inliers;
        let filter = self.filter.as_mut();
        let first = self.tracker.track(&self.context, self.owner.map(), filter, depth, min_inliers);
        if let Err(reason) = first
            && !self.track_with_doubted_boxes(depth)
        {
            return Err(reason);
        }
        if self.filter.checks_visibility() && !self.is_map_frozen() {
            self.tracker.check_visibility(&self.context, self.owner.map(), depth);
        }
        Ok(())
    }

    /// Tracks such a frame also by the features that boxes exclude: a false box that fills the image must not lose the camera. People
    /// who are really there have no landmarks in the map.
    fn track_with_doubted_boxes(&mut self, depth: &DepthImage) -> bool {
        let config = &self.context.config;
        // The same certainty as for a camera that was lost.
        let min_inliers = config.place_recognition.relocalise_min_inliers;
        let filter = self.filter.as_mut();
        let tracked = filter.doubt_boxes(&config.dynamic, &mut self.tracker.current.features)
            && self.tracker.track(&self.context, self.owner.map(), filter, depth, min_inliers).is_ok();
        self.tracker.current.settle_doubts();
        tracked
    }

    /// Searches the whole map for the place that the frame shows, and tracks the frame there.
    pub(super) fn relocalise_frame(&mut self, pass: &mut Pass) -> Result<(), LostReason> {
        let region = self.search_region();
        let recogniser = self.owner.recogniser();
        let mut recogniser = recogniser.lock().unwrap_or_else(PoisonError::into_inner);
        let map = self.owner.map();
        let (context, current) = (&self.context, &mut self.tracker.current);
        let mut search =
            |current: &mut TrackedFrame| relocalise(&mut recogniser, context, map, current, region.as_ref());
        // A place may be hidden by a false box only.
        let found = search(current)
            || (self.filter.doubt_boxes(&context.config.dynamic, &mut current.features) && search(current));
        let localised = if found {
            let min_inliers = self.context.config.place_recognition.relocalise_min_inliers;
            self.tracker.track_local_map(&self.context, map, min_inliers)
        } else {
            Err(LostReason::NotRecognised)
        };
        pass.times.loops += pass.clock.lap();
        localised
    }

    /// Returns where the camera can be since it was lost; `None` after too long a time, or if it never was tracked.
    fn search_region(&self) -> Option<SearchRegion> {
        let c = &self.context.config.place_recognition;
        let last = self.anchors.last()?;
        let lost_s = self.tracker.current.timestamp_ns.saturating_sub(last.timestamp_ns) as f64 * 1e-9;
        let t_cam_world = self.owner.map().absolute_pose(last.reference, &last.t_cam_reference)?;
        let center_world = t_cam_world.inverse_transform_point(&Point3::origin());
        // The longer the camera is lost, the less its last position says, until it says nothing.
        let elapsed_share = lost_s / c.search_region_s;
        let gain = c.relocalise_min_match_ratio_far - c.relocalise_min_match_ratio;
        let region = SearchRegion {
            reference: last.reference,
            center_world,
            radius_m: c.max_speed_m_per_s * (lost_s + 1.0),
            min_match_ratio: c.relocalise_min_match_ratio + gain * elapsed_share,
        };
        (elapsed_share <= 1.0).then_some(region)
    }

    /// Returns whether the map stays as it is.
    pub(super) fn is_map_frozen(&self) -> bool {
        self.map_use == Some(MapUse::Localise)
    }
}
