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
    /// Mean colour at its features, red, green, blue.
    pub color: [u8; 3],
}

impl Landmark {
    /// Of the frames that should have seen it, the share that did.
    pub fn found_ratio(&self) -> f64 {
        f64::from(self.found) / f64::from(self.visible.max(1))
    }

    /// Feature index in a keyframe, if it sees the landmark.
    pub fn feature_in(&self, keyframe: KeyFrameId) -> Option<usize> {
        self.observations.iter().find(|(k, _)| *k == keyframe).map(|(_, f)| *f as usize)
    }
}
