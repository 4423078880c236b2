//! The beginning of a map: with the first frame that has enough depths; without depth, with two frames. And of a new submap, when the
//! camera is lost in a place that the map does not have.

use super::{Pass, Slam};
use crate::backend::Inserted;
use crate::detect::roll_compensation::GravityDirection;
use crate::frame::Frame;
use crate::map::KeyFrameId;
use crate::tracking::{LostReason, TrackingState};

impl Slam {
    /// Begins a map with the frame, if that is possible.
    ///
    /// # Errors
    /// The reason, if it is not.
    pub(super) fn initialise(&mut self, frame: &Frame, pass: &mut Pass) -> Result<(), LostReason> {
        if self.context.sensor.measures_depth {
            return if self.owner.is_free() { self.has_enough_to_start() } else { Err(LostReason::MappingBusy) };
        }
        // Beside another submap the camera may come back to that one first.
        if self.relocalise_frame(pass).is_ok() {
            return Ok(());
        }
        let begun = self.begin_from_two_views(frame).ok_or(LostReason::NoSecondView)?;
        pass.times.add(&begun);
        pass.map_begun = true;
        Ok(())
    }

    /// Checks whether the frame has the features, and the depths, that a map needs.
    fn has_enough_to_start(&self) -> Result<(), LostReason> {
        let config = &self.context.config.tracking;
        let features = &self.tracker.current.features.features;
        let with_depth = features.iter().filter(|f| f.trust > 0.0 && f.depth_m.is_some()).count();
        if features.len() < config.init_min_features {
            return Err(LostReason::TooFewFeatures { found: features.len(), needed: config.init_min_features });
        }
        if self.context.sensor.measures_depth && with_depth < config.init_min_landmarks {
            return Err(LostReason::TooFewDepths { found: with_depth, needed: config.init_min_landmarks });
        }
        Ok(())
    }

    /// Tries to make the map of a camera without depth from the frame and an earlier one. Returns what the insertion of the second
    /// keyframe, which this frame is, led to.
    fn begin_from_two_views(&mut self, frame: &Frame) -> Option<Inserted> {
        let start = self.initialiser.add(&self.context, &self.tracker.current, &frame.color)?;
        self.tracker.inliers = start.points.len();
        let inserted = self.owner.begin(start)?;
        self.tracker.keyframe_requested();
        self.tracker.keyframe_inserted(inserted.keyframe, self.owner.map());
        Some(inserted)
    }

    /// Returns whether the images have had enough for a map for a while, and nothing in them was recognised. Time without enough
    /// features does not count.
    pub(super) fn should_begin_submap(&mut self) -> bool {
        if self.is_map_frozen() {
            return false;
        }
        self.unknown_frames += usize::from(self.has_enough_to_start().is_ok());
        let config = &self.context.config;
        let begins = !self.context.sensor.measures_depth && self.is_young();
        let after_s = if begins { config.monocular.reset_after_s } else { config.tracking.reset_after_s };
        self.unknown_frames as f64 > after_s * self.context.sensor.camera.fps
    }

    /// Returns whether the submap that the camera is in has only just begun, or is yet to begin.
    pub(super) fn is_young(&self) -> bool {
        let young = self.context.config.tracking.reset_max_keyframes;
        match self.tracker.reference() {
            Some(reference) => self.owner.map().submap_size(reference, young + 1) <= young,
            None => self.state == TrackingState::NotInitialized,
        }
    }

    /// Lets the next frame begin a submap, in a world that continues where the camera was lost. The old submap stays, to be recognised
    /// and merged, unless it is so young that a fresh start is worth more (ORB-SLAM2): then the poses relative to it go with it.
    pub(super) fn begin_submap(&mut self) -> TrackingState {
        self.unknown_frames = 0;
        let map = self.owner.map();
        // What an earlier session left is kept in any case.
        let is_own = |root: &KeyFrameId| map.keyframe(*root).is_some_and(|k| k.sequence >= self.first_keyframe);
        let root = self.tracker.reference().and_then(|reference| map.root(reference)).filter(is_own);
        let young = self.context.config.tracking.reset_max_keyframes;
        let keyframes = root.map_or(0, |root| map.submap_size(root, young + 1));
        if map.keyframe_count() <= young && self.map_use.is_none() {
            tracing::warn!(keyframes, "lost soon after the start: the map is begun anew");
            self.owner.reset();
            self.anchors.clear();
            self.statistics.resets += 1;
            if let Some(dense) = &mut self.dense {
                dense.clear();
            }
        } else {
            tracing::warn!(keyframes, "nothing was recognised: a new submap is begun");
            if let Some(root) = root.filter(|_| keyframes <= young) {
                self.owner.remove_submap(root);
            }
        }
        self.filter.reset_history();
        self.tracker.reset();
        self.gravity = GravityDirection::default();
        self.initialiser.reset();
        TrackingState::NotInitialized
    }
}
