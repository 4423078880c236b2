//! The map and the trajectory of one run as packets.
//!
//! In: the system, on the thread that tracks. Out: a copy of bounded size, then packets for the page.

use std::collections::BTreeMap;

use serde_json::json;
use yfslam::{KeyFrame, KeyFrameId, Pose, Slam};
use yfslam_eval::StampedPose;

use crate::align::Truth;
use crate::packet::{Numbered, PacketBuilder, seconds};

/// Most landmarks that are shown; of more, every n-th is.
const MAX_LANDMARKS: usize = 60_000;
/// Most keyframes whose neighbours are shown.
const MAX_KEYFRAMES: usize = 10_000;
/// Most poses of a trajectory that are shown; of more, every n-th is.
const MAX_POSES: usize = 20_000;
/// Landmarks that two keyframes must share for a line between them: that of the essential graph (ORB-SLAM, IEEE T-RO 2015).
const MIN_SHARED: usize = 100;

/// Kinds of lines between keyframes.
#[derive(Clone, Copy)]
enum Edge {
    Tree = 0,
    Covisible = 1,
    Loop = 2,
}

/// A copy of the map of one run. All is in the world of the newest keyframe: other submaps are left out until they are merged.
pub struct MapCopy {
    positions: Vec<f32>,
    colors: Vec<u8>,
    /// Stamp, ns, and pose of each keyframe, world from camera.
    keyframes: Vec<(i64, Pose)>,
    /// Indices of two keyframes, and the kind.
    edges: Vec<[u32; 3]>,
    trajectory: Vec<StampedPose>,
}

impl MapCopy {
    /// Copies the map.
    pub fn new(slam: &Slam) -> Self {
        let map = slam.map();
        let newest = map.keyframes().max_by_key(|(_, keyframe)| keyframe.sequence);
        let world = newest.and_then(|(id, _)| root(slam, id));
        let step = map.keyframe_count().div_ceil(MAX_KEYFRAMES).max(1);
        let mut shown: Vec<(KeyFrameId, &KeyFrame)> =
            map.keyframes().step_by(step).filter(|(id, _)| root(slam, *id) == world).collect();
        shown.sort_by_key(|(_, keyframe)| keyframe.sequence);
        let numbers: BTreeMap<KeyFrameId, u32> = shown.iter().map(|(id, _)| *id).zip(0..).collect();
        let mut edges = Vec::new();
        for ((_, keyframe), from) in shown.iter().zip(0..) {
            let strong = keyframe.covisible.iter().take_while(|(_, shared)| *shared >= MIN_SHARED).map(|(id, _)| id);
            let parent = keyframe.parent.iter().map(|id| (id, Edge::Tree));
            let lines = parent.chain(strong.map(|id| (id, Edge::Covisible)));
            for (id, kind) in lines.chain(keyframe.loop_edges.iter().map(|id| (id, Edge::Loop))) {
                // Each pair is mutual, but for parents.
                let to = numbers.get(id).copied().filter(|to| *to < from || matches!(kind, Edge::Tree));
                edges.extend(to.map(|to| [from, to, kind as u32]));
            }
        }
        let count = map.landmarks().size_hint().0;
        let every = count.div_ceil(MAX_LANDMARKS).max(1);
        let (mut positions, mut colors) =
            (Vec::with_capacity(3 * count / every), Vec::with_capacity(3 * count / every));
        // A landmark is observed from one submap only, that of its reference.
        let is_shown = |id: &KeyFrameId| step > 1 || numbers.contains_key(id);
        for (_, landmark) in map.landmarks().step_by(every).filter(|(_, landmark)| is_shown(&landmark.reference)) {
            positions.extend(landmark.position.coords.iter().map(|v| *v as f32));
            colors.extend(landmark.color);
        }
        let trajectories = slam.trajectories();
        let current = trajectories.into_iter().max_by_key(|poses| poses.last().map(|(stamp_ns, _)| *stamp_ns));
        let current = current.unwrap_or_default();
        let thin = current.len().div_ceil(MAX_POSES).max(1);
        let trajectory = current.into_iter().rev().step_by(thin).map(|(t, pose)| StampedPose::new(t, pose));
        let mut trajectory: Vec<StampedPose> = trajectory.collect();
        trajectory.reverse();
        let keyframes = shown.iter().map(|(_, k)| (k.timestamp_ns, k.t_cam_world.inverse())).collect();
        Self { positions, colors, keyframes, edges, trajectory }
    }

    /// Makes the packet of landmarks and keyframes.
    pub fn map_packet(&self, number: u64, start_ns: i64) -> Numbered {
        let poses = self.keyframes.iter().flat_map(|(_, pose)| {
            let (t, q) = (pose.translation.vector, pose.rotation.coords);
            [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(|v| v as f32)
        });
        let stamps: Vec<f64> = self.keyframes.iter().map(|(stamp_ns, _)| seconds(*stamp_ns, start_ns)).collect();
        let edges: Vec<u8> = self.edges.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let stamps: Vec<u8> = stamps.into_iter().flat_map(f64::to_le_bytes).collect();
        let packet = PacketBuilder::new("map", json!({ "number": number }));
        let packet = packet.floats("landmarks", self.positions.iter().copied()).part("colors", &self.colors);
        let packet = packet.floats("keyframes", poses).part("stamps", &stamps).part("edges", &edges);
        Numbered { number, packet: packet.build() }
    }

    /// Makes the packet of the trajectory, with its errors.
    pub fn path_packet(&self, number: u64, run: usize, start_ns: i64, truth: &Truth) -> Numbered {
        let aligned = truth.align(&self.trajectory);
        let head = json!({
            "number": number,
            "run": run,
            "rmse": aligned.rmse_m,
            "truth": aligned.t_world_truth.map(|t| t.as_slice().to_vec()),
        });
        let positions = self.trajectory.iter().flat_map(|pose| {
            let v = pose.t_world_cam.translation.vector;
            [v.x, v.y, v.z].map(|v| v as f32)
        });
        let stamps = self.trajectory.iter().map(|pose| seconds(pose.timestamp_ns, start_ns) as f32);
        let packet = PacketBuilder::new("path", head).floats("positions", positions).floats("stamps", stamps);
        Numbered { number, packet: packet.floats("errors", aligned.errors_m).build() }
    }
}

/// Returns the root of the tree to which a keyframe belongs; `None` if the chain of parents has a gap.
fn root(slam: &Slam, id: KeyFrameId) -> Option<KeyFrameId> {
    let map = slam.map();
    let (mut id, mut left) = (id, map.keyframe_count());
    while let Some(parent) = map.keyframe(id)?.parent {
        left = left.checked_sub(1)?;
        id = parent;
    }
    Some(id)
}
