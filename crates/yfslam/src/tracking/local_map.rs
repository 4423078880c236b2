//! The local map: the part of the map around the camera (ORB-SLAM, IEEE T-RO 2015, section V-D).
//!
//! In: the matched landmarks of a frame. Out: the keyframes that observe them, the neighbours of these keyframes, and all their landmarks.

use slotmap::SecondaryMap;

use crate::config::TrackingConfig;
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::tracking::tracked_frame::TrackedFrame;

/// Keyframes and landmarks of the local map. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(super) struct LocalMap {
    /// Keyframes, in descending order of the number of landmarks shared with the frame.
    pub keyframes: Vec<KeyFrameId>,
    /// Landmarks of these keyframes without a match in the frame.
    pub landmarks: Vec<LandmarkId>,
    /// Number of landmarks that each keyframe shares with the frame.
    shared: SecondaryMap<KeyFrameId, u32>,
    /// Number of the last update in which a landmark was matched or added to `landmarks`.
    taken: SecondaryMap<LandmarkId, u64>,
    update: u64,
}

impl LocalMap {
    /// Collects the local map of `frame`. Returns the keyframe that shares most landmarks with it.
    pub(super) fn update(&mut self, config: &TrackingConfig, map: &Map, frame: &TrackedFrame) -> Option<KeyFrameId> {
        self.update += 1;
        self.shared.clear();
        for matched in frame.matches.iter().flatten() {
            let Some(id) = matched.landmark else { continue };
            let Some(landmark) = map.landmark(id) else { continue };
            self.taken.insert(id, self.update);
            for &(keyframe, _) in &landmark.observations {
                match self.shared.get_mut(keyframe) {
                    Some(count) => *count += 1,
                    None => {
                        self.shared.insert(keyframe, 1);
                    }
                }
            }
        }
        self.keyframes.clear();
        self.keyframes.extend(self.shared.keys());
        let shared = &self.shared;
        self.keyframes.sort_unstable_by_key(|&k| (std::cmp::Reverse(shared[k]), k));
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

    /// Adds, for each keyframe, its best covisible keyframe, a child and its parent, if they are not in the local map yet.
    fn extend_by_neighbours(&mut self, config: &TrackingConfig, map: &Map) {
        let direct = self.keyframes.len();
        for i in 0..direct {
            let Some(keyframe) = map.keyframe(self.keyframes[i]) else { continue };
            if self.keyframes.len() >= config.local_keyframes {
                return;
            }
            let is_new = |id: &KeyFrameId, shared: &SecondaryMap<KeyFrameId, u32>| !shared.contains_key(*id);
            let covisible = keyframe.covisible.iter().take(config.local_neighbours).map(|(id, _)| *id);
            let neighbours = [
                covisible.clone().find(|id| is_new(id, &self.shared)),
                keyframe.children.iter().copied().find(|id| is_new(id, &self.shared)),
                keyframe.parent.filter(|id| is_new(id, &self.shared)),
            ];
            for id in neighbours.into_iter().flatten() {
                if self.shared.insert(id, 0).is_none() {
                    self.keyframes.push(id);
                }
            }
        }
    }
}
