//! When a map begins: with the first frame that has depths enough, without depth with two frames; and anew when the camera is elsewhere.

use super::Slam;
use crate::backend::Inserted;
use crate::frame::RgbdFrame;
use crate::map::KeyFrameId;
use crate::tracking::TrackingState;
use crate::upright::Down;

impl Slam {
    /// Whether the frame has the features, and the depths, that a map needs.
    pub(super) fn has_enough_to_start(&self) -> bool {
        let features = &self.tracker.current.features.features;
        let with_depth = features.iter().filter(|f| f.trust > 0.0 && f.depth_m.is_some()).count();
        features.len() >= self.config.tracking.init_min_features
            && (!self.sensor.measures_depth || with_depth >= self.config.tracking.init_min_landmarks)
    }

    /// Looks whether the frame and an earlier one make the map of a camera without depth. Returns what became of its second keyframe,
    /// which this frame is.
    pub(super) fn begin_from_two_views(&mut self, frame: &RgbdFrame) -> Option<Inserted> {
        let start = self.initialiser.see(&self.sensor, &self.config, &self.tracker.current, &frame.color)?;
        self.tracker.inliers = start.points.len();
        let inserted = self.owner.begin(start)?;
        self.tracker.offered_keyframe();
        self.tracker.became_keyframe(inserted.keyframe, self.owner.map());
        Some(inserted)
    }

    /// Whether the camera has seen enough for a map for a while, and nothing in it was recognised. Time in which there was nothing to
    /// see does not count.
    pub(super) fn is_elsewhere(&mut self) -> bool {
        if self.is_map_frozen() {
            return false;
        }
        self.unknown_frames += usize::from(self.has_enough_to_start());
        let begins = !self.sensor.measures_depth && self.is_young();
        let after_s = if begins { self.config.monocular.reset_after_s } else { self.config.tracking.reset_after_s };
        self.unknown_frames as f64 > after_s * self.sensor.camera.fps
    }

    /// Whether the submap that the camera is in has only just begun, or is yet to begin.
    pub(super) fn is_young(&self) -> bool {
        let young = self.config.tracking.reset_max_keyframes;
        match self.tracker.reference() {
            Some(reference) => self.owner.map().submap_size(reference, young + 1) <= young,
            None => self.state == TrackingState::NotInitialized,
        }
    }

    /// Begins a submap with the next frame, in a world that continues where the camera was lost. The old one stays, to be recognised
    /// and joined, unless it is so young that a fresh start is worth more (ORB-SLAM2): then the poses that hung on it go with it.
    pub(super) fn begin_submap(&mut self) -> TrackingState {
        self.unknown_frames = 0;
        let map = self.owner.map();
        // What an earlier session left is kept in any case.
        let is_own = |root: &KeyFrameId| map.keyframe(*root).is_some_and(|k| k.sequence >= self.first_keyframe);
        let root = self.tracker.reference().and_then(|reference| map.root(reference)).filter(is_own);
        let young = self.config.tracking.reset_max_keyframes;
        let keyframes = root.map_or(0, |root| map.submap_size(root, young + 1));
        if map.keyframe_count() <= young && self.map_use.is_none() {
            tracing::warn!(keyframes, "lost soon after the start: the map is begun anew");
            self.owner.reset();
            self.anchors.clear();
            self.resets += 1;
        } else {
            tracing::warn!(keyframes, "nothing was recognised: a new submap is begun");
            if let Some(root) = root.filter(|_| keyframes <= young) {
                self.owner.forget(root);
            }
        }
        self.filter.forget_views();
        self.tracker.reset();
        self.down = Down::default();
        self.initialiser.reset();
        TrackingState::NotInitialized
    }
}
