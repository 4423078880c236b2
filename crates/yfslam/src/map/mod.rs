//! The map: keyframes and landmarks in two arenas with generational ids, with one owner (ORB-SLAM, IEEE T-RO 2015, sections III-C and
//! III-D; submaps as in Atlas: Elvira, Tardós and Montiel, IROS 2019).
//!
//! In: keyframes and observations. Out: covisibility graph, spanning tree, poses and landmarks. Only [`ops`], `submap` and `restore`
//! change the map. They preserve these invariants:
//! 1. Landmark L has an observation by feature i of keyframe K if and only if feature i of K refers to L.
//! 2. A keyframe observes a landmark with at most one feature.
//! 3. A landmark has at least one observation.
//! 4. Covisibility is mutual, with the same weight on both sides.
//! 5. Every keyframe except the root of a submap has a parent in the map. Each submap is a tree, and no landmark is observed from two
//!    submaps.
//! 6. Loop edges are mutual; a keyframe with a loop edge is never removed.

#[cfg(feature = "persist")]
pub(crate) mod camera_record;
#[cfg(feature = "persist")]
pub(crate) mod container;
mod keyframe;
mod landmark;
pub(crate) mod ops;
#[cfg(feature = "persist")]
pub(crate) mod persist;
#[cfg(feature = "persist")]
mod restore;
#[cfg(test)]
pub(crate) mod scene;
mod submap;
#[cfg(test)]
pub(crate) mod warehouse;

use std::collections::BTreeMap;

use slotmap::SlotMap;

use crate::geometry::{Pose, Similarity, rigid, unscaled, with_scale};
pub use keyframe::{KeyFrame, KeyFrameId};
pub use landmark::{Landmark, LandmarkId};
#[cfg(feature = "persist")]
pub use persist::MapError;

/// A reference keyframe and the pose of a frame relative to it, `t_cam_keyframe`; the frame follows every correction of the map.
pub type KeyframeRelativePose = (KeyFrameId, Pose);

/// Keyframes and landmarks of one or more submaps.
#[derive(Clone, Debug, Default)]
pub struct Map {
    keyframes: SlotMap<KeyFrameId, KeyFrame>,
    landmarks: SlotMap<LandmarkId, Landmark>,
    /// For each removed keyframe its parent at that time, and `s_removed_parent`, each in its own unit of length.
    removed: BTreeMap<KeyFrameId, (KeyFrameId, Similarity)>,
    keyframes_ever: u64,
}

impl Map {
    /// Returns the keyframe, if it is still in the map.
    pub fn keyframe(&self, id: KeyFrameId) -> Option<&KeyFrame> {
        self.keyframes.get(id)
    }

    /// Returns the landmark, if it is still in the map.
    pub fn landmark(&self, id: LandmarkId) -> Option<&Landmark> {
        self.landmarks.get(id)
    }

    /// Iterates over all keyframes, in the order of their slots.
    pub fn keyframes(&self) -> impl Iterator<Item = (KeyFrameId, &KeyFrame)> {
        self.keyframes.iter()
    }

    /// Iterates over all landmarks, in the order of their slots.
    pub fn landmarks(&self) -> impl Iterator<Item = (LandmarkId, &Landmark)> {
        self.landmarks.iter()
    }

    /// Returns the number of keyframes.
    pub fn keyframe_count(&self) -> usize {
        self.keyframes.len()
    }

    /// Returns the number of landmarks.
    pub(crate) fn landmark_count(&self) -> usize {
        self.landmarks.len()
    }

    /// Returns the number of keyframes ever inserted, which is the sequence number of the next one.
    pub(crate) fn keyframes_ever(&self) -> u64 {
        self.keyframes_ever
    }

    /// Returns the current `t_cam_world` of a keyframe; that of a removed one follows its nearest ancestor in the map.
    pub(crate) fn keyframe_pose(&self, id: KeyFrameId) -> Option<Pose> {
        self.own_pose(id).map(|own| rigid(&own))
    }

    /// Returns the current `s_cam_world` of a keyframe, removed or not, into its unit of length at the time of its insertion.
    fn own_pose(&self, id: KeyFrameId) -> Option<Similarity> {
        let (keyframe, s_keyframe_ancestor) = self.surviving_ancestor(id)?;
        Some(s_keyframe_ancestor * with_scale(&keyframe.t_cam_world, 1.0 / keyframe.unit))
    }

    /// Returns the keyframe or, if it was removed, its nearest ancestor in the map, with the similarity from there, `s_keyframe_ancestor`.
    pub(crate) fn surviving_ancestor(&self, id: KeyFrameId) -> Option<(&KeyFrame, Similarity)> {
        let (mut id, mut s_keyframe_id) = (id, Similarity::identity());
        loop {
            if let Some(keyframe) = self.keyframes.get(id) {
                return Some((keyframe, s_keyframe_id));
            }
            let (parent, s_id_parent) = self.removed.get(&id)?;
            s_keyframe_id *= *s_id_parent;
            id = *parent;
        }
    }

    /// Returns the pose of a frame relative to a keyframe, `t_cam_reference`, in the unit of length at the keyframe's insertion, so that
    /// [`Map::absolute_pose`] follows every correction of the map and of its scale.
    pub(crate) fn relative_pose(&self, reference: KeyFrameId, t_cam_world: &Pose) -> Option<Pose> {
        let own = self.own_pose(reference)?;
        Some((with_scale(t_cam_world, own.scaling()) * own.inverse()).isometry)
    }

    /// Returns the current `t_cam_world` of a frame with this pose relative to a keyframe.
    pub(crate) fn absolute_pose(&self, reference: KeyFrameId, t_cam_reference: &Pose) -> Option<Pose> {
        Some(rigid(&(unscaled(t_cam_reference) * self.own_pose(reference)?)))
    }

    /// Returns whether any keyframe has a measured depth; without, the unit of length is arbitrary.
    pub(crate) fn has_depths(&self) -> bool {
        self.keyframes.values().any(|k| k.features.features.iter().any(|f| f.depth_m.is_some()))
    }

    /// Returns the median depth of the landmarks that a keyframe observes; 0 if there are none.
    pub(crate) fn median_depth(&self, keyframe: &KeyFrame) -> f64 {
        let landmarks = keyframe.observed().filter_map(|(_, id)| self.landmarks.get(id));
        let mut depths: Vec<f64> = landmarks.map(|l| (keyframe.t_cam_world * l.position).z).collect();
        let middle = depths.len() / 2;
        if depths.is_empty() { 0.0 } else { *depths.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }

    /// Returns the weight of the observations of a landmark: 2 for each with depth, 1 for each without. Source: ORB-SLAM2.
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
