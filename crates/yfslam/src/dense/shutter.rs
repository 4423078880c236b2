//! Images of a rolling shutter as a global shutter would have seen them while the middle row of the colour image was read.
//!
//! In: a frame, its row times, the velocity of the camera. Out: where each pixel of the corrected image lies in the images as they were
//! read, and the corrected images. The shift is computed on a coarse grid and interpolated: it changes slowly over a surface, and patches
//! leave out the edges of depth, where it does not.

use nalgebra::Vector3;

use crate::camera::Camera;
use crate::features::rolling_shutter::{FrameTimes, Velocity, when_read};
use crate::image::{DepthImage, Image, RgbImage};

/// Distance of the points of the coarse grid, px.
const STEP_PX: usize = 8;

/// Where a pixel lies in the images as they were read.
#[derive(Clone, Copy, Debug, Default)]
struct Shift {
    /// Shift in the colour image, px.
    color: [f32; 2],
    /// Shift in the depth image, px.
    depth: [f32; 2],
    /// What the depth at the time of the middle row is more than the measured one, m.
    deeper_m: f32,
}

/// The shift of the rows of one frame.
#[derive(Clone, Debug)]
pub(crate) struct RowShift {
    columns: usize,
    rows: usize,
    shifts: Vec<Shift>,
}

impl RowShift {
    /// Computes the shift for a camera with that velocity; `None` if colour and depth show one instant.
    pub(crate) fn new(camera: &Camera, times: &FrameTimes, velocity: &Velocity, depth: &DepthImage) -> Option<Self> {
        if times.is_instant() {
            return None;
        }
        let [columns, rows] = [camera.width, camera.height].map(|side| side.div_ceil(STEP_PX) + 1);
        let typical_m = typical_depth_m(depth)?;
        let point = |i: usize| [(i % columns) * STEP_PX, (i / columns) * STEP_PX];
        let shifts =
            (0..columns * rows).map(|i| shift_at(camera, times, velocity, depth, point(i), typical_m)).collect();
        Some(Self { columns, rows, shifts })
    }

    /// Returns where a pixel of the corrected image lies in the colour image as it was read, px.
    pub(crate) fn in_color(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let Shift { color: [dx, dy], .. } = self.at(x, y);
        [x + dx, y + dy]
    }

    /// Returns the corrected colour image.
    pub(crate) fn corrected_color(&self, color: &RgbImage) -> RgbImage {
        let mut corrected = Image::new(color.width(), color.height());
        for y in 0..color.height() {
            for (x, pixel) in corrected.row_mut(y).iter_mut().enumerate() {
                let Shift { color: [dx, dy], .. } = self.at(x as f32, y as f32);
                *pixel = nearest(color, x as f32 + dx, y as f32 + dy).unwrap_or_default();
            }
        }
        corrected
    }

    /// Returns the corrected depth image.
    pub(crate) fn corrected_depth(&self, depth: &DepthImage) -> DepthImage {
        let mut raw = Image::new(depth.raw.width(), depth.raw.height());
        for y in 0..raw.height() {
            for (x, pixel) in raw.row_mut(y).iter_mut().enumerate() {
                let Shift { depth: [dx, dy], deeper_m, .. } = self.at(x as f32, y as f32);
                let measured = nearest(&depth.raw, x as f32 + dx, y as f32 + dy).unwrap_or(0);
                if measured > 0 {
                    let units = f32::from(measured) + deeper_m / depth.metres_per_unit;
                    *pixel = (units + 0.5).max(1.0) as u16;
                }
            }
        }
        DepthImage { raw, metres_per_unit: depth.metres_per_unit }
    }

    /// Interpolates the shift at a pixel.
    fn at(&self, x: f32, y: f32) -> Shift {
        let [gx, gy] = [x, y].map(|v| v.max(0.0) / STEP_PX as f32);
        let (column, row) = ((gx as usize).min(self.columns - 2), (gy as usize).min(self.rows - 2));
        let (fx, fy) = (gx - column as f32, gy - row as f32);
        let corner = |c: usize, r: usize| &self.shifts[(row + r) * self.columns + column + c];
        let mix = |part: &dyn Fn(&Shift) -> f32| {
            let upper = part(corner(0, 0)) * (1.0 - fx) + part(corner(1, 0)) * fx;
            let lower = part(corner(0, 1)) * (1.0 - fx) + part(corner(1, 1)) * fx;
            upper * (1.0 - fy) + lower * fy
        };
        Shift {
            color: [mix(&|s| s.color[0]), mix(&|s| s.color[1])],
            depth: [mix(&|s| s.depth[0]), mix(&|s| s.depth[1])],
            deeper_m: mix(&|s| s.deeper_m),
        }
    }
}

/// Returns the pixel nearest to a position; `None` outside the image.
fn nearest<T: Copy>(image: &Image<T>, x: f32, y: f32) -> Option<T> {
    let [x, y] = [x + 0.5, y + 0.5];
    if x < 0.0 || y < 0.0 { None } else { image.get(x as usize, y as usize).copied() }
}

/// Returns the median of some depths of the image, which stands for those that were not measured.
fn typical_depth_m(depth: &DepthImage) -> Option<f64> {
    let (width, height) = (depth.raw.width(), depth.raw.height());
    let pixels = (0..height).step_by(STEP_PX).flat_map(|y| (0..width).step_by(STEP_PX).map(move |x| (x, y)));
    let mut depths: Vec<f32> = pixels.filter_map(|(x, y)| depth.metres(x, y)).collect();
    let middle = depths.len() / 2;
    (!depths.is_empty()).then(|| f64::from(*depths.select_nth_unstable_by(middle, f32::total_cmp).1))
}

/// Computes the shift at a pixel of the corrected image.
fn shift_at(
    camera: &Camera,
    times: &FrameTimes,
    velocity: &Velocity,
    depth: &DepthImage,
    [x, y]: [usize; 2],
    typical_m: f64,
) -> Shift {
    let [ray_x, ray_y] = camera.undistort(x as f64, y as f64);
    let ray = Vector3::new(ray_x, ray_y, 1.0);
    let own_m = depth.metres(x.min(camera.width - 1), y.min(camera.height - 1)).map_or(typical_m, f64::from);
    let point = ray * own_m;
    // The lens model does not return exactly to the pixel from which the ray came.
    let [own_x, own_y] = camera.distort(ray_x, ray_y);
    let seen_at = |seconds: &dyn Fn(f64) -> f64| {
        let seen = when_read(&point, velocity, camera, seconds);
        if seen.z <= 0.0 {
            return ([0.0; 2], 0.0);
        }
        let [x, y] = camera.distort(seen.x / seen.z, seen.y / seen.z);
        ([(x - own_x) as f32, (y - own_y) as f32], (own_m - seen.z) as f32)
    };
    let (color, _) = seen_at(&|row| times.color.seconds(row));
    let (in_depth, deeper_m) = seen_at(&|row| times.depth_seconds(row));
    Shift { color, depth: in_depth, deeper_m }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::se3_exp;
    use nalgebra::Point3;

    /// Renders a wall 2 m ahead with a pattern, each row at its time; returns colour and depth.
    fn rolling_wall(camera: &Camera, times: &FrameTimes, velocity: &Velocity) -> (RgbImage, DepthImage) {
        let mut color = Image::new(camera.width, camera.height);
        let mut depth = DepthImage { raw: Image::new(camera.width, camera.height), metres_per_unit: 0.0002 };
        for y in 0..camera.height {
            for (seconds, is_color) in [(times.color.seconds(y as f64), true), (times.depth_seconds(y as f64), false)] {
                let t_world_cam = se3_exp(&(velocity * seconds));
                for x in 0..camera.width {
                    let [ray_x, ray_y] = camera.undistort(x as f64, y as f64);
                    let (from, to) = (t_world_cam * Point3::origin(), t_world_cam * Point3::new(ray_x, ray_y, 1.0));
                    let z = (2.0 - from.z) / (to.z - from.z);
                    let hit = from + (to - from) * z;
                    if is_color {
                        color.row_mut(y)[x] = pattern(&hit);
                    } else {
                        depth.raw.row_mut(y)[x] = (z * 5000.0).round() as u16;
                    }
                }
            }
        }
        (color, depth)
    }

    fn pattern(p: &Point3<f64>) -> [u8; 3] {
        [p.x, p.y, p.x + p.y].map(|v| (127.0 + 100.0 * (4.0 * v).sin()) as u8)
    }

    #[test]
    fn the_corrected_images_are_those_of_a_global_shutter() {
        let mut camera =
            Camera::pinhole(320, 240, 260.0, 260.0, 160.0, 120.0).with_distortion([0.1, -0.2, 0.0, 0.0, 0.0]);
        (camera.readout_ms, camera.depth_delay_ms) = (Some(30.0), Some(5.0));
        let times = FrameTimes::new(&camera);
        let velocity = Velocity::new(0.3, -0.2, 0.4, 0.3, 1.0, 0.5);
        let (color, depth) = rolling_wall(&camera, &times, &velocity);
        let (global_color, global_depth) = rolling_wall(&camera, &FrameTimes::default(), &velocity);
        let shift = RowShift::new(&camera, &times, &velocity, &depth).unwrap();
        let (corrected, corrected_depth) = (shift.corrected_color(&color), shift.corrected_depth(&depth));
        let (mut before, mut after, mut before_m, mut after_m) = (0.0, 0.0, 0.0, 0.0);
        for y in 16..224 {
            for x in 16..304 {
                let difference = |image: &RgbImage| -> f64 {
                    let (a, b) = (image.get(x, y).unwrap(), global_color.get(x, y).unwrap());
                    a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs()).sum()
                };
                let deeper =
                    |image: &DepthImage| f64::from(image.metres(x, y).unwrap() - global_depth.metres(x, y).unwrap());
                (before, after) = (before + difference(&color), after + difference(&corrected));
                (before_m, after_m) = (before_m + deeper(&depth).abs(), after_m + deeper(&corrected_depth).abs());
            }
        }
        assert!(after < 0.2 * before, "colour: {after} after, {before} before");
        assert!(after_m < 0.1 * before_m, "depth: {after_m} after, {before_m} before");
    }

    #[test]
    fn the_images_of_one_instant_are_not_touched() {
        let camera = Camera::pinhole(320, 240, 260.0, 260.0, 160.0, 120.0);
        let velocity = Velocity::new(0.3, -0.2, 0.4, 0.3, 1.0, 0.5);
        let (_, depth) = rolling_wall(&camera, &FrameTimes::default(), &velocity);
        assert!(RowShift::new(&camera, &FrameTimes::new(&camera), &velocity, &depth).is_none());
    }
}
