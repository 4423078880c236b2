//! A frame that stays in the map.

use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::map::LandmarkId;

slotmap::new_key_type! {
    /// Names a keyframe; never reused for another one.
    pub struct KeyFrameId;
}

/// A frame that stays in the map, with the landmarks it sees.
#[derive(Clone, Debug)]
pub struct KeyFrame {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// Position among all keyframes ever inserted, from 0.
    pub sequence: u64,
    /// Maps world points into this camera.
    pub t_cam_world: Pose,
    /// The unit of length that it was mapped in, in that of the map now: 1, unless a loop has changed the scale of a map without depth.
    pub unit: f64,
    /// What was seen.
    pub features: FrameFeatures,
    /// The landmark seen by each feature.
    pub landmarks: Vec<Option<LandmarkId>>,
    /// Keyframes that share landmarks with this one, with the number shared: most first.
    pub covisible: Vec<(KeyFrameId, usize)>,
    /// Parent in the spanning tree; `None` for the first keyframe.
    pub parent: Option<KeyFrameId>,
    /// Children in the spanning tree, oldest first.
    pub children: Vec<KeyFrameId>,
    /// Keyframes with which it closed a loop.
    pub loop_edges: Vec<KeyFrameId>,
}

impl KeyFrame {
    /// The features that see a landmark.
    pub(crate) fn observed(&self) -> impl Iterator<Item = (usize, LandmarkId)> {
        self.landmarks.iter().enumerate().filter_map(|(i, l)| Some((i, (*l)?)))
    }
}
