//! A small scene with exact measurements, for tests of changes of the map.

use nalgebra::{Point3, Vector6};

use super::{KeyFrameId, Map};
use crate::camera::Camera;
use crate::config::Config;
use crate::context::SensorModel;
use crate::features::{Descriptor, Feature, FrameFeatures, ImageBounds};
use crate::geometry::{Pose, se3_exp};

/// Points on an uneven wall, and cameras that move along it.
pub(crate) struct Scene {
    pub sensor: SensorModel,
    points: Vec<Point3<f64>>,
}

/// Returns the camera of the scene.
pub(crate) fn camera() -> Camera {
    Camera::pinhole(640, 480, 520.0, 510.0, 320.0, 240.0)
}

impl Scene {
    pub(crate) fn new() -> Self {
        let camera = camera();
        let point = |i: usize| {
            let (x, y) = (0.05 * i as f64 - 1.5, 0.3 * ((i * 7 % 11) as f64 - 5.0) * 0.5);
            Point3::new(x, y, 3.0 + 0.4 * ((i * 5 % 9) as f64 / 9.0))
        };
        let sensor = SensorModel::new(&camera, &Config::default(), &[1.0]);
        Self { sensor, points: (0..160).map(point).collect() }
    }

    /// Returns the true pose `t_cam_world` of camera `k`.
    pub(crate) fn pose(&self, k: usize) -> Pose {
        se3_exp(&(Vector6::new(-0.15, 0.01, 0.02, 0.0, 0.01, 0.002) * k as f64))
    }

    /// Inserts camera `k` with the estimated pose `estimate` (`t_cam_world`). Points that the keyframes `shared` observe get another
    /// observation; the others become landmarks, placed according to the estimate.
    pub(crate) fn add(&self, map: &mut Map, k: usize, estimate: &Pose, shared: &[KeyFrameId]) -> KeyFrameId {
        let pose = self.pose(k);
        let c = &self.sensor.pinhole;
        let mut visible = Vec::new();
        let (mut features, mut descriptors) = (Vec::new(), Vec::new());
        for (number, point) in self.points.iter().enumerate() {
            let p = pose * point;
            let [u, v] = c.project(&p.coords);
            if !(0.0..640.0).contains(&u) || !(0.0..480.0).contains(&v) {
                continue;
            }
            let [u, v] = [u as f32, v as f32];
            let depth_m = Some(p.z as f32);
            features.push(Feature { raw: [u, v], u, v, octave: 0, angle_rad: 0.0, depth_m, trust: 1.0 });
            descriptors.push(Descriptor([number as u64; 4].map(|n| n.wrapping_mul(0x9e37_79b9_7f4a_7c15))));
            visible.push(number);
        }
        let bounds = ImageBounds { u_min: 0.0, u_max: 640.0, v_min: 0.0, v_max: 480.0 };
        let descriptors_of = descriptors.clone();
        let id = map.insert_keyframe(k as i64, *estimate, FrameFeatures::from_parts(features, descriptors, bounds));
        for (feature, number) in visible.iter().enumerate() {
            let known = shared.iter().filter_map(|other| map.keyframe(*other)).find_map(|other| {
                let same = |(i, landmark): (usize, _)| {
                    (other.features.descriptors[i] == descriptors_of[feature]).then_some(landmark)
                };
                other.observed().find_map(same)
            });
            match known {
                Some(landmark) => map.add_observation(landmark, id, feature),
                None => {
                    let position = estimate.inverse() * (pose * self.points[*number]);
                    map.insert_landmark(position, id, feature, [0; 3], &self.sensor.scale_factors);
                }
            }
        }
        map.update_covisibility(id);
        id
    }
}
