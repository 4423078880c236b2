//! Signs that a result may be wrong although no stage reports an error: depth that cannot be right, images that stand still while the
//! pose moves, a plane that fills the view, gaps in time.
//!
//! In: the images of a frame, its pose, and those of the frame before, at about 3000 pixels. Out: a [`FrameHealth`]. Nothing here changes
//! a pose. The limits are chosen on parts of recordings of TUM and Bonn and on rendered worlds, which stay below them but for single frames
//! (crate `yfslam-bench`, topic `faults`).

use nalgebra::{Matrix3, Vector3};

use crate::context::SensorModel;
use crate::geometry::Pose;
use crate::image::{DepthImage, GrayImage};

/// Columns and rows of the pixels that are compared.
const GRID: [usize; 2] = [64, 48];
/// Share of pixels with depth below which depth is missing.
const MIN_MEASURED: f64 = 0.1;
/// Share of pixels that have the largest reading of the image above which readings are saturated.
const MAX_SATURATED: f64 = 0.2;
/// Median second difference of the inverse depth of neighbouring pixels above which depth is noise, 1/m: five times that of structured
/// light, whose standard deviation is about 0.003 z² (Khoshelham and Elberink, Sensors 2012).
const MAX_NOISE_PER_M: f32 = 0.03;
/// Share of the pixels on one plane, and their relative distance from it, from which on a plane fills the view.
const PLANE_SHARE: f64 = 0.97;
const PLANE_TOLERANCE: f64 = 0.02;
/// Share of features whose depth contradicts their position, and the number of features, from which on depth contradicts the images.
const MAX_CONTRADICTED: f64 = 0.4;
const MIN_FEATURES: usize = 40;
/// Difference of two depths of one point, as a share, that is a contradiction, and the share of pixels.
const DEPTH_TOLERANCE: f64 = 0.1;
const MAX_DEPTH_JUMPED: f64 = 0.5;
/// Motion in the image that the pose must predict for a pixel to be compared, px, and the change of grey level that it must cause.
const MIN_FLOW_PX: f64 = 2.0;
const MIN_CHANGE: i16 = 20;
/// Share of pixels that stand still although the pose moves, and the number of pixels that are compared.
const MAX_STILL: f64 = 0.5;
const MIN_COMPARED: usize = 60;
/// A gap in time is this many usual intervals, and at least so long, ns.
const GAP_INTERVALS: i64 = 5;
const MIN_GAP_NS: i64 = 250_000_000;

/// Signs that the result of a frame may be wrong although no stage reports an error. For good images they are false but for
/// single frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct FrameHealth {
    /// Less than a tenth of the pixels has depth.
    pub depth_missing: bool,
    /// More than a fifth of the readings are the largest one of the image: the sensor is saturated, or reports its limit as a depth.
    pub depth_saturated: bool,
    /// Depths of neighbouring pixels have nothing to do with each other.
    pub depth_noisy: bool,
    /// The depths of matched features, or of most of the image, contradict the motion of the images: another scale, or another time.
    pub depth_contradicts: bool,
    /// One plane fills the view: a wall, or a screen, on which images may move.
    pub plane_fills_view: bool,
    /// Much of the image stands still although the pose moves: what moves is the scene, or something is on the lens.
    pub stands_still: bool,
    /// The image is the same as the one before, to the bit: a camera that has stopped.
    pub image_repeated: bool,
    /// Much more time than usual has passed since the frame before: what happened meanwhile was not seen.
    pub time_gap: bool,
}

/// Compares each frame with the one before.
#[derive(Debug, Default)]
pub(super) struct HealthCheck {
    /// The grey image of the frame before.
    gray: Vec<u8>,
    /// Time of the frame before, and the usual interval, ns.
    last_ns: Option<i64>,
    usual_ns: Option<i64>,
    /// Pose of the frame before, if it was tracked and the map has not been corrected since.
    t_cam_world: Option<Pose>,
    /// Depths of the frame before at the compared pixels, m; 0 where nothing was measured.
    depths: Vec<f32>,
    /// Depths of this frame.
    current: Vec<f32>,
    /// The compared pixels of depth image and grey image.
    of_depth: Grid,
    of_gray: Grid,
}

/// The compared pixels of an image: the middle of each field of a grid.
#[derive(Debug, Default)]
struct Grid {
    /// Columns and rows of the image and of the grid.
    size: [usize; 2],
    sides: [usize; 2],
    /// Column and row of each pixel in the image.
    pixels: Vec<[usize; 2]>,
}

/// What is known about a frame after it was tracked.
pub(super) struct Evidence<'a> {
    pub timestamp_ns: i64,
    pub gray: &'a GrayImage,
    /// `None` where depth does not come as an image.
    pub depth: Option<&'a DepthImage>,
    /// `None` if it is not known.
    pub t_cam_world: Option<Pose>,
    /// Whether a loop closure has moved the map, so that the pose before does not compare.
    pub map_moved: bool,
    /// Features whose depth contradicts their position in the image, of all with depth.
    pub contradicted: [usize; 2],
}

impl HealthCheck {
    /// Checks a frame and keeps it for the next one.
    pub(super) fn check(&mut self, sensor: &SensorModel, now: &Evidence) -> FrameHealth {
        let mut health = FrameHealth { time_gap: self.has_gap(now.timestamp_ns), ..FrameHealth::default() };
        let [contradicted, all] = now.contradicted;
        health.depth_contradicts = all >= MIN_FEATURES && contradicted as f64 > MAX_CONTRADICTED * all as f64;
        health.image_repeated = !self.gray.is_empty() && self.gray == now.gray.data();
        self.current.clear();
        self.of_gray.fit(now.gray.width(), now.gray.height());
        if let Some(depth) = now.depth {
            self.check_depth(depth, &mut health);
            health.plane_fills_view = self.is_plane();
        }
        let motion = now.t_cam_world.zip(self.t_cam_world).filter(|_| !now.map_moved);
        if let Some((current, last)) = motion.filter(|_| !health.time_gap && self.gray.len() == now.gray.data().len()) {
            self.compare(sensor, now.gray, &(current * last.inverse()), &mut health);
        }
        self.gray.clear();
        self.gray.extend_from_slice(now.gray.data());
        std::mem::swap(&mut self.depths, &mut self.current);
        self.t_cam_world = now.t_cam_world;
        health
    }

    fn has_gap(&mut self, timestamp_ns: i64) -> bool {
        let last = self.last_ns.replace(timestamp_ns);
        let Some(interval) = last.map(|last| timestamp_ns.saturating_sub(last)) else { return false };
        let usual = self.usual_ns.unwrap_or(interval);
        let limit = usual.saturating_mul(GAP_INTERVALS);
        // A new rate becomes the usual one after a while.
        self.usual_ns = Some(usual.saturating_add(interval.min(limit).saturating_sub(usual) / 8));
        interval > limit.max(MIN_GAP_NS)
    }

    /// Looks up the depths of the compared pixels, and checks them for themselves.
    fn check_depth(&mut self, depth: &DepthImage, health: &mut FrameHealth) {
        let raw = &depth.raw;
        let (mut measured, mut largest, mut count) = (0usize, 0u16, 0usize);
        let (mut compared, mut noisy) = (0usize, 0usize);
        self.of_depth.fit(raw.width(), raw.height());
        for &[x, y] in &self.of_depth.pixels {
            let at = |x: usize| raw.get(x, y).copied().unwrap_or(0);
            let value = at(x);
            self.current.push(f32::from(value) * depth.metres_per_unit);
            measured += usize::from(value > 0);
            if value >= largest {
                count = if value == largest { count + 1 } else { 1 };
                largest = value;
            }
            let [left, right] = [x.wrapping_sub(1), x + 1].map(at);
            if left > 0 && value > 0 && right > 0 {
                let inverse = |raw: u16| 1.0 / (f32::from(raw) * depth.metres_per_unit);
                compared += 1;
                noisy += usize::from((inverse(left) - 2.0 * inverse(value) + inverse(right)).abs() > MAX_NOISE_PER_M);
            }
        }
        let all = self.current.len() as f64;
        health.depth_missing = (measured as f64) < MIN_MEASURED * all;
        health.depth_saturated = largest > 0 && count as f64 > MAX_SATURATED * all && measured > count;
        // The median is above the limit if half of the differences are.
        health.depth_noisy = compared >= MIN_COMPARED && noisy >= compared.div_ceil(2);
    }

    /// Returns whether one plane fills the view: then the inverse depth is an affine function of the pixel.
    fn is_plane(&self) -> bool {
        let points = || {
            let pixels = self.of_gray.pixels.iter().zip(&self.current).filter(|(_, z)| **z > 0.0);
            pixels.map(|([x, y], z)| (*x as f64, *y as f64, 1.0 / f64::from(*z)))
        };
        let (mut sums, mut right) = ([0.0; 6], [0.0; 3]);
        for (x, y, inverse) in points() {
            let terms = [1.0, x, y, x * x, x * y, y * y];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            right.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term * inverse);
        }
        let [measured, x, y, xx, xy, yy] = sums;
        if measured < 0.5 * self.current.len() as f64 {
            return false;
        }
        let normal = Matrix3::new(xx, xy, x, xy, yy, y, x, y, measured);
        let right = Vector3::new(right[1], right[2], right[0]);
        let Some(plane) = normal.try_inverse().map(|inverse| inverse * right) else { return false };
        let is_near = |(x, y, inverse): &(f64, f64, f64)| {
            (plane.x * x + plane.y * y + plane.z - inverse).abs() <= PLANE_TOLERANCE * inverse
        };
        points().filter(is_near).count() as f64 >= PLANE_SHARE * measured
    }

    /// Compares the image and its depths with those of the frame before, moved by `motion` from the camera then to the camera now.
    fn compare(&self, sensor: &SensorModel, gray: &GrayImage, motion: &Pose, health: &mut FrameHealth) {
        let (width, height) = (gray.width(), gray.height());
        let (mut still, mut moved, mut agree, mut jumped) = (0usize, 0usize, 0usize, 0usize);
        let (rotation, translation) = (motion.rotation.to_rotation_matrix(), motion.translation.vector);
        for (&[x, y], &z) in self.of_gray.pixels.iter().zip(&self.depths).filter(|(_, z)| **z > 0.0) {
            let before = sensor.pinhole.unproject(x as f64, y as f64, f64::from(z));
            let now = rotation * before.coords + translation;
            if now.z <= 0.0 {
                continue;
            }
            let [u, v] = sensor.pinhole.project(&now);
            let flow = [u - x as f64, v - y as f64];
            let depth = self.of_gray.nearest(u, v).and_then(|pixel| self.current.get(pixel)).filter(|z| **z > 0.0);
            if let Some(&depth) = depth {
                let off = (f64::from(depth) / now.z - 1.0).abs();
                if off > DEPTH_TOLERANCE { jumped += 1 } else { agree += 1 }
            }
            if libm::hypot(flow[0], flow[1]) < MIN_FLOW_PX {
                continue;
            }
            // What is at this pixel now was there before, if the motion is right.
            let from = [x as f64 - flow[0] + 0.5, y as f64 - flow[1] + 0.5];
            if !(from[0] >= 0.0 && from[1] >= 0.0 && from[0] < width as f64 && from[1] < height as f64) {
                continue;
            }
            let from = from.map(|side| side as usize);
            let then = |x: usize, y: usize| self.gray.get(y * width + x).map(|g| i16::from(*g));
            let (Some(stood), Some(seen), Some(middle)) = (then(x, y), gray.get(x, y), then(from[0], from[1])) else {
                continue;
            };
            // Most of the image is even, and says nothing.
            if (stood - middle).abs() < MIN_CHANGE {
                continue;
            }
            let seen = i16::from(*seen);
            // The pose is not exact to the pixel: the most similar pixel around counts.
            let least = |value: i16| {
                let mut least = i16::MAX;
                for row in from[1].saturating_sub(1)..(from[1] + 2).min(height) {
                    for column in from[0].saturating_sub(1)..(from[0] + 2).min(width) {
                        least = then(column, row).map_or(least, |then| least.min((value - then).abs()));
                    }
                }
                least
            };
            if least(stood) >= MIN_CHANGE {
                let [if_still, if_moved] = [(seen - stood).abs(), least(seen)];
                still += usize::from(if_moved >= MIN_CHANGE && 4 * if_still <= if_moved);
                moved += usize::from(if_still >= MIN_CHANGE && 4 * if_moved <= if_still);
            }
        }
        health.stands_still = still + moved >= MIN_COMPARED && still as f64 > MAX_STILL * (still + moved) as f64;
        health.depth_contradicts |=
            agree + jumped >= 5 * MIN_COMPARED && jumped as f64 > MAX_DEPTH_JUMPED * (agree + jumped) as f64;
    }
}

impl Grid {
    /// Fits the grid to an image.
    fn fit(&mut self, width: usize, height: usize) {
        if self.size == [width, height] {
            return;
        }
        (self.size, self.sides) = ([width, height], [width.min(GRID[0]), height.min(GRID[1])]);
        let middle = |cell: usize, axis: usize| (2 * cell + 1) * self.size[axis] / (2 * self.sides[axis]);
        let [columns, rows] = self.sides;
        self.pixels =
            (0..rows).flat_map(|row| (0..columns).map(move |column| [middle(column, 0), middle(row, 1)])).collect();
    }

    /// Returns which pixel is nearest to an image point, if that lies in the image.
    #[inline]
    fn nearest(&self, u: f64, v: f64) -> Option<usize> {
        let cell = |at: f64, axis: usize| {
            let cell = at * self.sides[axis] as f64 / self.size[axis] as f64;
            (cell >= 0.0 && cell < self.sides[axis] as f64).then_some(cell as usize)
        };
        Some(cell(v, 1)? * self.sides[0] + cell(u, 0)?)
    }
}

#[cfg(test)]
mod tests;
