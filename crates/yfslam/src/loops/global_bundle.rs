//! Global bundle adjustment of a submap after a loop (ORB-SLAM2, IEEE T-RO 2017, section III-C), on a copy, so that mapping can
//! continue meanwhile.
//!
//! In: the map when the loop was closed; later, the map as it has become. Out: that map, adjusted. Keyframes and landmarks that
//! were added meanwhile move with their parent or reference keyframe.

use slotmap::SecondaryMap;

use crate::config::BundleConfig;
use crate::context::SensorModel;
use crate::geometry::Pose;
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::mapping::Window;

/// A copy of a submap for adjustment.
#[derive(Clone, Debug)]
pub(crate) struct GlobalBundle {
    window: Window,
    root: KeyFrameId,
}

impl GlobalBundle {
    /// Copies the submap of `keyframe`. `None` if the map does not have it.
    pub(crate) fn copy(sensor: &SensorModel, map: &Map, keyframe: KeyFrameId) -> Option<Self> {
        let root = map.root(keyframe)?;
        Some(Self { window: Window::whole(sensor, map, root), root })
    }

    /// Adjusts the copy for as long as `go_on` returns true.
    pub(crate) fn adjust(&mut self, config: &BundleConfig, go_on: &dyn Fn() -> bool) {
        self.window.adjust_while(config, go_on);
    }

    /// Merges the adjusted poses and points into the map.
    pub(crate) fn merge(self, sensor: &SensorModel, map: &mut Map) {
        let members = map.submap(self.root);
        let before: SecondaryMap<KeyFrameId, Pose> =
            members.iter().filter_map(|id| Some((*id, map.keyframe(*id)?.t_cam_world))).collect();
        let copied: SecondaryMap<KeyFrameId, ()> = self.window.keyframes().iter().map(|id| (*id, ())).collect();
        let copied_landmarks = self.window.landmarks().to_vec();
        self.window.merge(sensor, map);
        // The motion from a keyframe's old world to its new one.
        let world_motion = |map: &Map, id: KeyFrameId| Some(map.keyframe(id)?.t_cam_world.inverse() * before.get(id)?);
        for &id in members.iter().filter(|id| !copied.contains_key(**id)) {
            let mut anchor = map.keyframe(id).and_then(|k| k.parent);
            while let Some(ancestor) = anchor.filter(|ancestor| !copied.contains_key(*ancestor)) {
                anchor = map.keyframe(ancestor).and_then(|k| k.parent);
            }
            let motion: Option<Pose> = anchor.and_then(|anchor| world_motion(map, anchor));
            if let (Some(motion), Some(old)) = (motion, before.get(id)) {
                map.set_pose(id, old * motion.inverse());
            }
        }
        let is_new = |id: &LandmarkId| copied_landmarks.binary_search(id).is_err();
        for id in map.landmarks_of(&members).into_iter().filter(is_new) {
            let Some(landmark) = map.landmark(id) else { continue };
            if let Some(motion) = world_motion(map, landmark.reference) {
                let position = motion * landmark.position;
                map.set_position(id, position);
                map.update_landmark(id, &sensor.scale_factors);
            }
        }
    }
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
