//! Submaps: trees of keyframes without common landmarks, each with its own world frame, which its root defines (Atlas: Elvira, Tardós and
//! Montiel, IROS 2019).
//!
//! In: the similarity between two submaps that show the same place. Out: one submap.

use super::{KeyFrameId, LandmarkId, Map};
use crate::geometry::{Similarity, unscaled};

impl Map {
    /// Returns the root of the submap of a keyframe: the keyframe that defines its world frame.
    pub fn root(&self, keyframe: KeyFrameId) -> Option<KeyFrameId> {
        let mut id = keyframe;
        loop {
            match self.keyframes.get(id) {
                Some(k) => match k.parent {
                    Some(parent) => id = parent,
                    None => return Some(id),
                },
                // A removed keyframe belongs to the submap of its last parent.
                None => id = self.removed.get(&id)?.0,
            }
        }
    }

    /// Returns the keyframes of the submap with this root, in the order of their slots.
    pub(crate) fn submap(&self, root: KeyFrameId) -> Vec<KeyFrameId> {
        let mut members = vec![root];
        let mut at = 0;
        while let Some(k) = members.get(at).and_then(|id| self.keyframes.get(*id)) {
            members.extend(&k.children);
            at += 1;
        }
        members.sort_unstable();
        members
    }

    /// Counts the keyframes in the submap of `keyframe`, up to `at_most`.
    pub(crate) fn submap_size(&self, keyframe: KeyFrameId, at_most: usize) -> usize {
        self.root(keyframe).map_or(0, |root| self.tree_size(root, at_most))
    }

    fn tree_size(&self, top: KeyFrameId, at_most: usize) -> usize {
        let Some(k) = self.keyframes.get(top).filter(|_| at_most > 0) else { return 0 };
        k.children.iter().fold(1, |size, child| size + self.tree_size(*child, at_most - size))
    }

    /// Returns the number of submaps.
    #[cfg(test)]
    pub(crate) fn submap_count(&self) -> usize {
        self.keyframes.values().filter(|k| k.parent.is_none()).count()
    }

    /// Returns the landmarks that the keyframes observe, without duplicates.
    pub(crate) fn landmarks_of(&self, keyframes: &[KeyFrameId]) -> Vec<LandmarkId> {
        let observations = keyframes.iter().filter_map(|id| self.keyframes.get(*id)).flat_map(|k| k.observed());
        let mut landmarks: Vec<LandmarkId> = observations.map(|(_, id)| id).collect();
        landmarks.sort_unstable();
        landmarks.dedup();
        landmarks
    }

    /// Merges the submap of `keyframe` into that of `parent`. The similarity maps its world frame and unit of length into the other ones;
    /// `keyframe` becomes a child of `parent`. Does nothing if both are in the same submap.
    pub(crate) fn merge_submaps(&mut self, keyframe: KeyFrameId, parent: KeyFrameId, s_parents_keyframes: &Similarity) {
        let (Some(root), Some(other)) = (self.root(keyframe), self.root(parent)) else { return };
        if root == other || !self.keyframes.contains_key(keyframe) || !self.keyframes.contains_key(parent) {
            return;
        }
        let members = self.submap(root);
        for id in self.landmarks_of(&members) {
            let landmark = &mut self.landmarks[id];
            landmark.position = s_parents_keyframes * landmark.position;
            landmark.normal = s_parents_keyframes.isometry.rotation * landmark.normal;
            landmark.max_distance_m *= s_parents_keyframes.scaling();
            landmark.min_distance_m *= s_parents_keyframes.scaling();
        }
        let inverse = s_parents_keyframes.inverse();
        for id in members {
            let moved = unscaled(&self.keyframes[id].t_cam_world) * inverse;
            self.set_scaled_pose(id, &moved);
        }
        // The edges from the keyframe up to its root are reversed; all other edges of the tree stay as they are.
        let (mut id, mut parent) = (keyframe, parent);
        loop {
            let old_parent = self.keyframes[id].parent.replace(parent);
            self.keyframes[parent].children.push(id);
            let Some(old_parent) = old_parent else { return };
            self.keyframes[old_parent].children.retain(|child| *child != id);
            (parent, id) = (id, old_parent);
        }
    }

    /// Removes a submap with all its landmarks.
    pub(crate) fn remove_submap(&mut self, root: KeyFrameId) {
        let members = self.submap(root);
        for landmark in self.landmarks_of(&members) {
            self.remove_landmark(landmark);
        }
        for id in members {
            self.keyframes.remove(id);
        }
        let without_ancestor: Vec<KeyFrameId> =
            self.removed.keys().filter(|id| self.keyframe_pose(**id).is_none()).copied().collect();
        for id in without_ancestor {
            self.removed.remove(&id);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose, se3_exp, sim3_from_tangent};
    use crate::map::scene::Scene;
    use nalgebra::Vector6;

    /// Returns two submaps of four keyframes each, with different world frames.
    fn two_submaps() -> (Scene, Map, Vec<KeyFrameId>, Vec<KeyFrameId>, Pose) {
        let (scene, mut map) = (Scene::new(), Map::default());
        let other_world = se3_exp(&Vector6::new(3.0, -1.0, 0.5, 0.2, 1.0, -0.4));
        let (mut first, mut second) = (Vec::new(), Vec::new());
        for k in 0..4 {
            first.push(scene.add(&mut map, k, &scene.pose(k), &first));
        }
        for k in 3..7 {
            second.push(scene.add(&mut map, k, &(scene.pose(k) * other_world), &second));
        }
        (scene, map, first, second, other_world)
    }

    #[test]
    fn merged_submaps_have_one_world_and_one_tree() {
        let (scene, mut map, first, second, other_world) = two_submaps();
        assert_eq!((map.validate(), map.submap_count()), (Ok(()), 2));
        assert_eq!(map.submap_size(second[3], 9), 4);
        map.merge_submaps(second[3], first[3], &unscaled(&other_world));
        assert_eq!((map.validate(), map.submap_count()), (Ok(()), 1));
        assert_eq!(map.root(second[0]), Some(first[0]));
        assert_eq!(map.keyframe(second[3]).unwrap().parent, Some(first[3]));
        for (k, id) in (3..7).zip(&second) {
            let keyframe = map.keyframe(*id).unwrap();
            assert!((keyframe.t_cam_world * scene.pose(k).inverse()).translation.vector.norm() < 1e-9);
            for (feature, landmark) in keyframe.observed() {
                let p = (keyframe.t_cam_world * map.landmark(landmark).unwrap().position).coords;
                let [u, v] = scene.sensor.pinhole.project(&p);
                let f = &keyframe.features.features[feature];
                assert!((u - f64::from(f.u)).hypot(v - f64::from(f.v)) < 1e-3);
            }
        }
        // A second merge does nothing, because both keyframes are in the same submap.
        map.merge_submaps(second[3], first[0], &unscaled(&other_world));
        assert_eq!(map.keyframe(second[3]).unwrap().parent, Some(first[3]));
    }

    #[test]
    fn a_submap_merged_at_another_scale_keeps_its_projections_and_relative_poses() {
        let (scene, mut map, first, second, _) = two_submaps();
        let s_first_second = sim3_from_tangent(&[0.4, -1.0, 0.3, 0.1, 0.8, -0.2, 0.7].into());
        let near = se3_exp(&Vector6::new(0.1, 0.05, -0.1, 0.02, 0.0, 0.01));
        // The reference keyframe of this frame is removed; both poses before that are compared with those afterwards.
        let t_cam_world = near * map.keyframe_pose(second[1]).unwrap();
        let relative_pose = map.relative_pose(second[1], &t_cam_world).unwrap();
        let removed = map.keyframe_pose(second[1]).unwrap();
        assert!(map.remove_keyframe(second[1]));
        let own: Vec<_> =
            map.landmarks_of(&second).iter().map(|id| (*id, map.landmark(*id).unwrap().clone())).collect();
        map.merge_submaps(second[3], first[3], &s_first_second);
        assert_eq!(map.validate(), Ok(()));
        let center = |pose: &Pose| pose.inverse() * nalgebra::Point3::origin();
        let moved = |before: &Pose, after: &Pose| {
            let turned = before.rotation * s_first_second.isometry.rotation.inverse();
            (s_first_second * center(before) - center(after)).norm() < 1e-9 && turned.angle_to(&after.rotation) < 1e-7
        };
        assert!(moved(&removed, &map.keyframe_pose(second[1]).unwrap()));
        assert!(moved(&t_cam_world, &map.absolute_pose(second[1], &relative_pose).unwrap()));
        // A new relative pose is in the unit of length at the insertion of the keyframe, too.
        let now = map.absolute_pose(second[1], &relative_pose).unwrap();
        assert!(
            (map.relative_pose(second[1], &now).unwrap() * relative_pose.inverse()).translation.vector.norm() < 1e-9
        );
        for (id, before) in &own {
            let after = map.landmark(*id).unwrap();
            assert!((s_first_second * before.position - after.position).norm() < 1e-9);
            assert!((after.max_distance_m / before.max_distance_m - s_first_second.scaling()).abs() < 1e-9);
            for &(k, f) in &after.observations {
                let keyframe = map.keyframe(k).unwrap();
                let [u, v] = scene.sensor.pinhole.project(&(keyframe.t_cam_world * after.position).coords);
                let feature = &keyframe.features.features[f as usize];
                assert!((u - f64::from(feature.u)).hypot(v - f64::from(feature.v)) < 1e-3);
            }
        }
    }

    #[test]
    fn a_submap_is_removed_with_its_landmarks_and_relative_poses() {
        let (_, mut map, first, second, _) = two_submaps();
        assert!(map.remove_keyframe(second[2]));
        let landmarks = map.landmarks_of(&first).len();
        map.remove_submap(second[0]);
        assert_eq!((map.keyframe_count(), map.landmark_count(), map.validate()), (4, landmarks, Ok(())));
        assert_eq!(map.keyframe_pose(second[2]), None);
        assert!(map.keyframe_pose(first[2]).is_some());
    }

    #[test]
    #[cfg(feature = "persist")]
    fn a_merged_map_is_read_as_one_submap() {
        let (_, mut map, first, second, other_world) = two_submaps();
        map.merge_submaps(second[3], first[3], &unscaled(&other_world));
        let features = crate::config::FeatureConfig { levels: 1, ..Default::default() };
        let bytes = crate::map::persist::encode(&map, &crate::map::scene::camera(), &features).unwrap();
        let read = crate::map::persist::decode(&bytes).unwrap().map;
        assert_eq!((read.submap_count(), read.keyframe_count()), (1, 8));
    }
}
