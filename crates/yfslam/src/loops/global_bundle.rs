//! Global bundle adjustment of a submap after a loop (ORB-SLAM2, IEEE T-RO 2017, section III-C), on a copy, so that mapping can
//! continue meanwhile. Of a large submap only the part around the loop is adjusted, which bounds time and memory.
//!
//! In: the map when the loop was closed; later, the map as it has become. Out: that map, adjusted. Keyframes and landmarks that
//! were added meanwhile move with their parent or reference keyframe.

use slotmap::SecondaryMap;

use crate::config::BundleConfig;
use crate::context::SensorModel;
use crate::geometry::Pose;
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::mapping::Window;

/// Most keyframes that are adjusted. Source: chosen: about a second of one core.
const MAX_KEYFRAMES: usize = 1200;

/// A copy of the part of a submap that is adjusted.
#[derive(Clone, Debug)]
pub(crate) struct GlobalBundle {
    /// Its landmarks are in the order of their ids.
    window: Window,
    /// Sequence number of the next keyframe when the copy was made.
    next_sequence: u64,
}

impl GlobalBundle {
    /// Copies the submap of `keyframe`, or the part around it. `None` if the map does not have it.
    pub(crate) fn copy(sensor: &SensorModel, map: &Map, keyframe: KeyFrameId) -> Option<Self> {
        let root = map.root(keyframe)?;
        let mut keyframes = around(map, keyframe);
        // The root defines the world frame and is never adjusted.
        keyframes.retain(|id| *id != root);
        let free_poses = keyframes.len();
        let mut landmarks = map.landmarks_of(&keyframes);
        // A landmark with one observation says nothing about the poses; it moves with its keyframe.
        landmarks.retain(|id| map.landmark(*id).is_some_and(|l| l.observations.len() > 1));
        // What observes these landmarks from outside holds them in place.
        let mut is_copied: SecondaryMap<KeyFrameId, ()> = keyframes.iter().map(|id| (*id, ())).collect();
        for (k, _) in landmarks.iter().filter_map(|id| map.landmark(*id)).flat_map(|l| &l.observations) {
            if is_copied.insert(*k, ()).is_none() {
                keyframes.push(*k);
            }
        }
        let window = Window::assemble(sensor, map, keyframes, free_poses, landmarks);
        Some(Self { window, next_sequence: map.keyframes_ever() })
    }

    /// Adjusts the copy for as long as `should_continue` returns true.
    pub(crate) fn adjust(&mut self, config: &BundleConfig, should_continue: &dyn Fn() -> bool) {
        self.window.adjust(config, should_continue);
    }

    /// Merges the adjusted poses and points into the map. Items that the map no longer contains are skipped.
    pub(crate) fn merge(self, sensor: &SensorModel, map: &mut Map) {
        let Self { window, next_sequence } = self;
        let poses = window.adjusted_keyframes().iter().filter_map(|id| Some((*id, map.keyframe(*id)?.t_cam_world)));
        let mut before: SecondaryMap<KeyFrameId, Pose> = poses.collect();
        window.merge_poses(map);
        move_later_keyframes(map, &mut before, next_sequence);
        window.merge_landmarks(sensor, map);
        let moved: Vec<KeyFrameId> = before.keys().collect();
        let is_new = |id: &LandmarkId| window.landmarks().binary_search(id).is_err();
        for id in map.landmarks_of(&moved).into_iter().filter(is_new) {
            let Some(landmark) = map.landmark(id) else { continue };
            if let Some(motion) = world_motion(map, &before, landmark.reference) {
                let position = motion * landmark.position;
                map.set_position(id, position);
            }
            map.update_view_range(id, &sensor.scale_factors);
        }
    }
}

/// Returns the motion from a moved keyframe's old world to its new one.
fn world_motion(map: &Map, before: &SecondaryMap<KeyFrameId, Pose>, id: KeyFrameId) -> Option<Pose> {
    Some(map.keyframe(id)?.t_cam_world.inverse() * before.get(id)?)
}

/// Moves the keyframes that were added since the copy was made, oldest first, with their parents.
fn move_later_keyframes(map: &mut Map, before: &mut SecondaryMap<KeyFrameId, Pose>, next_sequence: u64) {
    let mut later: Vec<(u64, KeyFrameId)> =
        map.keyframes().filter(|(_, k)| k.sequence >= next_sequence).map(|(id, k)| (k.sequence, id)).collect();
    later.sort_unstable();
    for (_, id) in later {
        let Some(k) = map.keyframe(id) else { continue };
        let old = k.t_cam_world;
        // A merge of submaps can have made a later keyframe the parent, which moves with an ancestor itself.
        let mut ancestors = std::iter::successors(k.parent, |id| map.keyframe(*id)?.parent);
        let is_settled =
            |id: &KeyFrameId| before.contains_key(*id) || map.keyframe(*id).is_some_and(|k| k.sequence < next_sequence);
        let motion = ancestors.find(is_settled).and_then(|ancestor| world_motion(map, before, ancestor));
        if let Some(motion) = motion {
            before.insert(id, old);
            map.set_pose(id, old * motion.inverse());
        }
    }
}

/// Returns the keyframes of the submap, or those that the fewest steps in the graph of the map separate from `keyframe`, in the order of time.
fn around(map: &Map, keyframe: KeyFrameId) -> Vec<KeyFrameId> {
    let mut found = vec![keyframe];
    let mut is_found: SecondaryMap<KeyFrameId, ()> = SecondaryMap::new();
    is_found.insert(keyframe, ());
    let mut at = 0;
    while let Some(k) = found.get(at).and_then(|id| map.keyframe(*id)) {
        at += 1;
        let edges = k.loop_edges.iter().chain(&k.parent).chain(&k.children);
        for &other in edges.chain(k.covisible.iter().map(|(id, _)| id)) {
            if found.len() <= MAX_KEYFRAMES && is_found.insert(other, ()).is_none() {
                found.push(other);
            }
        }
    }
    found.sort_by_key(|id| map.keyframe(*id).map(|k| k.sequence));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::se3_exp;
    use crate::map::scene::Scene;
    use nalgebra::Vector6;

    #[test]
    fn keyframes_added_meanwhile_keep_their_pose_relative_to_their_parent() {
        let (scene, mut map) = (Scene::new(), Map::default());
        let noise = |k: usize| se3_exp(&(Vector6::new(0.02, -0.01, 0.02, 0.004, 0.005, -0.003) * (k % 3) as f64));
        let mut ids = Vec::new();
        for k in 0..6 {
            ids.push(scene.add(&mut map, k, &(noise(k) * scene.pose(k)), &ids));
        }
        let mut bundle = GlobalBundle::copy(&scene.sensor, &map, ids[0]).unwrap();
        // Two keyframes are added while the copy is adjusted; one of the copied ones is removed.
        let late = scene.add(&mut map, 6, &(noise(2) * scene.pose(6)), &ids[5..]);
        let later = scene.add(&mut map, 9, &(noise(2) * scene.pose(9)), &[late]);
        assert!(map.remove_keyframe(ids[2]));
        let relative_to_parent = |map: &Map, id| {
            let k = map.keyframe(id).unwrap();
            let parent = map.keyframe(k.parent.unwrap()).unwrap();
            let own = k.observed().filter_map(|(_, l)| map.landmark(l)).filter(|l| l.reference == id);
            (k.t_cam_world * parent.t_cam_world.inverse(), own.map(|l| k.t_cam_world * l.position).collect::<Vec<_>>())
        };
        let before = [relative_to_parent(&map, late), relative_to_parent(&map, later)];
        assert!(before.iter().all(|(_, own)| own.len() > 2));
        let later_before = map.keyframe(later).unwrap().t_cam_world;
        bundle.adjust(&BundleConfig::default(), &|| true);
        bundle.merge(&scene.sensor, &mut map);
        for k in [1, 3, 4, 5] {
            let error = map.keyframe(ids[k]).unwrap().t_cam_world * scene.pose(k).inverse();
            assert!(error.translation.vector.norm() < 1e-3, "keyframe {k}: {error}");
        }
        for ((t, own), (t_before, own_before)) in
            [relative_to_parent(&map, late), relative_to_parent(&map, later)].iter().zip(&before)
        {
            assert!((t * t_before.inverse()).translation.vector.norm() < 1e-9);
            assert!(own.iter().zip(own_before).all(|(a, b)| (a - b).norm() < 1e-9));
        }
        assert!((map.keyframe(later).unwrap().t_cam_world.inverse() * later_before).translation.vector.norm() > 1e-3);
        assert_eq!(map.validate(), Ok(()));
    }

    #[test]
    fn a_cancelled_adjustment_takes_no_step() {
        let (scene, mut map) = (Scene::new(), Map::default());
        let ids = [scene.add(&mut map, 0, &scene.pose(0), &[])];
        let moved = scene.pose(2);
        let second = scene.add(&mut map, 1, &moved, &ids);
        let mut bundle = GlobalBundle::copy(&scene.sensor, &map, second).unwrap();
        bundle.adjust(&BundleConfig::default(), &|| false);
        bundle.merge(&scene.sensor, &mut map);
        assert_eq!(map.keyframe(second).unwrap().t_cam_world, moved);
    }
}
