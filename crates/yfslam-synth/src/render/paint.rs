//! Computes the colour of every pixel, tile by tile; pixels on an edge are shaded at four places.
//!
//! In: the visible triangle of each pixel. Out: linear RGB, depth and instance per pixel.

use std::ops::Range;

use super::Rendering;
use super::project::Projected;
use super::raster::Visibility;
use super::rays::{RayTable, Rect, TILE};
use super::shade::{Shaded, Surface, View};
use crate::light::Occluder;

/// Four samples in a rotated grid, in pixels from the centre.
const SUBSAMPLES: [[f32; 2]; 4] = [[-0.125, -0.375], [0.375, -0.125], [0.125, 0.375], [-0.375, 0.125]];

/// Relative depth difference between neighbours on one patch that counts as an edge.
const DEPTH_JUMP: f32 = 0.03;

/// Computes colours from visibility.
pub struct Painter<'a> {
    /// Viewing rays.
    pub rays: &'a RayTable,
    /// Scene.
    pub view: &'a View<'a>,
    /// Triangles by the index of visibility.
    pub triangles: &'a [Projected],
    /// Visible triangle of each pixel.
    pub seen: &'a Visibility,
    /// Whether edges are anti-aliased.
    pub antialias: bool,
}

/// The distinct triangles around a pixel.
type Candidates<'a> = ([&'a Projected; 9], usize);

/// The triangle of the last pixel, with what its pixels share.
type Last<'a> = Option<(u32, u8, Surface<'a>)>;

impl Painter<'_> {
    /// Paints the band of tiles number `band` into `out`, which holds the band's rows.
    pub fn band(&self, band: usize, out: &mut Rendering) {
        let (width, rows) = (self.rays.width, out.depth.len() / self.rays.width);
        let mut near = Vec::new();
        for column in (0..width).step_by(TILE) {
            let tile = &self.rays.tiles[band * (self.rays.stride / TILE) + column / TILE];
            self.occluders_near(tile, band * TILE..(band + 1) * TILE, column, &mut near);
            let mut last = None;
            for row in 0..rows {
                self.span(band * TILE + row, column, &near, &mut last, out, row * width);
            }
        }
    }

    /// Paints one row into `out`, which holds nothing else.
    pub fn row(&self, row: usize, out: &mut Rendering) {
        let (mut near, mut last) = (Vec::new(), None);
        for column in (0..self.rays.width).step_by(TILE) {
            self.occluders_near(&self.rays.chunk(row, column), row..row + 1, column, &mut near);
            self.span(row, column, &near, &mut last, out, 0);
        }
    }

    /// Returns the index of a pixel in the visibility.
    fn seen_index(&self, row: usize, column: usize) -> usize {
        (row - self.seen.first_row) * self.rays.stride + column
    }

    /// Paints the pixels of `row` in the tile that starts at `column`; the row starts at pixel `start` of `out`.
    fn span<'s>(
        &'s self,
        row: usize,
        column: usize,
        near: &[Occluder],
        last: &mut Last<'s>,
        out: &mut Rendering,
        start: usize,
    ) {
        for x in column..(column + TILE).min(self.rays.width) {
            let index = row * self.rays.stride + x;
            let seen = self.seen_index(row, x);
            let id = self.seen.triangle[seen];
            if last.as_ref().is_none_or(|(known, ..)| *known != id) {
                *last = self.triangles.get(id as usize).map(|t| (id, self.view.instance(t), self.view.surface(t)));
            }
            let Some((_, instance, surface)) = &*last else { continue };
            let pixel = start + x;
            out.depth[pixel] = 1.0 / self.seen.inverse_depth[seen];
            out.instance[pixel] = *instance;
            let shaded = match self.edge_candidates(row, x) {
                Some(candidates) => self.supersample(index, near, &candidates),
                None => self.view.shade(surface, near, self.rays.x[index], self.rays.y[index]),
            };
            (out.color[pixel], out.reflectance[pixel]) = (shaded.color, shaded.reflectance);
        }
    }

    /// Collects the occluders that affect the visible part of some rows of a tile, whose rays lie in `tile`.
    fn occluders_near(&self, tile: &Rect, rows: Range<usize>, column: usize, near: &mut Vec<Occluder>) {
        near.clear();
        if self.view.occluders.is_empty() {
            return;
        }
        let (mut nearest, mut farthest) = (f32::INFINITY, 0.0f32);
        for row in rows {
            let start = self.seen_index(row, column);
            for &w in self.seen.inverse_depth[start..start + TILE].iter().filter(|&&w| w > 0.0) {
                (nearest, farthest) = (nearest.min(1.0 / w), farthest.max(1.0 / w));
            }
        }
        // Box around the visible part of the frustum of the tile, in camera coordinates.
        let span = |range: [f32; 2]| {
            let ends = [range[0] * nearest, range[0] * farthest, range[1] * nearest, range[1] * farthest];
            [ends.iter().copied().fold(f32::INFINITY, f32::min), ends.iter().copied().fold(f32::NEG_INFINITY, f32::max)]
        };
        let sides = [span(tile.x), span(tile.y), [nearest, farthest]];
        near.extend(self.view.occluders.iter().filter(|o| {
            let gaps = (0..3).map(|k| (sides[k][0] - o.center[k]).max(o.center[k] - sides[k][1]).max(0.0).powi(2));
            gaps.sum::<f32>() < o.reach() * o.reach()
        }));
    }

    /// Returns the triangles around the pixel if an edge passes near it and edges are anti-aliased.
    fn edge_candidates(&self, row: usize, column: usize) -> Option<Candidates<'_>> {
        if !self.antialias {
            return None;
        }
        let stride = self.rays.stride;
        let center = self.seen_index(row, column);
        if row > 0 && row + 1 < self.rays.height && column > 0 && column + 1 < self.rays.width {
            // Most pixels lie inside a triangle.
            let rows = [center - stride, center, center + stride].map(|i| &self.seen.triangle[i - 1..=i + 1]);
            let id = self.seen.triangle[center];
            if rows.iter().flat_map(|ids| ids.iter()).fold(0, |all, &other| all | (other ^ id)) == 0 {
                return None;
            }
        }
        let (id, w) = (self.seen.triangle[center], self.seen.inverse_depth[center]);
        let center = self.triangles.get(id as usize)?;
        let mut patch = None;
        let (mut ids, mut list, mut count, mut edge) = ([id; 9], [center; 9], 1, false);
        for y in row.saturating_sub(1)..=(row + 1).min(self.rays.height - 1) {
            for x in column.saturating_sub(1)..=(column + 1).min(self.rays.width - 1) {
                let other = self.seen.triangle[self.seen_index(y, x)];
                if other == id || ids[..count].contains(&other) {
                    continue;
                }
                let Some(t) = self.triangles.get(other as usize) else { continue };
                (ids[count], list[count]) = (other, t);
                count += 1;
                let jump = (self.seen.inverse_depth[self.seen_index(y, x)] - w).abs() > DEPTH_JUMP * w;
                let patch = *patch.get_or_insert_with(|| self.view.patch(center));
                edge |= jump || self.view.patch(t) != patch;
            }
        }
        edge.then_some((list, count))
    }

    /// Computes the colour of an edge pixel: four places decide how much of the pixel each triangle covers, and each triangle is
    /// shaded once, in the middle of its places (as in multisampling hardware). Places that hit none of the candidates count for
    /// the triangle at the centre.
    fn supersample(&self, index: usize, near: &[Occluder], candidates: &Candidates) -> Shaded {
        let (list, count) = candidates;
        // Per candidate: number of places and their sum, in normalised coordinates.
        let mut shares = [(0.0f32, 0.0f32, 0.0f32); 9];
        for [dx, dy] in SUBSAMPLES {
            let x = self.rays.x[index] + dx * self.rays.pitch[0];
            let y = self.rays.y[index] + dy * self.rays.pitch[1];
            let at = |p: &[f32; 3]| p[0] * x + p[1] * y + p[2];
            let (mut nearest, mut hit) = (0.0, 0);
            for (slot, t) in list[..*count].iter().enumerate() {
                let w = at(&t.inverse_depth);
                if w > nearest && t.edges.iter().all(|edge| at(edge) >= 0.0) {
                    (nearest, hit) = (w, slot);
                }
            }
            let (n, sx, sy) = &mut shares[hit];
            let (px, py) = if nearest > 0.0 { (x, y) } else { (self.rays.x[index], self.rays.y[index]) };
            (*n, *sx, *sy) = (*n + 1.0, *sx + px, *sy + py);
        }
        let mut sum = Shaded::default();
        for (t, (n, sx, sy)) in list.iter().zip(shares).filter(|(_, (n, ..))| *n > 0.0) {
            let surface = self.view.surface(t);
            let shaded = self.view.shade(&surface, near, sx / n, sy / n);
            let share = n / SUBSAMPLES.len() as f32;
            (0..3).for_each(|k| sum.color[k] += shaded.color[k] * share);
            sum.reflectance += shaded.reflectance * share;
        }
        sum
    }
}
