//! The map: keyframes and landmarks in two arenas with generational ids, and one owner.
//!
//! Invariants, kept by [`ops`] and `submap`, the only places that change them:
//! 1. Landmark L lists keyframe K with feature i exactly if K's feature i lists L.
//! 2. A landmark appears at most once in a keyframe.
//! 3. A landmark has at least one observation.
//! 4. The covisibility lists of two keyframes name each other with the same weight.
//! 5. Every keyframe but the first of a submap has a parent in the map; parents form a tree for each submap, and no landmark is seen
//!    from two of them.
//! 6. Loop edges are mutual; a keyframe with one stays in the map.

mod keyframe;
mod landmark;
pub mod ops;
pub mod persist;
mod restore;
#[cfg(test)]
pub(crate) mod scene;
mod submap;

use std::collections::BTreeMap;

use slotmap::SlotMap;

use crate::geometry::Pose;
pub use keyframe::{KeyFrame, KeyFrameId};
pub use landmark::{Landmark, LandmarkId};

/// Keyframes and landmarks, of one submap or several.
#[derive(Clone, Debug, Default)]
pub struct Map {
    keyframes: SlotMap<KeyFrameId, KeyFrame>,
    landmarks: SlotMap<LandmarkId, Landmark>,
    /// What became of removed keyframes: an ancestor that stayed, and `t_removed_ancestor` at the time of removal.
    removed: BTreeMap<KeyFrameId, (KeyFrameId, Pose)>,
    keyframes_ever: u64,
}

impl Map {
    /// The keyframe, if it is still in the map.
    pub fn keyframe(&self, id: KeyFrameId) -> Option<&KeyFrame> {
        self.keyframes.get(id)
    }

    /// The landmark, if it is still in the map.
    pub fn landmark(&self, id: LandmarkId) -> Option<&Landmark> {
        self.landmarks.get(id)
    }

    /// All keyframes, in the order of their slots.
    pub fn keyframes(&self) -> impl Iterator<Item = (KeyFrameId, &KeyFrame)> {
        self.keyframes.iter()
    }

    /// All landmarks, in the order of their slots.
    pub fn landmarks(&self) -> impl Iterator<Item = (LandmarkId, &Landmark)> {
        self.landmarks.iter()
    }

    /// Number of keyframes.
    pub fn keyframe_count(&self) -> usize {
        self.keyframes.len()
    }

    /// Number of landmarks.
    pub fn landmark_count(&self) -> usize {
        self.landmarks.len()
    }

    /// Keyframes ever inserted: the sequence number of the next one.
    pub fn keyframes_ever(&self) -> u64 {
        self.keyframes_ever
    }

    /// Current `t_cam_world` of a keyframe; for a removed one by way of the ancestor it was tied to.
    pub fn keyframe_pose(&self, id: KeyFrameId) -> Option<Pose> {
        let (keyframe, t_asked_keyframe) = self.standing(id)?;
        Some(t_asked_keyframe * keyframe.t_cam_world)
    }

    /// The keyframe or, if it was removed, the ancestor it was tied to, with `t_asked_found`.
    pub fn standing(&self, id: KeyFrameId) -> Option<(&KeyFrame, Pose)> {
        let (mut id, mut t_asked_id) = (id, Pose::identity());
        loop {
            if let Some(keyframe) = self.keyframes.get(id) {
                return Some((keyframe, t_asked_id));
            }
            let (ancestor, t_id_ancestor) = self.removed.get(&id)?;
            t_asked_id *= *t_id_ancestor;
            id = *ancestor;
        }
    }

    /// Whether any keyframe measured depth: else the unit of length is arbitrary.
    pub fn has_depths(&self) -> bool {
        self.keyframes.values().any(|k| k.features.features.iter().any(|f| f.depth_m.is_some()))
    }

    /// Median depth of the landmarks that a keyframe sees; 0 if there are none.
    pub fn median_depth(&self, keyframe: &KeyFrame) -> f64 {
        let landmarks = keyframe.sights().filter_map(|(_, id)| self.landmarks.get(id));
        let mut depths: Vec<f64> = landmarks.map(|l| (keyframe.t_cam_world * l.position).z).collect();
        let middle = depths.len() / 2;
        if depths.is_empty() { 0.0 } else { *depths.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }

    /// How well a landmark is observed: 2 for each observation with depth, 1 for each without (ORB-SLAM2).
    pub fn observation_weight(&self, landmark: &Landmark) -> usize {
        landmark
            .observations
            .iter()
            .map(|&(k, f)| {
                self.keyframes.get(k).map_or(0, |k| 1 + usize::from(k.features.features[f as usize].depth_m.is_some()))
            })
            .sum()
    }
}
