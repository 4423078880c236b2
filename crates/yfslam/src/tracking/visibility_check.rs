//! Visibility check: landmarks that no longer exist, because the depth image measures free space at their position.
//!
//! In: pose and depth image of a frame, and the position of a landmark. Out: whether it lies in free space. The existence log-odds of such
//! landmarks decrease as those of a voxel in OctoMap (Hornung et al., Autonomous Robots 2013): [`crate::map::Landmark::existence_log_odds`].

use nalgebra::{Point3, Vector3};

use crate::config::FullConfig;
use crate::context::SensorModel;
use crate::features::rolling_shutter::when_read;
use crate::image::DepthImage;
use crate::tracking::tracked_frame::TrackedFrame;

/// Distance of the four further pixels at which depth is read, px: corners often lie on the edge of an object.
const AROUND_PX: f64 = 8.0;

/// Returns whether a frame measures free space at a point of the world: the depth behind it at the pixel and at all pixels around it.
pub(super) fn is_free_space(
    config: &FullConfig,
    sensor: &SensorModel,
    depth: &DepthImage,
    frame: &TrackedFrame,
    point_world: &Point3<f64>,
) -> bool {
    let mut p: Vector3<f64> = (frame.t_cam_world * point_world).coords;
    if let Some(velocity) = frame.features.velocity().filter(|_| !frame.features.times().is_instant()) {
        p = when_read(&p, velocity, &sensor.camera, |row| frame.features.times().depth_seconds(row));
    }
    let min_depth_m = (1.0 + f64::from(config.free_space_margin_share)) * p.z + f64::from(config.free_space_margin_m);
    let (x, y) = (p.x / p.z, p.y / p.z);
    let [u, v] = sensor.camera.distort(x, y);
    let offsets = [[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]];
    p.z > 0.0
        && offsets.iter().all(|[dx, dy]| {
            let at = [u + AROUND_PX * dx, v + AROUND_PX * dy].map(|v| v.round());
            at.iter().all(|v| *v >= 0.0)
                && depth.metres(at[0] as usize, at[1] as usize).is_some_and(|z| f64::from(z) > min_depth_m)
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::config::Config;
    use crate::geometry::Pose;
    use crate::image::Image;

    #[test]
    fn a_point_is_in_free_space_if_all_pixels_around_it_show_the_background() {
        let (fx, fy, cx, cy, distortion) = (520.0, 520.0, 320.0, 240.0, [0.0; 5]);
        let camera = Camera::pinhole(640, 480, fx, fy, cx, cy).with_distortion(distortion);
        let config = Config::default();
        let sensor = SensorModel::new(&camera, &config, &[1.0]);
        // A point at a depth of 2 m in the centre of the image.
        let is_free = |depth_of: &dyn Fn(usize) -> u16| {
            let mut raw = Image::new(640, 480);
            (0..480).for_each(|y| (0..640).for_each(|x| raw.row_mut(y)[x] = depth_of(x)));
            let depth = DepthImage { raw, metres_per_unit: 1.0 / 5000.0 };
            let mut frame = TrackedFrame::default();
            frame.t_cam_world = Pose::translation(0.0, 0.0, 1.0);
            is_free_space(&config.dynamic.full, &sensor, &depth, &frame, &Point3::new(0.0, 0.0, 1.0))
        };
        assert!(is_free(&|_| 15_000), "a wall at 3 m");
        assert!(!is_free(&|_| 10_500), "the object itself, with noise");
        assert!(!is_free(&|_| 5_000), "a person in front of it");
        assert!(!is_free(&|_| 0), "no depth");
        assert!(!is_free(&|x| if x < 318 { 10_000 } else { 15_000 }), "the edge of the object");
    }
}
