//! Places seen before: finding the way back when lost, and closing loops (ORB-SLAM, IEEE T-RO 2015, sections V-C and VII; ORB-SLAM2,
//! IEEE T-RO 2017, section III-C), without a vocabulary.
//!
//! ```text
//! features ─► recognise ─► verify ─► correct
//!             which place?  P3P       join, pose graph, bundle adjustment
//! ```
//!
//! In: keyframes, and frames whose pose is unknown. Out: poses, and a map without the drift of a way that led back.

mod correct;
mod index;
mod recognise;
mod verify;

use std::sync::{Mutex, PoisonError};

use slotmap::SecondaryMap;

use crate::config::Config;
use crate::geometry::Pose;
use crate::map::{KeyFrameId, Map};
use crate::sensor::SensorModel;
use crate::tracking::TrackedFrame;
use recognise::Candidate;
pub use recognise::Recogniser;

/// A loop that was closed.
#[derive(Clone, Copy, Debug)]
pub struct LoopClosed {
    /// The keyframe that came back.
    pub keyframe: KeyFrameId,
    /// The keyframe of the old place that shares most with it.
    pub to: KeyFrameId,
    /// Landmarks of the old place that fit.
    pub inliers: usize,
    /// How the keyframe's estimate differed from the old place's: `t_estimated_located`, in the camera's frame.
    pub drift: Pose,
}

/// Seeks a frame in the whole map. Returns whether it was found: its pose and matches are set then.
pub fn relocalise(
    recogniser: &mut Recogniser,
    sensor: &SensorModel,
    config: &Config,
    map: &Map,
    frame: &mut TrackedFrame,
) -> bool {
    let c = &config.places;
    let candidates = recogniser.candidates(c, map, &frame.features, |_| true);
    candidates.iter().any(|place| verify::locate(sensor, config, map, place, frame, c.relocalise_min_inliers).is_some())
}

/// Closes loops.
#[derive(Clone, Debug, Default)]
pub struct LoopCloser {
    /// Places that the last keyframe resembled, with the number of keyframes in a row that agreed.
    consistent: Vec<(Vec<KeyFrameId>, usize)>,
    /// Sequence number of the keyframe that closed the last loop.
    last_loop: Option<u64>,
    frame: TrackedFrame,
}

impl LoopCloser {
    /// Forgets all places and loops.
    pub fn reset(&mut self) {
        self.consistent.clear();
        self.last_loop = None;
    }

    /// Looks whether a new keyframe shows an old place, and closes the loop if so.
    pub fn close(
        &mut self,
        sensor: &SensorModel,
        config: &Config,
        recogniser: &Mutex<Recogniser>,
        map: &mut Map,
        keyframe: KeyFrameId,
    ) -> Option<LoopClosed> {
        let k = map.keyframe(keyframe)?;
        let (sequence, estimated) = (k.sequence, k.t_cam_world);
        if self.last_loop.is_some_and(|last| sequence < last + config.loops.min_keyframes_between) {
            self.consistent.clear();
            return None;
        }
        self.frame.features.clone_from(&k.features);
        let candidates =
            old_places(&mut recogniser.lock().unwrap_or_else(PoisonError::into_inner), config, map, keyframe);
        for place in self.consistent_ones(config, candidates) {
            let found = verify::locate(sensor, config, map, &place, &mut self.frame, config.loops.min_inliers);
            let Some(inliers) = found else { continue };
            let drift = estimated * self.frame.t_cam_world.inverse();
            correct::close(sensor, config, map, keyframe, &place, &self.frame);
            self.last_loop = Some(sequence);
            self.consistent.clear();
            return Some(LoopClosed { keyframe, to: place.keyframe, inliers, drift });
        }
        None
    }

    /// Those candidates that the last keyframes agreed on: a candidate agrees with an earlier one if their groups overlap.
    fn consistent_ones(&mut self, config: &Config, candidates: Vec<Candidate>) -> Vec<Candidate> {
        let previous = std::mem::take(&mut self.consistent);
        let mut chosen = Vec::new();
        for place in candidates {
            let agree = |group: &[KeyFrameId]| group.iter().any(|id| place.group.contains(id));
            let times = previous.iter().filter(|(group, _)| agree(group)).map(|(_, times)| *times).max();
            let times = 1 + times.unwrap_or(0);
            self.consistent.push((place.group.clone(), times));
            if times >= config.loops.min_consistent {
                chosen.push(place);
            }
        }
        chosen
    }
}

/// Places that resemble the keyframe and are not those it is connected with anyway.
fn old_places(recogniser: &mut Recogniser, config: &Config, map: &Map, keyframe: KeyFrameId) -> Vec<Candidate> {
    let Some(k) = map.keyframe(keyframe) else { return Vec::new() };
    let near: Vec<KeyFrameId> = std::iter::once(keyframe).chain(k.covisible.iter().map(|(id, _)| *id)).collect();
    let mut local = SecondaryMap::new();
    for (_, landmark) in near.iter().filter_map(|id| map.keyframe(*id)).flat_map(|k| k.sights()) {
        local.insert(landmark, ());
    }
    let mut candidates = recogniser.candidates(&config.places, map, &k.features, |id| !local.contains_key(id));
    candidates.retain(|place| !near.contains(&place.keyframe));
    candidates
}
