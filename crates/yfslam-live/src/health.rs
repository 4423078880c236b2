//! State and health as values: what a diagnostic message, a status line or a page shows.

use std::fmt;
use std::time::Duration;

use yfslam::{LostReason, TrackingState};

/// State of a live session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LiveState {
    /// No frame has come yet.
    #[default]
    WaitingForCamera,
    /// Frames come, and there is no map yet.
    Initialising,
    /// The pose is known.
    Tracking,
    /// The pose is unknown; the map is kept for relocalisation.
    Lost,
    /// The camera sends nothing.
    CameraSilent,
    /// Frames are ignored on request.
    Paused,
}

impl LiveState {
    /// Returns the state that the tracker has, while frames come.
    pub fn of(state: TrackingState) -> Self {
        match state {
            TrackingState::NotInitialized => Self::Initialising,
            TrackingState::Tracking => Self::Tracking,
            TrackingState::Lost => Self::Lost,
        }
    }
}

impl fmt::Display for LiveState {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::WaitingForCamera => "waiting for the camera",
            Self::Initialising => "initialising",
            Self::Tracking => "tracking",
            Self::Lost => "lost",
            Self::CameraSilent => "camera silent",
            Self::Paused => "paused",
        })
    }
}

/// Health of a live session.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Health {
    /// State.
    pub state: LiveState,
    /// Why the pose is not known; `None` while tracking.
    pub lost_reason: Option<LostReason>,
    /// Frames that came, per second, over the last two seconds.
    pub camera_hz: f64,
    /// Latency from the arrival of a frame to its pose: the median of the last 256 frames.
    pub latency_p50: Option<Duration>,
    /// The same, 99th percentile.
    pub latency_p99: Option<Duration>,
    /// Time that tracking took, median.
    pub tracking_p50: Option<Duration>,
    /// Frames that were tracked or lost.
    pub frames: u64,
    /// Frames with a pose.
    pub tracked: u64,
    /// Frames that were dropped because a newer one came.
    pub dropped: u64,
    /// Frames that could not be used: images that cannot be decoded or do not fit, depth that is missing.
    pub unusable: u64,
    /// The last reason for that.
    pub last_unusable: Option<String>,
    /// Frames that were late or repeated.
    pub late: u64,
    /// Jumps of the camera's clock.
    pub clock_jumps: u64,
    /// Times that the camera came back after a silence.
    pub camera_returns: u64,
    /// For how long no frame has come.
    pub silence: Duration,
    /// Features of the last frame.
    pub features: usize,
    /// Landmarks that fit its pose.
    pub inliers: usize,
    /// Keyframes of the map.
    pub keyframes: usize,
    /// Landmarks of the map.
    pub landmarks: usize,
    /// Loops that were closed.
    pub loops: u64,
    /// Times that the map was begun anew.
    pub resets: usize,
    /// Whether mapping has ended by a fault of the program.
    pub mapping_has_ended: bool,
}
