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

pub(crate) mod container;
mod keyframe;
mod landmark;
pub(crate) mod ops;
pub(crate) mod persist;
mod restore;
#[cfg(test)]
pub(crate) mod scene;
mod submap;

use std::collections::BTreeMap;

use slotmap::SlotMap;

use crate::geometry::{Pose, Similarity, rigid, unscaled, with_scale};
pub use keyframe::{KeyFrame, KeyFrameId};
pub use landmark::{Landmark, LandmarkId};
pub use persist::MapError;

/// A keyframe and the pose of a frame relative to it, `t_cam_keyframe`: the frame follows every correction of the map.
pub type KeyframeRelativePose = (KeyFrameId, Pose);

/// Keyframes and landmarks, of one submap or several.
#[derive(Clone, Debug, Default)]
pub struct Map {
    keyframes: SlotMap<KeyFrameId, KeyFrame>,
    landmarks: SlotMap<LandmarkId, Landmark>,
    /// What became of removed keyframes: an ancestor that stayed, and `s_removed_ancestor` at the time of removal, each in its unit.
    removed: BTreeMap<KeyFrameId, (KeyFrameId, Similarity)>,
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
    pub(crate) fn keyframes_ever(&self) -> u64 {
        self.keyframes_ever
    }

    /// Current `t_cam_world` of a keyframe; for a removed one by way of the ancestor it was tied to.
    pub(crate) fn keyframe_pose(&self, id: KeyFrameId) -> Option<Pose> {
        self.own_pose(id).map(|own| rigid(&own))
    }

    /// Current `s_cam_world` of a keyframe, removed or not, into the unit that it was mapped in.
    fn own_pose(&self, id: KeyFrameId) -> Option<Similarity> {
        let (keyframe, s_asked_found) = self.surviving_ancestor(id)?;
        Some(s_asked_found * with_scale(&keyframe.t_cam_world, 1.0 / keyframe.unit))
    }

    /// The keyframe or, if it was removed, the ancestor it was tied to, with `s_asked_found`.
    pub(crate) fn surviving_ancestor(&self, id: KeyFrameId) -> Option<(&KeyFrame, Similarity)> {
        let (mut id, mut s_asked_id) = (id, Similarity::identity());
        loop {
            if let Some(keyframe) = self.keyframes.get(id) {
                return Some((keyframe, s_asked_id));
            }
            let (ancestor, s_id_ancestor) = self.removed.get(&id)?;
            s_asked_id *= *s_id_ancestor;
            id = *ancestor;
        }
    }

    /// A frame's pose seen from a keyframe, `t_cam_reference`, in the unit that the keyframe was mapped in: when the map is corrected, its
    /// scale included, the frame follows ([`Map::absolute_pose`]).
    pub(crate) fn relative_pose(&self, reference: KeyFrameId, t_cam_world: &Pose) -> Option<Pose> {
        let own = self.own_pose(reference)?;
        Some((with_scale(t_cam_world, own.scaling()) * own.inverse()).isometry)
    }

    /// Current `t_cam_world` of a frame that was tied to a keyframe.
    pub(crate) fn absolute_pose(&self, reference: KeyFrameId, t_cam_reference: &Pose) -> Option<Pose> {
        Some(rigid(&(unscaled(t_cam_reference) * self.own_pose(reference)?)))
    }

    /// Whether any keyframe measured depth: else the unit of length is arbitrary.
    pub(crate) fn has_depths(&self) -> bool {
        self.keyframes.values().any(|k| k.features.features.iter().any(|f| f.depth_m.is_some()))
    }

    /// Median depth of the landmarks that a keyframe sees; 0 if there are none.
    pub(crate) fn median_depth(&self, keyframe: &KeyFrame) -> f64 {
        let landmarks = keyframe.observed().filter_map(|(_, id)| self.landmarks.get(id));
        let mut depths: Vec<f64> = landmarks.map(|l| (keyframe.t_cam_world * l.position).z).collect();
        let middle = depths.len() / 2;
        if depths.is_empty() { 0.0 } else { *depths.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }

    /// How well a landmark is observed: 2 for each observation with depth, 1 for each without (ORB-SLAM2).
    pub(crate) fn observation_weight(&self, landmark: &Landmark) -> usize {
        landmark
            .observations
            .iter()
            .map(|&(k, f)| {
                self.keyframes.get(k).map_or(0, |k| 1 + usize::from(k.features.features[f as usize].depth_m.is_some()))
            })
            .sum()
    }
}
