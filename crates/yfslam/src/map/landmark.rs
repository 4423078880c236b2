//! A point of the static world.

use nalgebra::{Point3, Vector3};

use crate::features::Descriptor;
use crate::map::KeyFrameId;

slotmap::new_key_type! {
    /// Names a landmark; never reused for another one.
    pub struct LandmarkId;
}

/// A point of the static world, seen by keyframes.
#[derive(Clone, Debug)]
pub struct Landmark {
    /// Position in the world, m.
    pub position: Point3<f64>,
    /// The descriptor with the least median distance to those of all observations.
    pub descriptor: Descriptor,
    /// Mean direction from the observing cameras to the point, unit length.
    pub normal: Vector3<f64>,
    /// Farthest distance at which it should be found at the finest level, m.
    pub max_distance_m: f64,
    /// Nearest distance at which it should be found at the coarsest level, m.
    pub min_distance_m: f64,
    /// Keyframes that see it, with the index of the feature.
    pub observations: Vec<(KeyFrameId, u32)>,
    /// The keyframe that made it.
    pub reference: KeyFrameId,
    /// Sequence number of the keyframe that made it.
    pub born: u64,
    /// Frames in whose view it should have been.
    pub visible: u32,
    /// Frames in which it was found and fitted the pose.
    pub found: u32,
    /// Log-odds that it still stands where it was: up with each frame that found it, down with each that saw through it.
    pub existence_log_odds: f32,
    /// Mean colour at its features, red, green, blue.
    pub color: [u8; 3],
}

impl Landmark {
    /// Log-odds of a landmark that nothing speaks against, and the most that is kept: those of OctoMap's greatest probability, 0.97
    /// (Hornung et al., Autonomous Robots 2013).
    pub(crate) const MAX_EXISTENCE_LOG_ODDS: f32 = 3.48;
    /// What a frame that found it adds: OctoMap's hit, 0.7.
    pub(crate) const MATCHED_LOG_ODDS: f32 = 0.85;
    /// What a frame that saw through it adds: OctoMap's miss, 0.4.
    pub(crate) const FREE_SPACE_LOG_ODDS: f32 = -0.41;
    /// Below, it is gone: OctoMap's least probability, 0.12.
    pub(crate) const MIN_EXISTENCE_LOG_ODDS: f32 = -1.99;

    /// Probability that it still stands where it was, as a share of that of a landmark that nothing speaks against.
    pub(crate) fn trust(&self) -> f32 {
        (1.0 + (-Self::MAX_EXISTENCE_LOG_ODDS).exp()) / (1.0 + (-self.existence_log_odds).exp())
    }

    /// Of the frames that should have seen it, the share that did.
    pub(crate) fn found_ratio(&self) -> f64 {
        f64::from(self.found) / f64::from(self.visible.max(1))
    }

    /// Feature index in a keyframe, if it sees the landmark.
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
    fn a_landmark_that_is_seen_through_loses_trust_and_goes_unless_it_is_found_again() {
        let (scene, mut map) = (Scene::new(), Map::default());
        let first = scene.add(&mut map, 0, &scene.pose(0), &[]);
        let ids: Vec<LandmarkId> = map.keyframe(first).unwrap().observed().map(|(_, id)| id).take(2).collect();
        for frame in 0..20 {
            ids.iter().for_each(|id| map.count_free_space(*id));
            if frame % 2 == 1 {
                map.count_found(ids[1]);
            }
            if frame == 5 {
                let [gone, found] = [0, 1].map(|i| map.landmark(ids[i]).unwrap().trust());
                assert!(gone < 0.8 && found > 0.98, "{gone} {found}");
            }
        }
        assert!(map.landmark(ids[0]).is_none() && map.landmark(ids[1]).is_some());
        map.validate().unwrap();
    }
}
