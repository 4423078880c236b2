//! What became of places: loops that were closed, and how long the camera was lost.

use serde::Serialize;
use yfslam::Tracked;
use yfslam::loops::LoopClosed;
use yfslam::tracking::TrackingState;

/// Loops and losses of a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PlaceTally {
    /// Loops that were closed.
    pub loops: Vec<Loop>,
    /// Stretches of frames over which the camera was lost.
    pub lost: Vec<LostStretch>,
    /// Frames that were worth a keyframe while mapping was busy, with --threaded.
    pub keyframes_passed_over: usize,
    /// Tracked frames that are not in the trajectory: those of submaps that were not joined with the one that has most.
    pub frames_apart: usize,
}

/// A loop that was closed.
#[derive(Clone, Debug, Serialize)]
pub struct Loop {
    /// Time of the frame at which it became known, ns.
    pub timestamp_ns: i64,
    /// Landmarks of the old place that fitted.
    pub inliers: usize,
    /// Distance between where the camera was thought to be and where the old place says it is, m.
    pub drift_m: f64,
    /// Angle likewise, degrees.
    pub drift_deg: f64,
    /// The unit of length around the camera in that of the old place: 1 where depth is measured.
    pub drift_scale: f64,
    /// Whether it joined two submaps: the drift is then the motion between their worlds.
    pub merged_submaps: bool,
}

/// A stretch of frames over which the camera was lost.
#[derive(Clone, Debug, Serialize)]
pub struct LostStretch {
    /// Time of the first frame, ns.
    pub from_ns: i64,
    /// Number of frames.
    pub frames: usize,
    /// Whether the camera was found again.
    pub found_again: bool,
}

impl PlaceTally {
    /// Takes account of a frame.
    pub fn count(&mut self, tracked: &Tracked) {
        self.lost_or_found(tracked);
        if let Some(closed) = &tracked.loop_closed {
            self.close(tracked.timestamp_ns, closed);
        }
    }

    /// Takes account of a loop.
    pub fn close(&mut self, timestamp_ns: i64, closed: &LoopClosed) {
        let motion = closed.drift.isometry;
        let (drift_m, drift_deg) = (motion.translation.vector.norm(), motion.rotation.angle().to_degrees());
        let drift_scale = closed.drift.scaling();
        let LoopClosed { inliers, merged_submaps, .. } = *closed;
        tracing::info!(inliers, drift_m, drift_deg, drift_scale, merged_submaps, "loop closed");
        self.loops.push(Loop { timestamp_ns, inliers, drift_m, drift_deg, drift_scale, merged_submaps });
    }

    fn lost_or_found(&mut self, tracked: &Tracked) {
        let open = self.lost.last_mut().filter(|stretch| !stretch.found_again);
        match (tracked.state, open) {
            (TrackingState::Lost, Some(stretch)) => stretch.frames += 1,
            (TrackingState::Lost, None) => {
                self.lost.push(LostStretch { from_ns: tracked.timestamp_ns, frames: 1, found_again: false });
            }
            (TrackingState::Tracking, Some(stretch)) => stretch.found_again = true,
            _ => {}
        }
    }
}
