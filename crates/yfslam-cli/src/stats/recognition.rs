//! Loop closing and relocalisation: loops that were closed, and how long the camera was lost.

use serde::Serialize;
use yfslam::{LoopClosure, Tracked, TrackingStart, TrackingState};

/// A map from an earlier session, and where it was recognised.
#[derive(Clone, Debug, Serialize)]
pub struct LoadedMap {
    /// Its file.
    pub file: String,
    /// Whether the run extends it; else it is only localised in.
    pub is_extended: bool,
    /// `None` if no frame shows a place of it, as far as that was recognised.
    pub recognised: Option<Recognition>,
}

/// The first frame that shows a place of a map.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Recognition {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// Number of frames before it.
    pub after_frames: usize,
    /// Position of the camera in the world of the map, m.
    pub position_m: [f64; 3],
}

/// Loops and losses of a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RecognitionTally {
    /// The map that the run has loaded.
    pub loaded_map: Option<LoadedMap>,
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
    /// Whether it ended because a place of the map was recognised.
    pub relocalised: bool,
    /// Whether it ended because a new map or submap was begun, whose relation to the old one is not known unless they are merged later.
    pub begun_anew: bool,
}

impl LostPeriod {
    fn is_open(&self) -> bool {
        !(self.relocalised || self.begun_anew)
    }
}

impl RecognitionTally {
    /// Counts the frame after `frames` others.
    pub fn count(&mut self, tracked: &Tracked, frames: usize) {
        self.count_lost(tracked);
        let is_merged = || tracked.loop_closure.as_ref().is_some_and(|closed| closed.merged_submaps);
        let is_recognised = tracked.start == Some(TrackingStart::Recognised) || is_merged();
        if let (true, Some(map), Some(pose)) = (is_recognised, &mut self.loaded_map, &tracked.t_world_cam)
            && map.recognised.is_none()
        {
            let (timestamp_ns, position_m) = (tracked.timestamp_ns, pose.translation.vector.into());
            tracing::info!(map = map.file, after_frames = frames, "map recognised");
            map.recognised = Some(Recognition { timestamp_ns, after_frames: frames, position_m });
        }
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
        let open = self.lost.last_mut().filter(|period| period.is_open());
        match (tracked.state, open) {
            (TrackingState::Tracking, Some(period)) => {
                period.begun_anew = tracked.start == Some(TrackingStart::NewMap);
                period.relocalised = !period.begun_anew;
            }
            (TrackingState::Tracking, None) => {}
            (_, Some(period)) => period.frames += 1,
            (TrackingState::Lost, None) => {
                let from_ns = tracked.timestamp_ns;
                self.lost.push(LostPeriod { from_ns, frames: 1, relocalised: false, begun_anew: false });
            }
            (TrackingState::NotInitialized, None) => {}
        }
    }
}
