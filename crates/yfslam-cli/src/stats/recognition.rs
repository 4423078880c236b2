//! Loop closing and relocalisation: loops that were closed, and how long the camera was lost.

use serde::Serialize;
use yfslam::{LoopClosure, Tracked, TrackingState};

/// Loops and losses of a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RecognitionTally {
    /// Loops that were closed.
    pub loops: Vec<Loop>,
    /// Periods in which the camera was lost.
    pub lost: Vec<LostPeriod>,
    /// Keyframes that were not inserted because mapping was busy, with --threaded.
    pub keyframes_dropped: usize,
    /// Tracked frames that are not in the trajectory: those of submaps that were not merged with the largest one.
    pub frames_in_other_submaps: usize,
}

/// A loop that was closed.
#[derive(Clone, Debug, Serialize)]
pub struct Loop {
    /// Time of the frame after which it was closed, ns.
    pub timestamp_ns: i64,
    /// Landmarks of the recognised place that are inliers.
    pub inliers: usize,
    /// Distance between the estimated position of the camera and its position according to the recognised place, m.
    pub drift_m: f64,
    /// Angle likewise, degrees.
    pub drift_deg: f64,
    /// Unit of length around the camera in units of the recognised place: 1 where depth is measured.
    pub drift_scale: f64,
    /// Whether it merged two submaps: the drift is then the transformation between their worlds.
    pub merged_submaps: bool,
}

/// A period in which the camera was lost.
#[derive(Clone, Debug, Serialize)]
pub struct LostPeriod {
    /// Time of the first frame, ns.
    pub from_ns: i64,
    /// Number of frames.
    pub frames: usize,
    /// Whether tracking resumed after it.
    pub relocalised: bool,
}

impl RecognitionTally {
    /// Counts a frame.
    pub fn count(&mut self, tracked: &Tracked) {
        self.count_lost(tracked);
        if let Some(closed) = &tracked.loop_closure {
            self.close(tracked.timestamp_ns, closed);
        }
    }

    /// Counts a loop.
    pub fn close(&mut self, timestamp_ns: i64, closed: &LoopClosure) {
        let motion = closed.drift.isometry;
        let (drift_m, drift_deg) = (motion.translation.vector.norm(), motion.rotation.angle().to_degrees());
        let drift_scale = closed.drift.scaling();
        let LoopClosure { inliers, merged_submaps, .. } = *closed;
        tracing::info!(inliers, drift_m, drift_deg, drift_scale, merged_submaps, "loop closed");
        self.loops.push(Loop { timestamp_ns, inliers, drift_m, drift_deg, drift_scale, merged_submaps });
    }

    fn count_lost(&mut self, tracked: &Tracked) {
        let open = self.lost.last_mut().filter(|period| !period.relocalised);
        match (tracked.state, open) {
            (TrackingState::Lost, Some(period)) => period.frames += 1,
            (TrackingState::Lost, None) => {
                self.lost.push(LostPeriod { from_ns: tracked.timestamp_ns, frames: 1, relocalised: false });
            }
            (TrackingState::Tracking, Some(period)) => period.relocalised = true,
            _ => {}
        }
    }
}
