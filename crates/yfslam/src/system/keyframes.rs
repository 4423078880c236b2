//! Third stage: whether the frame becomes a keyframe, and what its insertion leads to.

use super::{Pass, Slam};
use crate::frame::Frame;
use crate::tracking::TrackingState;

impl Slam {
    /// Inserts a tracked frame as a keyframe if the map needs one. Returns whether the frame is a keyframe.
    pub(super) fn extend_map(&mut self, frame: &Frame, tracked: bool, pass: &mut Pass) -> bool {
        if pass.map_begun {
            return true;
        }
        if !tracked || !self.wants_keyframe() {
            return false;
        }
        self.tracker.keyframe_requested();
        let is_first = self.state == TrackingState::NotInitialized;
        if let Some(inserted) = self.owner.insert(&self.tracker.current, &frame.color, is_first) {
            self.tracker.keyframe_inserted(inserted.keyframe, self.owner.map());
            pass.loop_closure = pass.times.add(&inserted);
        }
        true
    }

    /// Returns whether the frame is to become a keyframe, and can.
    fn wants_keyframe(&mut self) -> bool {
        if self.is_map_frozen() || !self.tracker.wants_keyframe(&self.context, self.owner.map()) {
            return false;
        }
        let free = self.owner.is_free();
        self.statistics.keyframes_skipped += usize::from(!free);
        free
    }
}
