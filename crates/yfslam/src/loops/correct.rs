//! Correction of the map by a loop (ORB-SLAM, IEEE T-RO 2015, section VII): the keyframes around the new keyframe move to the pose
//! that verification found, duplicate landmarks are fused, and the error is distributed over the pose graph. If the candidate
//! belongs to another submap there is no drift to distribute: the whole submap moves, and the two are merged.
//!
//! In: a keyframe localised among the landmarks of a candidate. Out: the corrected map, for global bundle adjustment.

use slotmap::SecondaryMap;

use super::place_recognition::Candidate;
use crate::context::Context;
use crate::geometry::{Pose, Similarity, rigid, unscaled};
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::mapping::fuse;
use crate::optimize::pose_graph::{Edge, PoseGraph};
use crate::tracking::TrackedFrame;

/// The state of a loop correction: the near side is the new keyframe with its neighbours, the far side the candidate's group.
struct LoopCorrection {
    /// The new keyframe and its covisible keyframes.
    near: Vec<KeyFrameId>,
    /// Poses before the correction, `t_cam_world`.
    before: SecondaryMap<KeyFrameId, Pose>,
    /// Corrected poses of the near side, `s_cam_world`, into the unit of the near side.
    corrected: SecondaryMap<KeyFrameId, Similarity>,
    /// Landmarks that were moved with a keyframe of the near side.
    moved_landmarks: SecondaryMap<LandmarkId, KeyFrameId>,
    /// Pairs of a near and a far keyframe that became covisible.
    links: Vec<(KeyFrameId, KeyFrameId)>,
}

/// Closes the loop between `keyframe` and `candidate`; `localised` is the keyframe as a frame localised there, and
/// `s_cam_candidate` maps the candidate's world into its camera and unit.
pub(super) fn close(
    context: &Context,
    map: &mut Map,
    keyframe: KeyFrameId,
    candidate: &Candidate,
    localised: &TrackedFrame,
    s_cam_candidate: &Similarity,
) {
    let Some(k) = map.keyframe(keyframe) else { return };
    let s_far_near = s_cam_candidate.inverse() * k.t_cam_world;
    let is_one_submap = map.root(keyframe) == map.root(candidate.keyframe);
    if !is_one_submap {
        map.merge_submaps(keyframe, candidate.keyframe, &s_far_near);
    }
    // After the merge both have the same unit.
    let s_cam_world = if is_one_submap { *s_cam_candidate } else { unscaled(&rigid(s_cam_candidate)) };
    let Some(mut correction) = LoopCorrection::new(map, keyframe, &s_cam_world) else { return };
    correction.correct_near_side(map);
    correction.fuse_landmarks(context, map, keyframe, candidate, localised);
    map.add_loop_edge(keyframe, candidate.keyframe);
    if is_one_submap {
        correction.optimize_pose_graph(context, map, keyframe);
    }
}

impl LoopCorrection {
    fn new(map: &Map, keyframe: KeyFrameId, s_cam_world: &Similarity) -> Option<Self> {
        let k = map.keyframe(keyframe)?;
        let near: Vec<KeyFrameId> = std::iter::once(keyframe).chain(k.covisible.iter().map(|(id, _)| *id)).collect();
        let motion = k.t_cam_world.inverse() * s_cam_world;
        let before: SecondaryMap<KeyFrameId, Pose> = map.keyframes().map(|(id, k)| (id, k.t_cam_world)).collect();
        let corrected = near.iter().filter_map(|id| Some((*id, *before.get(*id)? * motion))).collect();
        Some(Self { near, before, corrected, moved_landmarks: SecondaryMap::new(), links: Vec::new() })
    }

    /// Moves the keyframes of the near side by the same correction, with all landmarks that they observe.
    fn correct_near_side(&mut self, map: &mut Map) {
        for &id in &self.near {
            let (Some(&old), Some(&new)) = (self.before.get(id), self.corrected.get(id)) else { continue };
            let Some(keyframe) = map.keyframe(id) else { continue };
            let observed: Vec<LandmarkId> = keyframe.observed().map(|(_, l)| l).collect();
            for landmark in observed {
                let Some(position) = map.landmark(landmark).map(|l| l.position) else { continue };
                if self.moved_landmarks.insert(landmark, id).is_none() {
                    map.set_position(landmark, new.inverse() * (old * position));
                }
            }
            map.set_pose(id, rigid(&new));
        }
    }

    /// Fuses the landmarks that both sides observe, and stores which keyframes became covisible.
    fn fuse_landmarks(
        &mut self,
        context: &Context,
        map: &mut Map,
        keyframe: KeyFrameId,
        candidate: &Candidate,
        localised: &TrackedFrame,
    ) {
        for (feature, matched) in localised.matches.iter().enumerate() {
            let Some(far) = matched.and_then(|s| s.landmark) else { continue };
            match map.keyframe(keyframe).and_then(|k| k.landmarks.get(feature).copied()) {
                Some(Some(near)) => map.merge_landmarks(far, near),
                Some(None) => map.add_observation(far, keyframe, feature),
                None => {}
            }
        }
        let far_side: Vec<KeyFrameId> = candidate.group.iter().filter(|id| !self.near.contains(id)).copied().collect();
        let far = map.landmarks_of(&far_side);
        for &target in &self.near {
            fuse::fuse_into(context, map, target, &far);
        }
        for &id in &self.near {
            let neighbours = |map: &Map| -> Vec<KeyFrameId> {
                map.keyframe(id).map(|k| k.covisible.iter().map(|(id, _)| *id).collect()).unwrap_or_default()
            };
            let old = neighbours(map);
            map.update_covisibility(id);
            let new = neighbours(map).into_iter().filter(|other| !old.contains(other) && !self.near.contains(other));
            self.links.extend(new.map(|other| (id, other)));
        }
        self.links.push((keyframe, candidate.keyframe));
        self.links.sort_unstable();
        self.links.dedup();
    }

    /// Distributes the error by pose-graph optimisation of the essential graph: spanning tree, loop edges, strong covisibility.
    fn optimize_pose_graph(&self, context: &Context, map: &mut Map, keyframe: KeyFrameId) {
        let Context { sensor, config } = context;
        let Some(root) = map.root(keyframe) else { return };
        let members = map.submap(root);
        // The root, which defines the world, is fixed.
        let mut order: Vec<(bool, u64, KeyFrameId)> =
            members.iter().filter_map(|id| Some((*id != root, map.keyframe(*id)?.sequence, *id))).collect();
        order.sort_unstable();
        let order: Vec<KeyFrameId> = order.into_iter().map(|(.., id)| id).collect();
        let index: SecondaryMap<KeyFrameId, usize> = order.iter().enumerate().map(|(i, id)| (*id, i)).collect();
        let before = |id: KeyFrameId| self.before.get(id).map(unscaled);
        let base = |id: KeyFrameId| self.corrected.get(id).copied().or_else(|| before(id));
        let is_link = |a, b| self.links.binary_search(&(a, b)).is_ok() || self.links.binary_search(&(b, a)).is_ok();
        let mut graph = PoseGraph::default();
        for &a in &order {
            let (Some(keyframe), Some(pose)) = (map.keyframe(a), base(a)) else { continue };
            graph.poses.push(pose);
            let strong = keyframe.covisible.iter().filter(|(_, weight)| *weight >= config.loops.strong_weight);
            let mut others: Vec<KeyFrameId> = strong.map(|(id, _)| *id).collect();
            others.extend(keyframe.parent.iter().chain(&keyframe.loop_edges));
            others.sort_unstable();
            others.dedup();
            for b in others {
                // Each pair is added once, from its later member. Links are the new measurements; all other edges keep their
                // relative pose.
                let (Some(&i), Some(&j)) = (index.get(a), index.get(b)) else { continue };
                let pose_of = |id| if is_link(a, b) { base(id) } else { before(id) };
                if let (true, Some(s_a), Some(s_b)) = (i > j || keyframe.parent == Some(b), pose_of(a), pose_of(b)) {
                    graph.edges.push(Edge { a: i, b: j, s_a_b: s_a * s_b.inverse() });
                }
            }
        }
        graph.solve(&config.pose_graph, !sensor.measures_depth);
        let landmarks = map.landmarks_of(&members);
        for &id in &landmarks {
            let Some(landmark) = map.landmark(id) else { continue };
            let anchor = self.moved_landmarks.get(id).copied().unwrap_or(landmark.reference);
            let (Some(base), Some(&i)) = (base(anchor), index.get(anchor)) else { continue };
            let position = graph.poses[i].inverse() * (base * landmark.position);
            map.set_position(id, position);
        }
        for (id, pose) in order.iter().zip(&graph.poses) {
            map.set_scaled_pose(*id, pose);
        }
        // Only the near side got or lost observations.
        let near = map.landmarks_of(&self.near);
        for id in landmarks {
            match near.binary_search(&id) {
                Ok(_) => map.update_landmark(id, &sensor.scale_factors),
                Err(_) => map.update_view_range(id, &sensor.scale_factors),
            }
        }
    }
}
