//! The features of one frame: undistorted, with depth and trust, and a grid for the search by position.
//!
//! In: keypoints and descriptors of the grey image, the depth image, the camera. Out: [`FrameFeatures`].

use crate::camera::Camera;
use crate::features::rolling_shutter::{FrameTimes, Measured, Velocity};
use crate::features::{Descriptor, Features};
use crate::geometry::Pinhole;
use crate::image::DepthImage;

/// Columns of the search grid. Source: ORB-SLAM2.
const GRID_COLUMNS: usize = 64;
/// Rows of the search grid. Source: ORB-SLAM2.
const GRID_ROWS: usize = 48;

/// A feature of a frame: a keypoint with its depth and trust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature {
    /// Position in the distorted image, px.
    pub raw: [f32; 2],
    /// Undistorted column, px. With a rolling shutter, `u`, `v` and `depth_m` are those at the time of the middle row of the image.
    pub u: f32,
    /// Undistorted row, px.
    pub v: f32,
    /// Pyramid level, 0 is the finest.
    pub octave: u8,
    /// Orientation, rad.
    pub angle_rad: f32,
    /// Depth along the optical axis, m; `None` if it was not measured.
    pub depth_m: Option<f32>,
    /// Trust: the probability that the feature is static, in [0, 1]. With 0 it is used for neither the pose nor the map.
    pub trust: f32,
}

/// The features of a frame; descriptor `i` belongs to feature `i`.
#[derive(Clone, Debug, Default)]
pub struct FrameFeatures {
    /// Features.
    pub features: Vec<Feature>,
    /// Descriptors of the features.
    pub descriptors: Vec<Descriptor>,
    bounds: ImageBounds,
    /// Feature indices ordered by grid cell; cell `c` has `order[start[c]..start[c + 1]]`.
    order: Vec<u32>,
    start: Vec<u32>,
    /// The features as they were measured at the times of their rows; empty for a camera that is known to show one instant.
    measured: Vec<Measured>,
    times: FrameTimes,
    velocity: Option<Velocity>,
}

/// Extent of the undistorted image, px.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ImageBounds {
    /// Left border.
    pub u_min: f32,
    /// Right border.
    pub u_max: f32,
    /// Upper border.
    pub v_min: f32,
    /// Lower border.
    pub v_max: f32,
}

impl ImageBounds {
    /// Computes the bounding box of the undistorted image border.
    pub(crate) fn of(camera: &Camera) -> Self {
        let (w, h) = (camera.width as f64, camera.height as f64);
        let border = (0..=16).flat_map(|i| {
            let t = f64::from(i) / 16.0;
            [[t * w, 0.0], [t * w, h], [0.0, t * h], [w, t * h]]
        });
        let mut bounds = Self { u_min: f32::MAX, u_max: f32::MIN, v_min: f32::MAX, v_max: f32::MIN };
        for [x, y] in border {
            let [u, v] = camera.undistort_px(x, y);
            bounds.u_min = bounds.u_min.min(u as f32);
            bounds.u_max = bounds.u_max.max(u as f32);
            bounds.v_min = bounds.v_min.min(v as f32);
            bounds.v_max = bounds.v_max.max(v as f32);
        }
        bounds
    }

    /// Returns whether an undistorted position lies inside.
    pub(crate) fn contains(&self, u: f32, v: f32) -> bool {
        u >= self.u_min && u < self.u_max && v >= self.v_min && v < self.v_max
    }
}

impl FrameFeatures {
    /// Replaces the features by those of another frame, all with trust 1. Buffers are reused.
    pub(crate) fn fill(&mut self, extracted: &Features, depth: &DepthImage, camera: &Camera, bounds: ImageBounds) {
        self.bounds = bounds;
        self.descriptors.clone_from(&extracted.descriptors);
        self.features.clear();
        self.features.extend(extracted.key_points.iter().map(|k| {
            let [u, v] = camera.undistort_px(f64::from(k.x), f64::from(k.y));
            Feature {
                raw: [k.x, k.y],
                u: u as f32,
                v: v as f32,
                octave: k.octave,
                angle_rad: k.angle_rad,
                depth_m: depth.metres((k.x + 0.5) as usize, (k.y + 0.5) as usize),
                trust: 1.0,
            }
        }));
        self.measured.clear();
        self.times = FrameTimes::default();
        self.velocity = None;
        self.build_grid();
    }

    /// Copies features, descriptors and grid of another frame into the memory of this one, without what was measured at the times of the rows.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.features.clone_from(&other.features);
        self.descriptors.clone_from(&other.descriptors);
        self.bounds = other.bounds;
        self.order.clone_from(&other.order);
        self.start.clone_from(&other.start);
        self.measured.clear();
        (self.times, self.velocity) = (other.times, other.velocity);
    }

    /// Keeps positions and depths as they are now, as those measured at the times of their rows.
    pub(crate) fn keep_measured(&mut self, times: FrameTimes) {
        self.times = times;
        self.measured.clear();
        self.measured.extend(self.features.iter().map(|f| {
            let row = f.raw[1];
            Measured { u: f.u, v: f.v, row, depth_m: f.depth_m, depth_row: row }
        }));
    }

    /// Looks up the depths where the depth image shows the features, for a camera with that velocity.
    pub(crate) fn measure_depths(&mut self, velocity: &Velocity, camera: &Camera, depth: &DepthImage) {
        for measured in &mut self.measured {
            measured.measure_depth(&self.times, velocity, camera, depth);
        }
    }

    /// Notes the velocity of the camera, and brings all features to the time of the middle row. `depth_of` a feature stands for a depth that
    /// was not measured, m. The search grid stays as it is: after a small change of the velocity it is still right.
    pub(crate) fn move_to_middle_row(
        &mut self,
        velocity: &Velocity,
        pinhole: &Pinhole,
        depth_of: impl Fn(usize) -> f64,
    ) {
        self.velocity = Some(*velocity);
        if self.times.is_instant() {
            return;
        }
        for (i, (feature, measured)) in self.features.iter_mut().zip(&self.measured).enumerate() {
            let point = measured.point(&self.times, velocity, pinhole, depth_of(i));
            if point.z > 0.0 {
                let [u, v] = pinhole.project(&point);
                (feature.u, feature.v) = (u as f32, v as f32);
                feature.depth_m = measured.depth_m.map(|_| point.z as f32);
            }
        }
    }

    /// Returns whether the features are kept as they were measured.
    pub(crate) fn keeps_measured(&self) -> bool {
        !self.measured.is_empty()
    }

    /// When the rows of the images are read.
    pub(crate) fn times(&self) -> &FrameTimes {
        &self.times
    }

    /// Sets how the rows of the colour image and of the depth image are read, once that is known.
    pub(crate) fn set_row_times(&mut self, times: &FrameTimes) {
        (self.times.color, self.times.depth) = (times.color, times.depth);
    }

    /// The velocity to which the features were corrected last.
    pub(crate) fn velocity(&self) -> Option<&Velocity> {
        self.velocity.as_ref()
    }

    /// Returns a feature as it was measured, if that was kept.
    pub(crate) fn measured(&self, feature: usize) -> Option<&Measured> {
        self.measured.get(feature)
    }

    /// Makes frame features of existing features; `descriptors[i]` belongs to `features[i]`.
    #[cfg(any(test, feature = "persist"))]
    pub(crate) fn from_parts(features: Vec<Feature>, descriptors: Vec<Descriptor>, bounds: ImageBounds) -> Self {
        let mut frame = Self { features, descriptors, bounds, ..Default::default() };
        frame.build_grid();
        frame
    }

    /// Returns the number of features.
    pub(crate) fn len(&self) -> usize {
        self.features.len()
    }

    /// Calls `visit` with the index of each feature within `radius` (px, maximum norm) of (u, v) whose octave is in `octaves`.
    #[inline(always)]
    pub(crate) fn for_each_near(
        &self,
        u: f32,
        v: f32,
        radius: f32,
        octaves: std::ops::RangeInclusive<u8>,
        mut visit: impl FnMut(usize),
    ) {
        let b = &self.bounds;
        if self.start.is_empty()
            || !(u + radius >= b.u_min && u - radius < b.u_max && v + radius >= b.v_min && v - radius < b.v_max)
        {
            return;
        }
        let (c0, r0) = self.cell(u - radius, v - radius);
        let (c1, r1) = self.cell(u + radius, v + radius);
        for row in r0..=r1 {
            // The features of adjacent cells of a row have adjacent entries in `order`.
            let from = self.start[row * GRID_COLUMNS + c0] as usize;
            let to = self.start[row * GRID_COLUMNS + c1 + 1] as usize;
            for &i in &self.order[from..to] {
                let f = &self.features[i as usize];
                if octaves.contains(&f.octave) && (f.u - u).abs() <= radius && (f.v - v).abs() <= radius {
                    visit(i as usize);
                }
            }
        }
    }

    /// Returns column and row of the grid cell of a position, clamped to the grid.
    fn cell(&self, u: f32, v: f32) -> (usize, usize) {
        let b = &self.bounds;
        let column = (u - b.u_min) / (b.u_max - b.u_min) * GRID_COLUMNS as f32;
        let row = (v - b.v_min) / (b.v_max - b.v_min) * GRID_ROWS as f32;
        // The cast of a floating-point number saturates: negative numbers and NaN become 0.
        ((column as usize).min(GRID_COLUMNS - 1), (row as usize).min(GRID_ROWS - 1))
    }

    /// Sorts the features into the cells of the grid, by counting sort.
    pub(crate) fn build_grid(&mut self) {
        self.start.clear();
        self.start.resize(GRID_COLUMNS * GRID_ROWS + 1, 0);
        self.order.clear();
        self.order.resize(self.features.len(), 0);
        for i in 0..self.features.len() {
            let (c, r) = self.cell(self.features[i].u, self.features[i].v);
            self.start[r * GRID_COLUMNS + c + 1] += 1;
        }
        for c in 1..self.start.len() {
            self.start[c] += self.start[c - 1];
        }
        for i in (0..self.features.len()).rev() {
            let (c, r) = self.cell(self.features[i].u, self.features[i].v);
            let cell = r * GRID_COLUMNS + c;
            // Each cell is filled from its end: `start[cell + 1]` decreases to the beginning of the cell; the shift below corrects this.
            self.start[cell + 1] -= 1;
            self.order[self.start[cell + 1] as usize] = i as u32;
        }
        // Each entry now holds the beginning of the cell before it, so all entries are shifted by one.
        self.start.remove(0);
        self.start.push(self.features.len() as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::KeyPoint;
    use crate::image::Image;
    use proptest::prelude::*;

    fn camera() -> Camera {
        Camera::pinhole(640, 480, 517.3, 516.5, 318.6, 255.3)
            .with_distortion([0.262383, -0.953104, -0.005358, 0.002628, 1.163314])
    }

    proptest! {
        #[test]
        fn grid_search_finds_what_a_full_scan_finds(
            points in prop::collection::vec((0f32..640.0, 0f32..480.0, 0u8..8), 0..200),
            u in -50f32..700.0, v in -50f32..550.0, radius in 0f32..120.0, low in 0u8..8,
        ) {
            let camera = camera();
            let extracted = Features {
                key_points: points.iter().map(|&(x, y, octave)| KeyPoint { x, y, octave, ..Default::default() }).collect(),
                descriptors: vec![Descriptor::default(); points.len()],
            };
            let depth = DepthImage { raw: Image::new(640, 480), metres_per_unit: 0.001 };
            let mut frame = FrameFeatures::default();
            frame.fill(&extracted, &depth, &camera, ImageBounds::of(&camera));
            let mut found = Vec::new();
            frame.for_each_near(u, v, radius, low..=low + 1, |i| found.push(i));
            found.sort_unstable();
            let expected: Vec<usize> = (0..frame.len()).filter(|&i| {
                let f = &frame.features[i];
                (low..=low + 1).contains(&f.octave) && (f.u - u).abs() <= radius && (f.v - v).abs() <= radius
            }).collect();
            prop_assert_eq!(found, expected);
        }
    }
}
