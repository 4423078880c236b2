//! The viewing rays of all pixels, lens distortion included, in tiles.
//!
//! In: a [`Camera`]. Out: normalised image coordinates (x = X/Z, y = Y/Z) per pixel, and their range per tile. Rays of the columns
//! and rows that pad the image to whole tiles are extrapolated; their pixels are rendered and dropped.

use rayon::prelude::*;
use yfslam::Camera;

/// Side of a tile, px.
pub const TILE: usize = 16;

/// Range of normalised coordinates of a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Least and greatest x.
    pub x: [f32; 2],
    /// Least and greatest y.
    pub y: [f32; 2],
}

impl Rect {
    /// The range of everything.
    pub const EVERYTHING: Self = Self { x: [f32::NEG_INFINITY, f32::INFINITY], y: [f32::NEG_INFINITY, f32::INFINITY] };
    /// The range of nothing.
    pub const EMPTY: Self = Self { x: [f32::INFINITY, f32::NEG_INFINITY], y: [f32::INFINITY, f32::NEG_INFINITY] };

    fn include(&mut self, x: f32, y: f32) {
        self.x = [self.x[0].min(x), self.x[1].max(x)];
        self.y = [self.y[0].min(y), self.y[1].max(y)];
    }

    /// Returns the rectangle with a border of the given widths in x and y.
    pub fn grown(self, [x, y]: [f32; 2]) -> Self {
        Self { x: [self.x[0] - x, self.x[1] + x], y: [self.y[0] - y, self.y[1] + y] }
    }

    /// Returns the smallest rectangle around both.
    pub fn union(self, other: Self) -> Self {
        Self {
            x: [self.x[0].min(other.x[0]), self.x[1].max(other.x[1])],
            y: [self.y[0].min(other.y[0]), self.y[1].max(other.y[1])],
        }
    }

    /// Returns whether the rectangles share a point.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.x[0] <= other.x[1] && other.x[0] <= self.x[1] && self.y[0] <= other.y[1] && other.y[0] <= self.y[1]
    }

    /// Returns the greatest value of `a x + b y + c` over the rectangle.
    pub fn max_of(&self, plane: &[f32; 3]) -> f32 {
        let [a, b, c] = *plane;
        (a * self.x[0]).max(a * self.x[1]) + (b * self.y[0]).max(b * self.y[1]) + c
    }

    /// Returns the least value of `a x + b y + c` over the rectangle.
    pub fn min_of(&self, plane: &[f32; 3]) -> f32 {
        let [a, b, c] = *plane;
        (a * self.x[0]).min(a * self.x[1]) + (b * self.y[0]).min(b * self.y[1]) + c
    }
}

/// Rays of all pixels.
#[derive(Clone, Debug)]
pub struct RayTable {
    /// Image width, px.
    pub width: usize,
    /// Image height, px.
    pub height: usize,
    /// Pixels per row including padding, a multiple of [`TILE`].
    pub stride: usize,
    /// Normalised x per pixel, row-major in rows of `stride`.
    pub x: Vec<f32>,
    /// Normalised y per pixel.
    pub y: Vec<f32>,
    /// Range of each tile, row-major.
    pub tiles: Vec<Rect>,
    /// Range of each tile row.
    pub bands: Vec<Rect>,
    /// Size of a pixel at the image centre in normalised coordinates (1/fx, 1/fy).
    pub pitch: [f32; 2],
}

impl RayTable {
    /// Undistorts every pixel centre.
    pub fn new(camera: &Camera) -> Self {
        let (width, height) = (camera.width, camera.height);
        let stride = width.div_ceil(TILE) * TILE;
        let rows = height.div_ceil(TILE) * TILE;
        let rays: Vec<[f64; 2]> = (0..stride * rows)
            .into_par_iter()
            .map(|i| camera.undistort((i % stride) as f64, (i / stride) as f64))
            .collect();
        let x: Vec<f32> = rays.iter().map(|r| r[0] as f32).collect();
        let y: Vec<f32> = rays.iter().map(|r| r[1] as f32).collect();
        let across = stride / TILE;
        let mut tiles = vec![Rect::EMPTY; across * (rows / TILE)];
        for row in 0..rows {
            for column in 0..stride {
                let i = row * stride + column;
                tiles[(row / TILE) * across + column / TILE].include(x[i], y[i]);
            }
        }
        let pitch = [1.0 / camera.fx as f32, 1.0 / camera.fy as f32];
        for tile in &mut tiles {
            // Anti-aliasing samples up to half a pixel beyond the pixel centres.
            *tile = tile.grown(pitch);
        }
        let bands = tiles.chunks(across).map(|row| row.iter().copied().fold(Rect::EMPTY, Rect::union)).collect();
        Self { width, height, stride, x, y, tiles, bands, pitch }
    }

    /// Returns the range of the part of `row` in the tile that starts at `column`.
    pub fn chunk(&self, row: usize, column: usize) -> Rect {
        let start = row * self.stride + column;
        let mut rect = Rect::EMPTY;
        for (x, y) in self.x[start..start + TILE].iter().zip(&self.y[start..start + TILE]) {
            rect.include(*x, *y);
        }
        rect.grown(self.pitch)
    }

    /// Returns the range of the whole image.
    pub fn view(&self) -> Rect {
        self.bands.iter().copied().fold(Rect::EMPTY, Rect::union)
    }
}
