//! Restoring a saved map. Unlike [`super::ops`], these operations set values that are otherwise counted.
//!
//! In: values of the records. Out: changes of the map.

use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::map::{KeyFrameId, LandmarkId, Map};

impl Map {
    /// Inserts a keyframe with its sequence number; see [`Map::insert_keyframe`].
    pub(super) fn restore_keyframe(
        &mut self,
        timestamp_ns: i64,
        sequence: u64,
        t_cam_world: Pose,
        features: FrameFeatures,
    ) -> KeyFrameId {
        let id = self.insert_keyframe(timestamp_ns, t_cam_world, features);
        self.keyframes[id].sequence = sequence;
        id
    }

    /// Sets the number of keyframes ever inserted, which must exceed every sequence number.
    pub(super) fn restore_count(&mut self, keyframes_ever: u64) -> Result<(), String> {
        let mut sequences: Vec<u64> = self.keyframes.values().map(|k| k.sequence).collect();
        sequences.sort_unstable();
        if sequences.windows(2).any(|pair| pair[0] == pair[1]) || sequences.last().is_some_and(|s| *s >= keyframes_ever)
        {
            return Err(format!(
                "{} keyframes do not have different sequence numbers below {keyframes_ever}",
                sequences.len()
            ));
        }
        self.keyframes_ever = keyframes_ever;
        Ok(())
    }

    /// Sets the parent of a keyframe in the spanning tree, which must not be one of its descendants.
    pub(super) fn restore_parent(&mut self, child: KeyFrameId, parent: KeyFrameId) -> Result<(), String> {
        if self.root(parent) == Some(child) || self.keyframes[child].parent.is_some() {
            return Err(format!("keyframe {} is its own ancestor", self.keyframes[child].sequence));
        }
        self.keyframes[child].parent = Some(parent);
        self.keyframes[parent].children.push(child);
        Ok(())
    }

    /// Sets the counters of a landmark.
    pub(super) fn restore_history(&mut self, id: LandmarkId, born: u64, visible: u32, found: u32) {
        if let Some(l) = self.landmarks.get_mut(id) {
            (l.born, l.visible, l.found) = (born, visible, found);
        }
    }
}
