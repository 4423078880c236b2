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

use crate::config::Config;
use crate::geometry::Pose;
use crate::map::{KeyFrameId, Map};
use crate::sensor::SensorModel;
use crate::tracking::TrackedFrame;
use recognise::{Candidate, Recogniser};
use slotmap::SecondaryMap;

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

/// Recognises places, finds the way back, closes loops.
#[derive(Clone, Debug, Default)]
pub struct PlaceMemory {
    recogniser: Recogniser,
    /// Places that the last keyframe resembled, with the number of keyframes in a row that agreed.
    consistent: Vec<(Vec<KeyFrameId>, usize)>,
    /// Sequence number of the keyframe that closed the last loop.
    last_loop: Option<u64>,
    frame: TrackedFrame,
}

impl PlaceMemory {
    /// Takes the landmarks of a keyframe in, so that the place is known again.
    pub fn learn(&mut self, map: &Map, keyframe: KeyFrameId) {
        self.recogniser.learn(map, keyframe);
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        self.recogniser.reset();
        self.consistent.clear();
        self.last_loop = None;
    }

    /// Seeks a frame in the whole map. Returns whether it was found: its pose and matches are set then.
    pub fn relocalise(&mut self, sensor: &SensorModel, config: &Config, map: &Map, frame: &mut TrackedFrame) -> bool {
        let c = &config.places;
        let candidates = self.recogniser.candidates(c, map, &frame.features, |_| true);
        candidates
            .iter()
            .any(|place| verify::locate(sensor, config, map, place, frame, c.relocalise_min_inliers).is_some())
    }

    /// Looks whether a new keyframe shows an old place, and closes the loop if so.
    pub fn close_loop(
        &mut self,
        sensor: &SensorModel,
        config: &Config,
        map: &mut Map,
        keyframe: KeyFrameId,
    ) -> Option<LoopClosed> {
        let k = map.keyframe(keyframe)?;
        if self.last_loop.is_some_and(|last| k.sequence < last + config.loops.min_keyframes_between) {
            self.consistent.clear();
            return None;
        }
        let sequence = k.sequence;
        let candidates = self.old_places(config, map, keyframe);
        for place in self.consistent_ones(config, candidates) {
            let k = map.keyframe(keyframe)?;
            self.frame.features.clone_from(&k.features);
            let estimated = k.t_cam_world;
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

    /// Places that resemble the keyframe and are not those it is connected with anyway.
    fn old_places(&mut self, config: &Config, map: &Map, keyframe: KeyFrameId) -> Vec<Candidate> {
        let Some(k) = map.keyframe(keyframe) else { return Vec::new() };
        let near: Vec<KeyFrameId> = std::iter::once(keyframe).chain(k.covisible.iter().map(|(id, _)| *id)).collect();
        let mut local = SecondaryMap::new();
        for (_, landmark) in near.iter().filter_map(|id| map.keyframe(*id)).flat_map(|k| k.sights()) {
            local.insert(landmark, ());
        }
        let mut candidates = self.recogniser.candidates(&config.places, map, &k.features, |id| !local.contains_key(id));
        candidates.retain(|place| !near.contains(&place.keyframe));
        candidates
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
