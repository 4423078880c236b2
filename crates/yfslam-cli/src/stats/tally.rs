//! Counts of frames and features.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use yfslam::{Slam, TrackingState};

use crate::stats::skip::Skip;

/// Counts of frames.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FrameTally {
    /// Frames that SLAM processed.
    pub read: usize,
    /// Frames that were tracked.
    pub tracked: usize,
    /// Frames in which the camera was lost.
    pub lost: usize,
    /// Frames before the map was initialised.
    pub before_map: usize,
    /// Frames that could not be used.
    pub skipped: usize,
    /// Skipped frames by kind of fault.
    pub skipped_by_reason: BTreeMap<String, usize>,
    /// Frame, file and fault of the first skipped frame.
    pub first_skipped: Option<String>,
    /// Frames on which the detector failed; they count as frames without boxes.
    pub detector_failures: usize,
}

impl FrameTally {
    /// Counts a frame that SLAM processed.
    pub fn count(&mut self, state: TrackingState) {
        self.read += 1;
        match state {
            TrackingState::Tracking => self.tracked += 1,
            TrackingState::Lost => self.lost += 1,
            TrackingState::NotInitialized => self.before_map += 1,
        }
    }

    /// Counts all frames tracked so far as lost, because the map was initialised again.
    pub fn restart(&mut self) {
        self.lost += std::mem::take(&mut self.tracked);
    }

    /// Counts a frame that could not be used.
    pub fn skip(&mut self, Skip { reason, message }: Skip) {
        self.skipped += 1;
        *self.skipped_by_reason.entry(reason.to_owned()).or_default() += 1;
        self.first_skipped.get_or_insert(message);
    }

    /// Returns the number of frames so far.
    pub fn total(&self) -> usize {
        self.read + self.skipped
    }

    /// Returns the share of tracked frames, %.
    pub fn tracked_percent(&self) -> f64 {
        if self.total() == 0 { 0.0 } else { 100.0 * self.tracked as f64 / self.total() as f64 }
    }
}

/// Counts of dynamic features.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct DynamicTally {
    /// Features of all frames.
    pub features: usize,
    /// Dynamic features of all frames, which were not used.
    pub dynamic_features: usize,
    /// Frames with moving regions.
    pub frames_with_motion: usize,
    /// Bounding boxes of movable objects in all frames, of any score.
    pub boxes: usize,
}

impl DynamicTally {
    /// Counts the last frame.
    pub fn count(&mut self, slam: &Slam) {
        let features = slam.features();
        self.features += features.len();
        self.dynamic_features += features.iter().filter(|f| f.trust <= 0.0).count();
        self.frames_with_motion += usize::from(!slam.moving_regions().is_empty());
        self.boxes += slam.detections().len();
    }
}
