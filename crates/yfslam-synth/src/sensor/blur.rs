//! Motion blur by the motion of the camera while the shutter is open.
//!
//! In: linear colour, exact depth, the velocity of the camera. Out: linear colour. A point P of the camera frame moves with −(v + ω
//! × P) and its image with the derivative of the projection (Longuet-Higgins and Prazdny, "The interpretation of a moving retinal
//! image", 1980); the colour is the mean along that path. The motion of actors is not blurred.

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;

use crate::render::rays::RayTable;

/// Paths shorter than this are not blurred, px.
const LEAST_PX: f32 = 0.3;
/// Keeps paths finite where a point moves down the image as fast as the shutter.
const LEAST_STRETCH: f32 = 0.1;
/// Largest number of samples along a path.
const MOST_SAMPLES: f32 = 16.0;

/// Motion of the camera while the shutter is open, in the camera frame.
#[derive(Clone, Copy, Debug)]
pub struct CameraMove {
    /// Translation, m.
    translation: Vector3<f32>,
    /// Rotation, rad.
    rotation: Vector3<f32>,
    /// Time from one row to the next over the time of the exposure.
    line: f32,
}

impl CameraMove {
    /// Computes the motion from the poses (world from camera) at the opening and closing of the shutter.
    pub fn between(open: &Isometry3<f64>, close: &Isometry3<f64>) -> Self {
        let moved = open.inverse() * close;
        Self { translation: moved.translation.vector.cast(), rotation: moved.rotation.scaled_axis().cast(), line: 0.0 }
    }

    /// Sets the time from one row to the next, in exposures; 0 for a global shutter.
    pub fn with_line(self, exposures: f64) -> Self {
        Self { line: exposures as f32, ..self }
    }

    /// Returns the path of the image of the point at depth `z` on the ray (x, y, 1), in normalised coordinates.
    fn path(&self, x: f32, y: f32, z: f32) -> [f32; 2] {
        let point = Vector3::new(x * z, y * z, z);
        let v = -(self.translation + self.rotation.cross(&point));
        [(v.x - x * v.z) / z, (v.y - y * v.z) / z]
    }
}

/// Blurs `color` (row-major, like the rays) along the paths of its points, where `motion` is the motion of the camera about the time
/// of a row; pixels without depth stay.
pub fn smear(
    color: &[[f32; 3]],
    depth: &[f32],
    rays: &RayTable,
    motion: impl Fn(usize) -> CameraMove + Sync,
) -> Vec<[f32; 3]> {
    let width = rays.width;
    let mut out = color.to_vec();
    out.par_chunks_mut(width).enumerate().for_each(|(row, line)| {
        let motion = motion(row);
        for (column, pixel) in line.iter_mut().enumerate() {
            let (z, ray) = (depth[row * width + column], row * rays.stride + column);
            if z <= 0.0 {
                continue;
            }
            let [dx, dy] = motion.path(rays.x[ray], rays.y[ray], z);
            let (dx, dy) = (dx / rays.pitch[0], dy / rays.pitch[1]);
            // The samples of a rolling image are later the lower they lie, and their points have moved on: one that moves by s (dx,
            // dy) while the shutter is open is found where s (dx, dy) / (1 - dy · line) is.
            let stretch = 1.0 / (1.0 - dy * motion.line).max(LEAST_STRETCH);
            let (dx, dy) = (dx * stretch, dy * stretch);
            let length = libm::hypotf(dx, dy);
            if length > LEAST_PX {
                *pixel = mean_along(color, width, [column as f32, row as f32], [dx, dy], length);
            }
        }
    });
    out
}

/// Returns the mean colour along the path `d`, centred at `at`.
fn mean_along(color: &[[f32; 3]], width: usize, at: [f32; 2], d: [f32; 2], length: f32) -> [f32; 3] {
    let samples = (length.ceil() + 1.0).min(MOST_SAMPLES);
    let mut sum = [0.0; 3];
    for k in 0..samples as usize {
        let s = (k as f32 + 0.5) / samples - 0.5;
        let sample = between_pixels(color, width, at[0] + s * d[0], at[1] + s * d[1]);
        (0..3).for_each(|c| sum[c] += sample[c]);
    }
    sum.map(|value| value / samples)
}

/// Interpolates bilinearly; positions are clamped at the border.
fn between_pixels(color: &[[f32; 3]], width: usize, x: f32, y: f32) -> [f32; 3] {
    let height = color.len() / width;
    let (x, y) = (x.clamp(0.0, (width - 1) as f32), y.clamp(0.0, (height - 1) as f32));
    let (x0, y0) = (x as usize, y as usize);
    let (x1, y1) = ((x0 + 1).min(width - 1), (y0 + 1).min(height - 1));
    let (fx, fy) = (x - x0 as f32, y - y0 as f32);
    let [a, b, c, d] = [(x0, y0), (x1, y0), (x0, y1), (x1, y1)].map(|(x, y)| color[y * width + x]);
    std::array::from_fn(|k| (a[k] * (1.0 - fx) + b[k] * fx) * (1.0 - fy) + (c[k] * (1.0 - fx) + d[k] * fx) * fy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::default_camera;
    use yfslam::Camera;

    /// Returns the width, height and sum of a white dot at 2 m after blurring by `motion`, where it exceeds a tenth.
    fn smeared_dot(motion: Isometry3<f64>) -> (usize, usize, f32) {
        let Camera { fx, fy, .. } = default_camera();
        let camera = Camera::pinhole(64, 48, fx, fy, 32.0, 24.0);
        let mut color = vec![[0.0; 3]; 64 * 48];
        color[24 * 64 + 32] = [1.0; 3];
        let moved = CameraMove::between(&Isometry3::identity(), &motion);
        let out = smear(&color, &vec![2.0; 64 * 48], &RayTable::new(&camera), |_| moved);
        let lit = |x: usize, y: usize| out[y * 64 + x][0] > 0.05;
        let columns = (0..64).filter(|&x| (0..48).any(|y| lit(x, y))).count();
        let rows = (0..48).filter(|&y| (0..64).any(|x| lit(x, y))).count();
        (columns, rows, out.iter().map(|rgb| rgb[0]).sum())
    }

    #[test]
    fn a_dot_becomes_a_stroke_as_long_as_its_image_moves_and_keeps_its_light() {
        assert_eq!(smeared_dot(Isometry3::identity()), (1, 1, 1.0));
        // 3 cm to the right at 2 m are 8 px; 8 mrad of pitch are 4.3 px.
        let (columns, rows, light) = smeared_dot(Isometry3::translation(0.03, 0.0, 0.0));
        assert!((7..=9).contains(&columns) && rows == 1 && (light - 1.0).abs() < 0.02, "{columns} {rows} {light}");
        let (columns, rows, _) = smeared_dot(Isometry3::rotation(Vector3::new(0.008, 0.0, 0.0)));
        assert!(columns == 1 && (4..=6).contains(&rows), "{columns} {rows}");
    }

    #[test]
    fn rows_of_a_rolling_image_are_blurred_as_if_the_whole_image_had_been_taken_at_their_time() {
        let Camera { fx, fy, .. } = default_camera();
        let camera = Camera::pinhole(64, 48, fx, fy, 32.0, 24.0);
        for (pitch, line) in [(0.008, 0.0), (0.008, 0.05), (-0.008, 0.05), (0.008, -0.05)] {
            let motion = Isometry3::rotation(Vector3::new(pitch, 0.0, 0.0));
            let moved = CameraMove::between(&Isometry3::identity(), &motion).with_line(line);
            // A pattern y² that moves down by `dy` per exposure appears stretched in a rolling image.
            let dy = pitch * fy;
            let shown = |row: usize| ((row as f64 - 24.0) * (1.0 - dy * line)).powi(2) as f32;
            let color: Vec<[f32; 3]> = (0..64 * 48).map(|i| [shown(i / 64); 3]).collect();
            let out = smear(&color, &vec![2.0; 64 * 48], &RayTable::new(&camera), |_| moved);
            // The mean of a square over a path is more than the square in its middle by a twelfth of the squared length.
            let more = f64::from(out[24 * 64 + 32][0] - color[24 * 64 + 32][0]) / (dy * dy / 12.0);
            assert!((more - 1.0).abs() < 0.15, "{pitch} {line}: {more}");
        }
    }
}
