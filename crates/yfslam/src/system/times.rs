//! Where the time of a frame goes.

use std::time::{Duration, Instant};

use crate::backend::Inserted;
use crate::loops::LoopClosed;

/// Wall time of the stages of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct StageTimes {
    /// Grey image and feature extraction.
    pub features: Duration,
    /// Waiting for the detector, which ran beside feature extraction.
    pub detector_wait: Duration,
    /// Dynamic filter, both doors.
    pub dynamic: Duration,
    /// Pose from last frame and local map.
    pub tracking: Duration,
    /// Keyframe insertion and local bundle adjustment, where it became known; zero for most frames.
    pub mapping: Duration,
    /// Place recognition: loops for keyframes, the way back for frames that are lost.
    pub places: Duration,
}

impl StageTimes {
    /// Adds what a keyframe took; returns the loop that it closed.
    pub(super) fn note(&mut self, inserted: &Inserted) -> Option<LoopClosed> {
        self.mapping += inserted.mapping;
        self.places += inserted.places;
        inserted.loop_closed
    }
}

/// Measures consecutive stages.
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    pub fn start() -> Self {
        Self(Instant::now())
    }

    pub fn lap(&mut self) -> Duration {
        let now = Instant::now();
        now.duration_since(std::mem::replace(&mut self.0, now))
    }
}
