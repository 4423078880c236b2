//! Wall times of the stages of a frame.

use std::time::{Duration, Instant};

use crate::backend::Inserted;
use crate::loops::LoopClosure;

/// Wall time of the stages of one frame.
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub struct StageTimes {
    /// Grey image and feature extraction.
    pub features: Duration,
    /// Waiting for the detector, which ran beside feature extraction.
    pub detector_wait: Duration,
    /// The dynamic filter before the pose.
    pub dynamic: Duration,
    /// Pose from the last frame and the local map, with the dynamic filter after the first pose.
    pub tracking: Duration,
    /// Keyframe insertion and local bundle adjustment, at the frame where the result became known; zero for most frames.
    pub mapping: Duration,
    /// Place recognition: loop closing for keyframes, relocalisation for lost frames.
    pub loops: Duration,
    /// Extraction of a keyframe patch for the dense map; zero for most frames.
    pub dense_patch: Duration,
    /// Insertion of the patch, and moving all patches with the map; zero for most frames.
    pub dense_map: Duration,
}

impl StageTimes {
    /// Adds what a keyframe took; returns the loop that it closed.
    pub(super) fn add(&mut self, inserted: &Inserted) -> Option<LoopClosure> {
        self.mapping += inserted.mapping;
        self.loops += inserted.loops;
        inserted.loop_closure
    }
}

/// Measures consecutive stages.
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    /// Starts to measure.
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    /// Returns the time since the start or the last lap.
    pub(super) fn lap(&mut self) -> Duration {
        let now = Instant::now();
        now.duration_since(std::mem::replace(&mut self.0, now))
    }
}
