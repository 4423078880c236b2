//! A keyframe patch: depth and colour of a keyframe on a coarse grid, without depth edges, with moving cells marked.
//!
//! In: a frame, and its pixels that move. Out: cells with depth, in the camera frame. A patch has no pose of its own: it follows
//! the pose of its keyframe.

use nalgebra::Point3;

use crate::camera::Camera;
use crate::dense::DenseConfig;
use crate::image::{DepthImage, RgbImage};

/// Depth unit of a cell, m: half a millimetre, less than the depth step of any sensor.
const UNIT_M: f32 = 0.0005;
/// Bit that marks a cell whose surface moves.
const MOVING: u16 = 1 << 15;

/// The grid of cells that all patches of a camera share, and the viewing ray of each cell.
#[derive(Clone, Debug, PartialEq)]
pub struct CellGrid {
    columns: usize,
    rows: usize,
    stride_px: usize,
    camera: Camera,
    /// x = X/Z and y = Y/Z of each cell's centre, undistorted.
    rays: Vec<[f32; 2]>,
    /// Least and greatest x and y: beyond them the lens model folds back into the image.
    bounds: [[f32; 2]; 2],
}

impl CellGrid {
    /// Returns the grid of cells of `stride_px` pixels in the images of a camera.
    pub fn new(camera: &Camera, stride_px: usize) -> Self {
        let stride_px = stride_px.max(1);
        let (columns, rows) = (camera.width / stride_px, camera.height / stride_px);
        let middle = |cell: usize| (cell * stride_px) as f64 + 0.5 * (stride_px - 1) as f64;
        let ray = |i: usize| camera.undistort(middle(i % columns), middle(i / columns)).map(|v| v as f32);
        let rays: Vec<[f32; 2]> = (0..columns * rows).map(ray).collect();
        let bounds = [0, 1].map(|axis| {
            let range = rays.iter().map(|ray| ray[axis]).fold([f32::MAX, f32::MIN], |[a, b], v| [a.min(v), b.max(v)]);
            let margin = 0.5 * stride_px as f32 / camera.fx.min(camera.fy) as f32;
            [range[0] - margin, range[1] + margin]
        });
        Self { columns, rows, stride_px, camera: camera.clone(), rays, bounds }
    }

    /// Returns the number of cells in a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Returns the number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the pixels along each side of a cell.
    pub fn stride_px(&self) -> usize {
        self.stride_px
    }

    /// Returns the camera.
    pub(crate) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns the viewing ray of each cell, (X/Z, Y/Z), row-major.
    pub fn rays(&self) -> &[[f32; 2]] {
        &self.rays
    }

    /// Returns the centre of a cell, px of the raw image.
    pub(crate) fn middle_px(&self, cell: usize) -> [f32; 2] {
        let half = 0.5 * (self.stride_px - 1) as f32;
        [cell % self.columns, cell / self.columns].map(|at| (at * self.stride_px) as f32 + half)
    }

    /// Returns the position of a point of the camera frame on the grid, in cells; the centre of the first cell is (0, 0). `None`
    /// behind the camera or outside the grid.
    pub fn project(&self, p: &Point3<f32>) -> Option<[f32; 2]> {
        if p.z <= 0.0 {
            return None;
        }
        let (x, y) = (p.x / p.z, p.y / p.z);
        if [x, y].iter().zip(&self.bounds).any(|(v, [low, high])| v < low || v > high) {
            return None;
        }
        let [u, v] = self.camera.distort(f64::from(x), f64::from(y));
        let half = 0.5 * (self.stride_px - 1) as f64;
        let (column, row) = ((u - half) / self.stride_px as f64, (v - half) / self.stride_px as f64);
        let inside = column > -0.5 && row > -0.5 && column < self.columns as f64 - 0.5 && row < self.rows as f64 - 0.5;
        inside.then_some([column as f32, row as f32])
    }
}

/// The measurement of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reading {
    /// Depth along the optical axis, m.
    pub depth_m: f32,
    /// Whether the surface moves: the space before it is free, but the surface stays out of the map.
    pub moves: bool,
}

/// Depth, colour and class of the cells of one keyframe; made by [`KeyframePatch::extract`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyframePatch {
    /// Depth in [`UNIT_M`] and the mark [`MOVING`]; 0 where nothing was measured, or at an edge. Row-major.
    pub(crate) depth: Vec<u16>,
    /// Mean colour of the cell's pixels.
    pub(crate) color: Vec<[u8; 3]>,
    /// Class of each cell's surface, 0 where it is unknown; empty if no detector searched for classes.
    pub(crate) class: Vec<u8>,
}

impl KeyframePatch {
    /// Extracts the patch of a frame; `moves(position, edge)` returns whether a position of the image, px, is within `edge` px of
    /// something that moves.
    pub fn extract(
        config: &DenseConfig,
        grid: &CellGrid,
        color: &RgbImage,
        depth: &DepthImage,
        moves: impl Fn([f32; 2], f32) -> bool,
    ) -> Self {
        let rough = cell_depths(config, grid, depth);
        let depths_m = smoothed(config, grid, &rough);
        let mut cells = Vec::with_capacity(depths_m.len());
        for (i, &z) in depths_m.iter().enumerate() {
            let (column, row) = (i % grid.columns, i / grid.columns);
            let kept = z > 0.0 && !is_edge(config, grid, &rough, column, row);
            // A moving cell is marked even without depth, because its colour must not be used.
            let mark = if moves(grid.middle_px(i), config.edge_px) { MOVING } else { 0 };
            cells.push(if kept { ((z / UNIT_M + 0.5) as u16).min(MOVING - 1) | mark } else { mark });
        }
        Self { depth: cells, color: cell_colors(grid, color), class: Vec::new() }
    }

    /// Returns a patch of static cells with exact depths, m (0 where nothing was measured), of one colour.
    #[cfg(test)]
    pub(crate) fn of_depths(depths_m: impl IntoIterator<Item = f32>, color: [u8; 3]) -> Self {
        let units = |z: f32| ((z / UNIT_M + 0.5) as u16).min(MOVING - 1);
        let depth: Vec<u16> = depths_m.into_iter().map(units).collect();
        Self { color: vec![color; depth.len()], depth, class: Vec::new() }
    }

    /// Returns the patch with classes; `class(position)` returns the class at a position of the image, px, 0 where it is unknown.
    pub(crate) fn with_classes(mut self, grid: &CellGrid, class: impl Fn([f32; 2]) -> u8) -> Self {
        let of_cell = |cell| self.surface_m(cell).map_or(0, |_| class(grid.middle_px(cell)));
        self.class = (0..self.depth.len()).map(of_cell).collect();
        self
    }

    /// Returns the memory that it takes, bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.depth) + size_of_val(&*self.color) + self.class.len()
    }

    /// Returns the measurement of a cell; `None` where there is no depth.
    #[inline]
    pub(crate) fn reading(&self, cell: usize) -> Option<Reading> {
        let value = *self.depth.get(cell)?;
        let steps = value & !MOVING;
        (steps > 0).then(|| Reading { depth_m: f32::from(steps) * UNIT_M, moves: value & MOVING != 0 })
    }

    /// Returns whether a cell shows something that moves, with or without depth.
    pub fn moves(&self, cell: usize) -> bool {
        self.depth.get(cell).is_some_and(|value| value & MOVING != 0)
    }

    /// Returns the depth of a cell's static surface, m; `None` if there is none.
    #[inline]
    pub(crate) fn surface_m(&self, cell: usize) -> Option<f32> {
        self.reading(cell).filter(|reading| !reading.moves).map(|reading| reading.depth_m)
    }

    /// Returns the mean colour of a cell's pixels.
    pub fn color(&self, cell: usize) -> [u8; 3] {
        self.color.get(cell).copied().unwrap_or_default()
    }

    /// Returns the class of a cell's surface, 0 where it is unknown; `None` if no detector searched for classes.
    #[inline]
    pub(crate) fn class(&self, cell: usize) -> Option<u8> {
        self.class.get(cell).copied()
    }

    /// Returns the static points in the camera frame, m, with colour, up to a depth of `max_range_m`.
    pub fn points<'a>(
        &'a self,
        grid: &'a CellGrid,
        max_range_m: f32,
    ) -> impl Iterator<Item = (Point3<f32>, [u8; 3])> + 'a {
        grid.rays.iter().enumerate().filter_map(move |(cell, [x, y])| {
            let z = self.surface_m(cell).filter(|z| *z <= max_range_m)?;
            Some((Point3::new(x * z, y * z, z), self.color(cell)))
        })
    }
}

/// Returns the depth difference that is an edge at depth `z`, m.
fn edge_step_m(config: &DenseConfig, z: f32) -> f32 {
    config.edge_step_m + config.edge_step_share * z
}

/// Returns the mean depth of each cell, m; 0 where its pixels have no depth or an edge.
fn cell_depths(config: &DenseConfig, grid: &CellGrid, depth: &DepthImage) -> Vec<f32> {
    let mut depths_m = Vec::with_capacity(grid.columns * grid.rows);
    for row in 0..grid.rows {
        let lines: Vec<&[u16]> = (0..grid.stride_px).map(|dy| depth.raw.row(row * grid.stride_px + dy)).collect();
        for column in 0..grid.columns {
            let (mut sum, mut count, mut near, mut far) = (0u32, 0u32, u16::MAX, 0u16);
            for line in &lines {
                for &raw in &line[column * grid.stride_px..(column + 1) * grid.stride_px] {
                    if raw > 0 {
                        (sum, count) = (sum + u32::from(raw), count + 1);
                        (near, far) = (near.min(raw), far.max(raw));
                    }
                }
            }
            let z = sum as f32 / count.max(1) as f32 * depth.metres_per_unit;
            let spread = f32::from(far.saturating_sub(near)) * depth.metres_per_unit;
            depths_m.push(if count > 0 && spread <= edge_step_m(config, z) { z } else { 0.0 });
        }
    }
    depths_m
}

/// Returns the depth averaged along rows, then along columns, over differences within the noise (a bilateral filter in two passes,
/// after KinectFusion, ISMAR 2011, section 3.1).
fn smoothed(config: &DenseConfig, grid: &CellGrid, depths_m: &[f32]) -> Vec<f32> {
    let average = |from: &[f32], step: usize, position: &dyn Fn(usize) -> (usize, usize)| -> Vec<f32> {
        let mean = |(i, &z): (usize, &f32)| {
            let (at, length) = position(i);
            let half = (config.smooth_px_per_m * z / grid.stride_px as f32 + 0.5) as usize;
            // The same number of cells on both sides, so that slopes keep their position.
            let half = half.min(at).min(length - 1 - at);
            if z == 0.0 || half == 0 {
                return z;
            }
            let noise = config.smooth_noise_per_m * z * z;
            let (mut sum, mut count) = (z, 1.0);
            for k in 1..=half {
                let (before, after) = (from[i - k * step], from[i + k * step]);
                if before == 0.0 || after == 0.0 || (before + after - 2.0 * z).abs() > 2.0 * noise {
                    break;
                }
                sum += before + after;
                count += 2.0;
            }
            sum / count
        };
        from.iter().enumerate().map(mean).collect()
    };
    let rows = average(depths_m, 1, &|i| (i % grid.columns, grid.columns));
    average(&rows, grid.columns, &|i| (i / grid.columns, grid.rows))
}

/// Returns whether the depth around a cell has a step: sensors blur such edges over both sides.
fn is_edge(config: &DenseConfig, grid: &CellGrid, depths_m: &[f32], column: usize, row: usize) -> bool {
    let z = depths_m[row * grid.columns + column];
    let step = edge_step_m(config, z);
    let (left, right) = (column.saturating_sub(1), (column + 2).min(grid.columns));
    (row.saturating_sub(1)..(row + 2).min(grid.rows)).any(|r| {
        depths_m[r * grid.columns + left..r * grid.columns + right].iter().any(|&n| n > 0.0 && (n - z).abs() > step)
    })
}

/// Returns the mean colour of each cell.
fn cell_colors(grid: &CellGrid, color: &RgbImage) -> Vec<[u8; 3]> {
    let mut means = Vec::with_capacity(grid.columns * grid.rows);
    let pixels = (grid.stride_px * grid.stride_px) as u32;
    for row in 0..grid.rows {
        let lines: Vec<&[[u8; 3]]> = (0..grid.stride_px).map(|dy| color.row(row * grid.stride_px + dy)).collect();
        for column in 0..grid.columns {
            let mut sum = [pixels / 2; 3];
            for line in &lines {
                for rgb in &line[column * grid.stride_px..(column + 1) * grid.stride_px] {
                    sum.iter_mut().zip(rgb).for_each(|(sum, v)| *sum += u32::from(*v));
                }
            }
            means.push(sum.map(|sum| (sum / pixels) as u8));
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::scene;
    use crate::image::Image;

    #[test]
    fn a_patch_keeps_surfaces_marks_what_moves_and_drops_edges() {
        let (config, camera) = (DenseConfig::default(), scene::camera());
        let grid = CellGrid::new(&camera, config.stride_px);
        // A wall at 3 m with a box in front of it at 1 m, in millimetres.
        let mut raw = Image::new(camera.width, camera.height);
        for y in 0..camera.height {
            raw.row_mut(y).iter_mut().enumerate().for_each(|(x, d)| *d = if x < 80 { 1000 } else { 3000 });
        }
        let depth = DepthImage { raw, metres_per_unit: 0.001 };
        let color = RgbImage::new(camera.width, camera.height);
        let patch = KeyframePatch::extract(&config, &grid, &color, &depth, |[x, _], _| x < 20.0);
        let row = 30 * grid.columns();
        let near = |z: Option<f32>, wanted: f32| assert!(z.is_some_and(|z| (z - wanted).abs() < 1e-4), "{z:?}");
        assert!(patch.reading(row + 5).is_some_and(|reading| reading.moves));
        assert_eq!(patch.surface_m(row + 5), None);
        near(patch.surface_m(row + 30), 1.0);
        assert_eq!((patch.reading(row + 39), patch.reading(row + 40)), (None, None), "the edge");
        near(patch.surface_m(row + 60), 3.0);
    }

    #[test]
    fn a_point_on_the_ray_of_a_cell_projects_to_it() {
        let mut camera = scene::camera();
        camera.distortion = [0.04, -0.1, -0.0007, -0.0002, 0.05];
        let grid = CellGrid::new(&camera, 4);
        for cell in [0, 17, grid.columns() * grid.rows() - 1] {
            let [x, y] = grid.rays()[cell];
            let [column, row] = grid.project(&Point3::new(2.0 * x, 2.0 * y, 2.0)).unwrap();
            assert!((column - (cell % grid.columns()) as f32).abs() < 1e-2, "{cell}: {column}");
            assert!((row - (cell / grid.columns()) as f32).abs() < 1e-2, "{cell}: {row}");
        }
        assert_eq!(grid.project(&Point3::new(0.0, 0.0, -1.0)), None);
        // The lens model maps these back to near the centre.
        for x in [2.0, 3.0, 5.0] {
            assert_eq!(grid.project(&Point3::new(x, 0.1, 1.0)), None, "{x}");
        }
    }
}
