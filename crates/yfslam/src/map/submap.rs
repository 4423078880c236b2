//! Parts of the map that have no landmark in common: each is a tree of keyframes with a world of its own, and its root defines that
//! world. A place that two of them show makes one of them (Atlas: Elvira, Tardós and Montiel, IROS 2019).

use super::{KeyFrameId, LandmarkId, Map};
use crate::geometry::{Similarity, unscaled};

impl Map {
    /// The root of the submap that a keyframe belongs to: the keyframe that defines its world.
    pub fn root(&self, keyframe: KeyFrameId) -> Option<KeyFrameId> {
        let mut id = keyframe;
        loop {
            match self.keyframes.get(id) {
                Some(k) => match k.parent {
                    Some(parent) => id = parent,
                    None => return Some(id),
                },
                // A removed one belongs where the keyframe belongs that it was tied to.
                None => id = self.removed.get(&id)?.0,
            }
        }
    }

    /// The keyframes of the submap with that root, in the order of their slots.
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

    /// Number of keyframes in the submap of `keyframe`, counted up to `at_most`.
    pub(crate) fn submap_size(&self, keyframe: KeyFrameId, at_most: usize) -> usize {
        self.root(keyframe).map_or(0, |root| self.tree_size(root, at_most))
    }

    fn tree_size(&self, top: KeyFrameId, at_most: usize) -> usize {
        let Some(k) = self.keyframes.get(top).filter(|_| at_most > 0) else { return 0 };
        k.children.iter().fold(1, |size, child| size + self.tree_size(*child, at_most - size))
    }

    /// Number of submaps.
    pub fn submap_count(&self) -> usize {
        self.keyframes.values().filter(|k| k.parent.is_none()).count()
    }

    /// Landmarks that the keyframes see, each once.
    pub(crate) fn landmarks_of(&self, keyframes: &[KeyFrameId]) -> Vec<LandmarkId> {
        let seen = keyframes.iter().filter_map(|id| self.keyframes.get(*id)).flat_map(|k| k.observed());
        let mut landmarks: Vec<LandmarkId> = seen.map(|(_, id)| id).collect();
        landmarks.sort_unstable();
        landmarks.dedup();
        landmarks
    }

    /// Takes the submap of `keyframe` into the world of that of `parent`: everything in it moves by `s_parents_keyframes`, from its
    /// own world and unit into the other one, and its tree hangs below `parent` by `keyframe`. Does nothing if they are of one submap.
    pub(crate) fn weld(&mut self, keyframe: KeyFrameId, parent: KeyFrameId, s_parents_keyframes: &Similarity) {
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
        let back = s_parents_keyframes.inverse();
        for id in members {
            let moved = unscaled(&self.keyframes[id].t_cam_world) * back;
            self.set_scaled_pose(id, &moved);
        }
        // The way from the keyframe up to its root turns round; all else hangs where it hung.
        let (mut id, mut parent) = (keyframe, parent);
        loop {
            let up = self.keyframes[id].parent.replace(parent);
            self.keyframes[parent].children.push(id);
            let Some(up) = up else { return };
            self.keyframes[up].children.retain(|child| *child != id);
            (parent, id) = (id, up);
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
        let gone: Vec<KeyFrameId> =
            self.removed.keys().filter(|id| self.keyframe_pose(**id).is_none()).copied().collect();
        for id in gone {
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

    /// Two submaps of four keyframes each; the world of the second is another one.
    fn apart() -> (Scene, Map, Vec<KeyFrameId>, Vec<KeyFrameId>, Pose) {
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
    fn welding_makes_two_worlds_one_and_keeps_the_tree() {
        let (scene, mut map, first, second, other_world) = apart();
        assert_eq!((map.validate(), map.submap_count()), (Ok(()), 2));
        assert_eq!(map.submap_size(second[3], 9), 4);
        map.weld(second[3], first[3], &unscaled(&other_world));
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
        // Welded once, it is of the same submap.
        map.weld(second[3], first[0], &unscaled(&other_world));
        assert_eq!(map.keyframe(second[3]).unwrap().parent, Some(first[3]));
    }

    #[test]
    fn a_submap_welded_at_another_scale_shows_the_same_and_what_hung_on_it_comes_along() {
        let (scene, mut map, first, second, _) = apart();
        let s_first_second = sim3_from_tangent(&[0.4, -1.0, 0.3, 0.1, 0.8, -0.2, 0.7].into());
        let near = se3_exp(&Vector6::new(0.1, 0.05, -0.1, 0.02, 0.0, 0.01));
        // A frame that hangs on a keyframe that is removed, and keyframe and frame as they are before.
        let t_cam_world = near * map.keyframe_pose(second[1]).unwrap();
        let relative_pose = map.relative_pose(second[1], &t_cam_world).unwrap();
        let removed = map.keyframe_pose(second[1]).unwrap();
        assert!(map.remove_keyframe(second[1]));
        let own: Vec<_> =
            map.landmarks_of(&second).iter().map(|id| (*id, map.landmark(*id).unwrap().clone())).collect();
        map.weld(second[3], first[3], &s_first_second);
        assert_eq!(map.validate(), Ok(()));
        let center = |pose: &Pose| pose.inverse() * nalgebra::Point3::origin();
        let moved = |before: &Pose, after: &Pose| {
            let turned = before.rotation * s_first_second.isometry.rotation.inverse();
            (s_first_second * center(before) - center(after)).norm() < 1e-9 && turned.angle_to(&after.rotation) < 1e-7
        };
        assert!(moved(&removed, &map.keyframe_pose(second[1]).unwrap()));
        assert!(moved(&t_cam_world, &map.absolute_pose(second[1], &relative_pose).unwrap()));
        // What is tied from now on is so in the unit that the keyframe was mapped in, too.
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
                let seen = &keyframe.features.features[f as usize];
                assert!((u - f64::from(seen.u)).hypot(v - f64::from(seen.v)) < 1e-3);
            }
        }
    }

    #[test]
    fn a_submap_goes_with_all_that_hung_on_it() {
        let (_, mut map, first, second, _) = apart();
        assert!(map.remove_keyframe(second[2]));
        let landmarks = map.landmarks_of(&first).len();
        map.remove_submap(second[0]);
        assert_eq!((map.keyframe_count(), map.landmark_count(), map.validate()), (4, landmarks, Ok(())));
        assert_eq!(map.keyframe_pose(second[2]), None);
        assert!(map.keyframe_pose(first[2]).is_some());
    }

    #[test]
    fn a_welded_map_is_read_back_as_one() {
        let (_, mut map, first, second, other_world) = apart();
        map.weld(second[3], first[3], &unscaled(&other_world));
        let features = crate::config::FeatureConfig { levels: 1, ..Default::default() };
        let bytes = crate::map::persist::encode(&map, &crate::map::scene::camera(), &features).unwrap();
        let read = crate::map::persist::decode(&bytes).unwrap().map;
        assert_eq!((read.submap_count(), read.keyframe_count()), (1, 8));
    }
}
