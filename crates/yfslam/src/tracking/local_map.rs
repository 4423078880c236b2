//! The part of the map around the camera (ORB-SLAM, IEEE T-RO 2015, section V-D).
//!
//! In: the landmarks a frame sees. Out: the keyframes that see them too, their neighbours, and all landmarks of those.

use slotmap::SecondaryMap;

use crate::config::TrackingConfig;
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::tracking::tracked_frame::TrackedFrame;

/// Keyframes and landmarks around the camera. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(super) struct LocalMap {
    /// Keyframes, those sharing most landmarks with the frame first.
    pub keyframes: Vec<KeyFrameId>,
    /// Landmarks of those keyframes that the frame is not matched to.
    pub landmarks: Vec<LandmarkId>,
    votes: SecondaryMap<KeyFrameId, u32>,
    /// Mark of the last update in which a landmark was taken.
    taken: SecondaryMap<LandmarkId, u64>,
    update: u64,
}

impl LocalMap {
    /// Collects the surroundings of what `frame` sees. Returns the keyframe that shares most with it.
    pub(super) fn update(&mut self, config: &TrackingConfig, map: &Map, frame: &TrackedFrame) -> Option<KeyFrameId> {
        self.update += 1;
        self.votes.clear();
        for matched in frame.matches.iter().flatten() {
            let Some(id) = matched.landmark else { continue };
            let Some(landmark) = map.landmark(id) else { continue };
            self.taken.insert(id, self.update);
            for &(keyframe, _) in &landmark.observations {
                match self.votes.get_mut(keyframe) {
                    Some(votes) => *votes += 1,
                    None => {
                        self.votes.insert(keyframe, 1);
                    }
                }
            }
        }
        self.keyframes.clear();
        self.keyframes.extend(self.votes.keys());
        let votes = &self.votes;
        self.keyframes.sort_unstable_by_key(|&k| (std::cmp::Reverse(votes[k]), k));
        self.keyframes.truncate(config.local_keyframes);
        self.extend_by_neighbours(config, map);
        self.landmarks.clear();
        for &keyframe in &self.keyframes {
            let Some(keyframe) = map.keyframe(keyframe) else { continue };
            for (_, id) in keyframe.observed() {
                if self.taken.insert(id, self.update) != Some(self.update) {
                    self.landmarks.push(id);
                }
            }
        }
        self.keyframes.first().copied()
    }

    /// Each keyframe brings its best covisible one, a child and its parent that are not there yet.
    fn extend_by_neighbours(&mut self, config: &TrackingConfig, map: &Map) {
        let direct = self.keyframes.len();
        for i in 0..direct {
            let Some(keyframe) = map.keyframe(self.keyframes[i]) else { continue };
            if self.keyframes.len() >= config.local_keyframes {
                return;
            }
            let is_new = |id: &KeyFrameId, votes: &SecondaryMap<KeyFrameId, u32>| !votes.contains_key(*id);
            let covisible = keyframe.covisible.iter().take(config.local_neighbours).map(|(id, _)| *id);
            let brought = [
                covisible.clone().find(|id| is_new(id, &self.votes)),
                keyframe.children.iter().copied().find(|id| is_new(id, &self.votes)),
                keyframe.parent.filter(|id| is_new(id, &self.votes)),
            ];
            for id in brought.into_iter().flatten() {
                if self.votes.insert(id, 0).is_none() {
                    self.keyframes.push(id);
                }
            }
        }
    }
}
