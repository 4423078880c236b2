//! What a loop changes in the map (ORB-SLAM, IEEE T-RO 2015, section VII): the near side moves to where the far side says it is,
//! duplicates are joined, and the error is spread over the way between them. Where the old place is of another submap there is no
//! such way: the whole submap moves, and the two become one.
//!
//! In: a keyframe located among the landmarks of an old place. Out: a corrected map, to be adjusted.

use slotmap::SecondaryMap;

use super::place_recognition::Candidate;
use crate::context::Context;
use crate::geometry::{Pose, Similarity, rigid, unscaled};
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::mapping::fuse;
use crate::optimize::pose_graph::{Edge, PoseGraph};
use crate::tracking::TrackedFrame;

/// The two sides of a loop, and all poses as they were.
struct Loop {
    /// The keyframe that came back, and its covisible ones.
    near: Vec<KeyFrameId>,
    /// Poses before the correction, `t_cam_world`.
    before: SecondaryMap<KeyFrameId, Pose>,
    /// Poses of the near side as the far side has them, `s_cam_world`, into the unit that the near side has.
    moved: SecondaryMap<KeyFrameId, Similarity>,
    /// Landmarks that moved with a keyframe of the near side.
    carried: SecondaryMap<LandmarkId, KeyFrameId>,
    /// Pairs of a near and a far keyframe that came to share landmarks.
    links: Vec<(KeyFrameId, KeyFrameId)>,
}

/// Closes the loop between `keyframe` and the place of `candidate`, in which it was located as `located`: there, `s_cam_place` maps the
/// place's world into its camera and unit.
pub(super) fn close(
    context: &Context,
    map: &mut Map,
    keyframe: KeyFrameId,
    candidate: &Candidate,
    located: &TrackedFrame,
    s_cam_place: &Similarity,
) {
    let Context { sensor: _, config: _ } = context;
    let Some(k) = map.keyframe(keyframe) else { return };
    let s_far_near = s_cam_place.inverse() * k.t_cam_world;
    let is_one_map = map.root(keyframe) == map.root(candidate.keyframe);
    if !is_one_map {
        map.merge_submaps(keyframe, candidate.keyframe, &s_far_near);
    }
    // Once welded, both have the same unit.
    let s_cam_world = if is_one_map { *s_cam_place } else { unscaled(&rigid(s_cam_place)) };
    let Some(mut ends) = Loop::new(map, keyframe, &s_cam_world) else { return };
    ends.move_near_side(map);
    ends.join(context, map, keyframe, candidate, located);
    map.add_loop_edge(keyframe, candidate.keyframe);
    if is_one_map {
        ends.spread(context, map, keyframe);
    }
}

impl Loop {
    fn new(map: &Map, keyframe: KeyFrameId, s_cam_world: &Similarity) -> Option<Self> {
        let k = map.keyframe(keyframe)?;
        let near: Vec<KeyFrameId> = std::iter::once(keyframe).chain(k.covisible.iter().map(|(id, _)| *id)).collect();
        let correction = k.t_cam_world.inverse() * s_cam_world;
        let before: SecondaryMap<KeyFrameId, Pose> = map.keyframes().map(|(id, k)| (id, k.t_cam_world)).collect();
        let moved = near.iter().filter_map(|id| Some((*id, *before.get(*id)? * correction))).collect();
        Some(Self { near, before, moved, carried: SecondaryMap::new(), links: Vec::new() })
    }

    /// Moves the keyframes of the near side, all in the same way, with all landmarks they see.
    fn move_near_side(&mut self, map: &mut Map) {
        for &id in &self.near {
            let (Some(&old), Some(&new)) = (self.before.get(id), self.moved.get(id)) else { continue };
            let Some(keyframe) = map.keyframe(id) else { continue };
            let seen: Vec<LandmarkId> = keyframe.observed().map(|(_, l)| l).collect();
            for landmark in seen {
                let Some(position) = map.landmark(landmark).map(|l| l.position) else { continue };
                if self.carried.insert(landmark, id).is_none() {
                    map.set_position(landmark, new.inverse() * (old * position));
                }
            }
            map.set_pose(id, rigid(&new));
        }
    }

    /// Joins what both sides see, and notes which keyframes that connects.
    fn join(
        &mut self,
        context: &Context,
        map: &mut Map,
        keyframe: KeyFrameId,
        candidate: &Candidate,
        located: &TrackedFrame,
    ) {
        let Context { sensor: _, config: _ } = context;
        for (feature, matched) in located.matches.iter().enumerate() {
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

    /// Spreads the error over the essential graph: the spanning tree, all loops, and strong covisibility.
    fn spread(&self, context: &Context, map: &mut Map, keyframe: KeyFrameId) {
        let Context { sensor, config } = context;
        let Some(root) = map.root(keyframe) else { return };
        let members = map.submap(root);
        // In the order of time the equations are nearly a band. The root, which defines the world, stays.
        let mut order: Vec<(bool, u64, KeyFrameId)> =
            members.iter().filter_map(|id| Some((*id != root, map.keyframe(*id)?.sequence, *id))).collect();
        order.sort_unstable();
        let order: Vec<KeyFrameId> = order.into_iter().map(|(.., id)| id).collect();
        let index: SecondaryMap<KeyFrameId, usize> = order.iter().enumerate().map(|(i, id)| (*id, i)).collect();
        let before = |id: KeyFrameId| self.before.get(id).map(unscaled);
        let base = |id: KeyFrameId| self.moved.get(id).copied().or_else(|| before(id));
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
                // Each pair once, from its later member; links are the new measurements, the rest keeps its shape.
                let (Some(&i), Some(&j)) = (index.get(a), index.get(b)) else { continue };
                let pose_of = |id| if is_link(a, b) { base(id) } else { before(id) };
                if let (true, Some(s_a), Some(s_b)) = (i > j || keyframe.parent == Some(b), pose_of(a), pose_of(b)) {
                    graph.edges.push(Edge { a: i, b: j, s_a_b: s_a * s_b.inverse() });
                }
            }
        }
        graph.solve(&config.pose_graph, !sensor.measures_depth);
        for id in map.landmarks_of(&members) {
            let Some(landmark) = map.landmark(id) else { continue };
            let anchor = self.carried.get(id).copied().unwrap_or(landmark.reference);
            let (Some(base), Some(&i)) = (base(anchor), index.get(anchor)) else { continue };
            let position = graph.poses[i].inverse() * (base * landmark.position);
            map.set_position(id, position);
            map.update_landmark(id, &sensor.scale_factors);
        }
        for (id, pose) in order.iter().zip(&graph.poses) {
            map.set_scaled_pose(*id, pose);
        }
    }
}
