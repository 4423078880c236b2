//! Rectification of stereo images: afterwards a point lies in the same row of both.
//!
//! In: two calibrated cameras on one body. Out: their common rectified camera, and for each a table with the source of each pixel. Both
//! are rotated so that their x-axis is the baseline (Fusiello, Trucco and Verri, "A compact algorithm for rectification of stereo pairs",
//! Machine Vision and Applications 2000), and get the shortest focal length at which each pixel has a source in both images.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use yfslam::{Camera, RgbImage};

/// Points along each side of an image from which the common field of view is computed.
const BORDER_POINTS: usize = 64;

/// A camera fixed to a body.
#[derive(Clone, Debug)]
pub struct MountedCamera {
    /// Calibration.
    pub camera: Camera,
    /// Pose of the camera in the body frame.
    pub t_body_cam: Isometry3<f64>,
}

/// Rectification of the images of two cameras.
#[derive(Clone, Debug, PartialEq)]
pub struct StereoRectification {
    /// The left camera after rectification; `bf` is the baseline times `fx`.
    pub camera: Camera,
    r_left_rectified: Rotation3<f64>,
    left: Remap,
    right: Remap,
}

/// Table that holds, for each pixel of a rectified image, its place in the original image.
#[derive(Clone, Debug, PartialEq)]
pub struct Remap {
    width: usize,
    height: usize,
    taps: Vec<Tap>,
}

/// Four neighbouring pixels, the first at `offset`, and the weights of the second column and row, in 1/256.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tap {
    offset: u32,
    weights: [u16; 2],
}

impl StereoRectification {
    /// Computes the rectification of a stereo pair.
    ///
    /// # Errors
    /// The two cameras do not form a stereo pair; the text says why.
    pub fn new(left: &MountedCamera, right: &MountedCamera) -> Result<Self, String> {
        let size = |m: &MountedCamera| (m.camera.width, m.camera.height);
        if size(left) != size(right) {
            return Err(format!("the images have {:?} and {:?} px, not the same size", size(left), size(right)));
        }
        let t_left_right = left.t_body_cam.inverse() * right.t_body_cam;
        let baseline = t_left_right.translation.vector;
        // Axes of the rectified cameras in the left one: x along the baseline, z as close to both optical axes as possible.
        let x = baseline.normalize();
        let ahead = Vector3::z() + t_left_right.rotation * Vector3::z();
        let y = ahead.cross(&x).normalize();
        let z = x.cross(&y);
        if !(x.x > 0.5 && z.z > 0.5) {
            return Err(format!(
                "the right camera is at ({:.3}, {:.3}, {:.3}) m in the frame of the left one, not to its right",
                baseline.x, baseline.y, baseline.z
            ));
        }
        let r_left_rectified = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z]));
        let r_right_rectified = t_left_right.rotation.to_rotation_matrix().inverse() * r_left_rectified;
        let mut camera = common_camera([(&left.camera, &r_left_rectified), (&right.camera, &r_right_rectified)])
            .ok_or("the images do not overlap")?;
        camera.bf = baseline.norm() * camera.fx;
        Ok(Self {
            left: Remap::new(&camera, &left.camera, &r_left_rectified),
            right: Remap::new(&camera, &right.camera, &r_right_rectified),
            camera,
            r_left_rectified,
        })
    }

    /// Returns the pose of the rectified left camera in the left camera.
    pub fn t_left_rectified(&self) -> Isometry3<f64> {
        Isometry3::from_parts(Default::default(), UnitQuaternion::from_rotation_matrix(&self.r_left_rectified))
    }

    /// Returns the table for images of the left camera.
    pub fn left(&self) -> &Remap {
        &self.left
    }

    /// Returns the table for images of the right camera.
    pub fn right(&self) -> &Remap {
        &self.right
    }
}

/// Finds the camera with the shortest focal length whose whole image is within the view of both cameras, given their rotations.
fn common_camera(turned: [(&Camera, &Rotation3<f64>); 2]) -> Option<Camera> {
    // The common field of view ends at the innermost points of each side.
    let (mut low, mut high) = ([f64::NEG_INFINITY; 2], [f64::INFINITY; 2]);
    for (camera, r_cam_rectified) in turned {
        let (right, bottom) = ((camera.width - 1) as f64, (camera.height - 1) as f64);
        for k in 0..=BORDER_POINTS {
            let part = k as f64 / BORDER_POINTS as f64;
            let seen = |u: f64, v: f64| {
                let [x, y] = camera.undistort(u, v);
                let ray = r_cam_rectified.inverse() * Vector3::new(x, y, 1.0);
                [ray.x / ray.z, ray.y / ray.z]
            };
            low[0] = low[0].max(seen(0.0, part * bottom)[0]);
            high[0] = high[0].min(seen(right, part * bottom)[0]);
            low[1] = low[1].max(seen(part * right, 0.0)[1]);
            high[1] = high[1].min(seen(part * right, bottom)[1]);
        }
    }
    let (camera, _) = turned[0];
    let spans = [(camera.width - 1) as f64, (camera.height - 1) as f64];
    let focal = (spans[0] / (high[0] - low[0])).max(spans[1] / (high[1] - low[1]));
    let center = |k: usize| 0.5 * spans[k] - focal * 0.5 * (low[k] + high[k]);
    let overlaps = high[0] > low[0] && high[1] > low[1] && focal.is_finite();
    overlaps.then(|| {
        Camera::pinhole(camera.width, camera.height, focal, focal, center(0), center(1))
            .with_fps(camera.fps)
            .with_bf(camera.bf)
    })
}

impl Remap {
    /// Computes the table from pixels of `to` to pixels of `from`; both have the same size, and `r_from_to` rotates between their frames.
    fn new(to: &Camera, from: &Camera, r_from_to: &Rotation3<f64>) -> Self {
        let (width, height) = (to.width, to.height);
        let tap = |i: usize| {
            let [x, y] = to.undistort((i % width) as f64, (i / width) as f64);
            let ray = r_from_to * Vector3::new(x, y, 1.0);
            let [u, v] = from.distort(ray.x / ray.z, ray.y / ray.z);
            // The last column and row have no neighbours; rounding may lead slightly beyond the first.
            let (u, v) = (u.clamp(0.0, (width - 1) as f64), v.clamp(0.0, (height - 1) as f64));
            let (left, top) = ((u as usize).min(width.saturating_sub(2)), (v as usize).min(height.saturating_sub(2)));
            let weight = |position: f64, first: usize| (256.0 * (position - first as f64) + 0.5) as u16;
            Tap { offset: (top * width + left) as u32, weights: [weight(u, left), weight(v, top)] }
        };
        Self { width, height, taps: (0..width * height).map(tap).collect() }
    }

    /// Returns the rectified image; it is black if `image` does not have the size of the table.
    pub fn apply(&self, image: &RgbImage) -> RgbImage {
        let mut out = RgbImage::new(self.width, self.height);
        let data = image.data();
        for (pixel, tap) in out.data_mut().iter_mut().zip(&self.taps) {
            let (first, second) = (tap.offset as usize, tap.offset as usize + self.width);
            let (Some([a, b]), Some([c, d])) = (pair(data, first), pair(data, second)) else { continue };
            let [wx, wy] = tap.weights.map(u32::from);
            *pixel = std::array::from_fn(|k| {
                let across = |l: &[u8; 3], r: &[u8; 3]| u32::from(l[k]) * (256 - wx) + u32::from(r[k]) * wx;
                ((across(a, b) * (256 - wy) + across(c, d) * wy + (1 << 15)) >> 16) as u8
            });
        }
        out
    }
}

/// Returns two neighbouring pixels.
fn pair(data: &[[u8; 3]], first: usize) -> Option<&[[u8; 3]; 2]> {
    data.get(first..)?.first_chunk()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns two cameras like those of EuRoC, slightly rotated against each other.
    fn cameras() -> [MountedCamera; 2] {
        let camera = |fx: f64, cx: f64| {
            Camera::pinhole(376, 240, fx, fx - 0.6, cx, 124.0)
                .with_distortion([-0.283, 0.074, 0.0002, 2e-5, 0.0])
                .with_fps(20.0)
                .with_bf(1.0)
        };
        let turn = UnitQuaternion::from_euler_angles(0.01, -0.012, 0.006);
        let right = Isometry3::from_parts(nalgebra::Translation3::new(0.11, 0.0008, -0.0005), turn);
        let body = Isometry3::new(Vector3::new(-0.02, -0.06, 0.01), Vector3::new(0.1, 0.2, 1.5));
        [(229.3, 183.6, Isometry3::identity()), (228.8, 189.9, right)]
            .map(|(fx, cx, pose)| MountedCamera { camera: camera(fx, cx), t_body_cam: body * pose })
    }

    /// Returns the column and row in the original image that a pixel of the rectified image is taken from.
    fn source_of(remap: &Remap, u: usize, v: usize) -> [f64; 2] {
        let tap = remap.taps[v * remap.width + u];
        let at = |first: usize, weight: u16| first as f64 + f64::from(weight) / 256.0;
        [at(tap.offset as usize % remap.width, tap.weights[0]), at(tap.offset as usize / remap.width, tap.weights[1])]
    }

    #[test]
    fn a_point_lies_in_the_same_row_of_both_images_at_the_disparity_of_its_depth() {
        let [left, right] = cameras();
        let r = StereoRectification::new(&left, &right).unwrap();
        let t_body_rectified = left.t_body_cam * r.t_left_rectified();
        assert!((r.camera.bf / r.camera.fx - 0.11).abs() < 1e-4);
        for (u, v, z) in [(200, 120, 2.0), (60, 200, 1.0), (350, 20, 5.0), (180, 10, 0.8)] {
            let [x, y] = r.camera.undistort(u as f64, v as f64);
            let point = t_body_rectified * nalgebra::Point3::new(x * z, y * z, z);
            let seen = |camera: &MountedCamera| {
                let p = camera.t_body_cam.inverse_transform_point(&point);
                camera.camera.distort(p.x / p.z, p.y / p.z)
            };
            let error = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            assert!(error(source_of(&r.left, u, v), seen(&left)) < 0.01);
            let there = u as f64 - r.camera.bf / z;
            if there >= 0.0 {
                // Between two pixels of the table.
                let (a, b) = (source_of(&r.right, there as usize, v), source_of(&r.right, there as usize + 1, v));
                let at = [0, 1].map(|k| a[k] + (b[k] - a[k]) * there.fract());
                assert!(error(at, seen(&right)) < 0.02, "{at:?} {:?}", seen(&right));
            }
        }
    }

    #[test]
    fn every_pixel_has_its_source_within_both_images() {
        let [left, right] = cameras();
        let r = StereoRectification::new(&left, &right).unwrap();
        for (remap, from, turn) in [
            (&r.left, &left.camera, r.r_left_rectified),
            (
                &r.right,
                &right.camera,
                (right.t_body_cam.inverse() * left.t_body_cam).rotation.to_rotation_matrix() * r.r_left_rectified,
            ),
        ] {
            assert_eq!(remap.taps.len(), 376 * 240);
            for i in 0..remap.taps.len() {
                let [x, y] = r.camera.undistort((i % 376) as f64, (i / 376) as f64);
                let ray = turn * Vector3::new(x, y, 1.0);
                let [u, v] = from.distort(ray.x / ray.z, ray.y / ray.z);
                assert!((-0.1..=375.1).contains(&u) && (-0.1..=239.1).contains(&v), "{u} {v}");
            }
        }
    }

    #[test]
    fn cameras_that_form_no_stereo_pair_are_refused() {
        let [left, right] = cameras();
        let error = StereoRectification::new(&right, &left).unwrap_err();
        assert!(error.contains("not to its right"), "{error}");
        let mut small = right.clone();
        small.camera.width = 100;
        assert!(StereoRectification::new(&left, &small).unwrap_err().contains("same size"));
    }
}
