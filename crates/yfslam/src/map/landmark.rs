//! Landmarks: points of the map that keyframes observe.

use nalgebra::{Point3, Vector3};

use crate::features::Descriptor;
use crate::map::KeyFrameId;

slotmap::new_key_type! {
    /// Identifier of a landmark; never used again for another one.
    pub struct LandmarkId;
}

/// A landmark: a point of the static world that keyframes observe.
#[derive(Clone, Debug)]
pub struct Landmark {
    /// Position in the world, m.
    pub position: Point3<f64>,
    /// Descriptor with the least median distance to the descriptors of all observations.
    pub descriptor: Descriptor,
    /// Mean direction from the observing cameras to the point, unit length.
    pub normal: Vector3<f64>,
    /// Largest distance at which the ORB extractor can detect it, m: there it appears on the finest level.
    pub max_distance_m: f64,
    /// Least distance at which the ORB extractor can detect it, m: there it appears on the coarsest level.
    pub min_distance_m: f64,
    /// Keyframes that observe it, with the feature index.
    pub observations: Vec<(KeyFrameId, u32)>,
    /// Keyframe that created it, or the oldest observing one if that was removed.
    pub reference: KeyFrameId,
    /// Sequence number of the keyframe that created it.
    pub born: u64,
    /// Number of frames in which it was expected to be visible.
    pub visible: u32,
    /// Number of frames in which it was matched as an inlier.
    pub found: u32,
    /// Existence log-odds: increased by each frame that matches it, decreased by each frame that measures free space at its position.
    pub existence_log_odds: f32,
    /// Colour at the feature from which it was created: red, green, blue.
    pub color: [u8; 3],
}

impl Landmark {
    /// Initial and largest existence log-odds: those of the largest probability in OctoMap, 0.97 (Hornung et al., Autonomous Robots 2013).
    pub(crate) const MAX_EXISTENCE_LOG_ODDS: f32 = 3.48;
    /// Change by a frame that matches the landmark: OctoMap's hit, 0.7.
    pub(crate) const MATCHED_LOG_ODDS: f32 = 0.85;
    /// Change by a frame that measures free space at the landmark: OctoMap's miss, 0.4.
    pub(crate) const FREE_SPACE_LOG_ODDS: f32 = -0.41;
    /// Existence log-odds below which a landmark is removed: OctoMap's least probability, 0.12.
    pub(crate) const MIN_EXISTENCE_LOG_ODDS: f32 = -1.99;

    /// Returns the probability that the landmark still exists, divided by the largest such probability, in [0, 1].
    pub(crate) fn trust(&self) -> f32 {
        (1.0 + libm::expf(-Self::MAX_EXISTENCE_LOG_ODDS)) / (1.0 + libm::expf(-self.existence_log_odds))
    }

    /// Returns the share of matched frames among the frames in which the landmark was expected to be visible.
    pub(crate) fn found_ratio(&self) -> f64 {
        f64::from(self.found) / f64::from(self.visible.max(1))
    }

    /// Returns the index of the feature with which a keyframe observes the landmark.
    pub(crate) fn feature_in(&self, keyframe: KeyFrameId) -> Option<usize> {
        self.observations.iter().find(|(k, _)| *k == keyframe).map(|(_, f)| *f as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::Map;
    use crate::map::scene::Scene;

    #[test]
    fn a_landmark_in_free_space_loses_trust_and_is_removed_unless_it_is_matched() {
        let (scene, mut map) = (Scene::new(), Map::default());
        let first = scene.add(&mut map, 0, &scene.pose(0), &[]);
        let ids: Vec<LandmarkId> = map.keyframe(first).unwrap().observed().map(|(_, id)| id).take(2).collect();
        for frame in 0..20 {
            ids.iter().for_each(|id| map.count_free_space(*id));
            if frame % 2 == 1 {
                map.count_found(ids[1]);
            }
            if frame == 5 {
                let [missed, matched] = [0, 1].map(|i| map.landmark(ids[i]).unwrap().trust());
                assert!(missed < 0.8 && matched > 0.98, "{missed} {matched}");
            }
        }
        assert!(map.landmark(ids[0]).is_none() && map.landmark(ids[1]).is_some());
        map.validate().unwrap();
    }
}
