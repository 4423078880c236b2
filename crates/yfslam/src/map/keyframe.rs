//! Keyframes: frames that stay in the map.

use std::sync::Arc;

use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::map::LandmarkId;

slotmap::new_key_type! {
    /// Identifier of a keyframe; never used again for another one.
    pub struct KeyFrameId;
}

/// A keyframe: a frame that stays in the map, with its observations and its neighbours in the covisibility graph.
#[derive(Clone, Debug)]
pub struct KeyFrame {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// Sequence number among all keyframes that were ever inserted, from 0.
    pub sequence: u64,
    /// Pose: transforms points from the world into the camera.
    pub t_cam_world: Pose,
    /// Unit of length at the time of its insertion, in the present unit of the map: 1, unless a loop changed the scale of a map without depth.
    pub unit: f64,
    /// Features; copies of the map share them.
    pub features: Arc<FrameFeatures>,
    /// Landmark observed by each feature.
    pub landmarks: Vec<Option<LandmarkId>>,
    /// Covisible keyframes with the number of shared landmarks, in descending order.
    pub covisible: Vec<(KeyFrameId, usize)>,
    /// Parent in the spanning tree; `None` for the root of a submap.
    pub parent: Option<KeyFrameId>,
    /// Children in the spanning tree, oldest first.
    pub children: Vec<KeyFrameId>,
    /// Loop edges: keyframes between which and this one a loop was closed.
    pub loop_edges: Vec<KeyFrameId>,
}

impl KeyFrame {
    /// Iterates over the observations: feature index and landmark.
    pub(crate) fn observed(&self) -> impl Iterator<Item = (usize, LandmarkId)> {
        self.landmarks.iter().enumerate().filter_map(|(i, l)| Some((i, (*l)?)))
    }
}
