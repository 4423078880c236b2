//! What delivers frames live.

use std::time::{Duration, Instant};

use yfslam::Frame;

/// Something that delivers frames live: a camera, a pair of topics, a pipe.
pub trait LiveSource {
    /// Waits for the newest frame, but no longer than `timeout`.
    fn next(&mut self, timeout: Duration) -> Arrival;

    /// Returns how many frames were dropped so far because a newer one came.
    fn dropped(&self) -> u64;
}

/// What a source delivers.
#[derive(Debug)]
pub enum Arrival {
    /// A frame.
    Frame {
        /// The frame, with the stamp that the camera gave it.
        frame: Frame,
        /// When its last image came.
        arrival: Instant,
    },
    /// A frame that cannot be used, and why.
    Unusable(String),
    /// Nothing came in time.
    Nothing,
    /// Nothing will come any more.
    Ended,
}
