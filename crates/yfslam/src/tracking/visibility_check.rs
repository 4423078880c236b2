//! Landmarks that are no longer where they were: the depth image shows what is behind them.
//!
//! In: the frame's pose and depth, landmarks that should be in view. Out: those that it looks through. What stands there no more is
//! forgotten as OctoMap (Hornung et al., Autonomous Robots 2013) forgets a voxel: see [`crate::map::Landmark::standing`].

use nalgebra::{Point3, Vector3};

use crate::config::FullConfig;
use crate::context::SensorModel;
use crate::geometry::Pose;
use crate::image::DepthImage;

/// Distance at which depth around the landmark is read too, px: corners often are at an edge.
const AROUND_PX: f64 = 8.0;

/// Whether a frame sees through a point of the world, all around.
pub(super) fn is_free_space(
    config: &FullConfig,
    sensor: &SensorModel,
    depth: &DepthImage,
    t_cam_world: &Pose,
    point_world: &Point3<f64>,
) -> bool {
    let p: Vector3<f64> = (t_cam_world * point_world).coords;
    let clear_m = (1.0 + f64::from(config.free_space_margin_share)) * p.z + f64::from(config.free_space_margin_m);
    let (x, y) = (p.x / p.z, p.y / p.z);
    let [u, v] = sensor.camera.distort(x, y);
    let around = [[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]];
    p.z > 0.0
        && around.iter().all(|[dx, dy]| {
            let at = [u + AROUND_PX * dx, v + AROUND_PX * dy].map(|v| v.round());
            at.iter().all(|v| *v >= 0.0)
                && depth.metres(at[0] as usize, at[1] as usize).is_some_and(|z| f64::from(z) > clear_m)
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::config::Config;
    use crate::image::Image;

    #[test]
    fn a_point_is_seen_through_if_all_around_it_the_background_shows() {
        let (fx, fy, cx, cy, distortion) = (520.0, 520.0, 320.0, 240.0, [0.0; 5]);
        let camera = Camera::pinhole(640, 480, fx, fy, cx, cy).with_distortion(distortion);
        let config = Config::default();
        let sensor = SensorModel::new(&camera, &config, &[1.0]);
        // A point 2 m away, seen in the middle of the picture.
        let through = |depth_of: &dyn Fn(usize) -> u16| {
            let mut raw = Image::new(640, 480);
            (0..480).for_each(|y| (0..640).for_each(|x| raw.row_mut(y)[x] = depth_of(x)));
            let depth = DepthImage { raw, metres_per_unit: 1.0 / 5000.0 };
            let pose = Pose::translation(0.0, 0.0, 1.0);
            is_free_space(&config.dynamic.full, &sensor, &depth, &pose, &Point3::new(0.0, 0.0, 1.0))
        };
        assert!(through(&|_| 15_000), "a wall at 3 m");
        assert!(!through(&|_| 10_500), "what is there, with noise");
        assert!(!through(&|_| 5_000), "somebody in front");
        assert!(!through(&|_| 0), "no depth");
        assert!(!through(&|x| if x < 318 { 10_000 } else { 15_000 }), "the edge of what is there");
    }
}
