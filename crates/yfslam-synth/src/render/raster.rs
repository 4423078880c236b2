//! Visibility: the visible triangle of each pixel and its depth.
//!
//! In: projected triangles and rays. Out: per pixel the inverse depth and the index of the nearest triangle. The image is
//! cut into tiles; a tile keeps only triangles that can touch it, nearest first, and stops when it is covered. Bands of
//! tiles run in parallel and write disjoint rows, so that the result does not depend on the number of threads.

use std::ops::Range;

use rayon::prelude::*;

use super::project::Projected;
use super::rays::{RayTable, Rect, TILE};

/// Triangle index of a pixel without a visible triangle.
pub const NOTHING: u32 = u32::MAX;

/// Per-pixel visibility in rows of [`RayTable::stride`].
#[derive(Clone, Debug, Default)]
pub struct Visibility {
    /// The row of the image that comes first.
    pub first_row: usize,
    /// 1/z, 1/m; 0 where nothing is visible.
    pub inverse_depth: Vec<f32>,
    /// Index into the projected triangles, or [`NOTHING`].
    pub triangle: Vec<u32>,
}

impl Visibility {
    /// Creates an empty visibility.
    pub fn empty(rays: &RayTable) -> Self {
        Self::of_rows(rays, 0..rays.x.len() / rays.stride)
    }

    /// Creates an empty visibility of some rows.
    pub fn of_rows(rays: &RayTable, rows: Range<usize>) -> Self {
        let pixels = rows.len() * rays.stride;
        Self { first_row: rows.start, inverse_depth: vec![0.0; pixels], triangle: vec![NOTHING; pixels] }
    }

    /// Adds `triangles` to a visibility of all rows; the nearest one wins in each pixel.
    pub fn add(&mut self, rays: &RayTable, triangles: &[Projected]) {
        let band = TILE * rays.stride;
        let bands = self.inverse_depth.par_chunks_mut(band).zip(self.triangle.par_chunks_mut(band));
        bands.enumerate().for_each(|(index, (depths, ids))| {
            let in_band: Vec<u32> = (0u32..)
                .zip(triangles)
                .filter(|(_, t)| t.bounds.overlaps(&rays.bands[index]))
                .map(|(id, _)| id)
                .collect();
            let mut tile = Tile { rays, band: index, column: 0, list: Vec::new() };
            for column in 0..rays.stride / TILE {
                tile.column = column;
                tile.find_candidates(triangles, &in_band);
                tile.draw(triangles, depths, ids);
            }
        });
    }
}

/// A triangle that may touch the tile, and the greatest inverse depth it can have there.
type Candidate = (f32, u32);

/// A tile that is being drawn.
struct Tile<'a> {
    rays: &'a RayTable,
    band: usize,
    column: usize,
    /// Triangles that may be visible, nearest first.
    list: Vec<Candidate>,
}

impl Tile<'_> {
    fn rect(&self) -> &Rect {
        &self.rays.tiles[self.band * (self.rays.stride / TILE) + self.column]
    }

    fn find_candidates(&mut self, triangles: &[Projected], in_band: &[u32]) {
        let rect = *self.rect();
        self.list.clear();
        for &id in in_band {
            let t = &triangles[id as usize];
            if t.bounds.overlaps(&rect) && t.edges.iter().all(|edge| rect.max_of(edge) >= 0.0) {
                self.list.push((rect.max_of(&t.inverse_depth), id));
            }
        }
        self.list.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    }

    /// Draws the candidates into the rows of the band.
    fn draw(&self, triangles: &[Projected], depths: &mut [f32], ids: &mut [u32]) {
        let across = self.rays.stride / TILE;
        let (xs, ys) = (self.rays.x.as_chunks::<TILE>().0, self.rays.y.as_chunks::<TILE>().0);
        let (depths, ids) = (depths.as_chunks_mut::<TILE>().0, ids.as_chunks_mut::<TILE>().0);
        let pitch = self.rays.pitch[1];
        // All visible surfaces of the tile are at least this near once a triangle covers the whole tile.
        let mut covered_from = 0.0;
        for &(nearest, id) in &self.list {
            if nearest < covered_from {
                break;
            }
            let t = &triangles[id as usize];
            if t.edges.iter().all(|edge| self.rect().min_of(edge) >= 0.0) {
                covered_from = self.rect().min_of(&t.inverse_depth).max(covered_from);
            }
            for row in 0..TILE {
                let local = row * across + self.column;
                let global = self.band * TILE * across + local;
                let ends = [ys[global][0], ys[global][TILE - 1]];
                // A margin of one pixel, as rows bend under distortion.
                if ends[0].min(ends[1]) - pitch <= t.bounds.y[1] && ends[0].max(ends[1]) + pitch >= t.bounds.y[0] {
                    draw_row(t, id, &xs[global], &ys[global], &mut depths[local], &mut ids[local]);
                }
            }
        }
    }
}

/// Draws triangle `id` into one row of a tile, without branches so that the compiler vectorises it.
#[inline]
pub fn draw_row(
    t: &Projected,
    id: u32,
    xs: &[f32; TILE],
    ys: &[f32; TILE],
    depth: &mut [f32; TILE],
    ids: &mut [u32; TILE],
) {
    for i in 0..TILE {
        let at = |p: &[f32; 3]| p[0] * xs[i] + p[1] * ys[i] + p[2];
        let w = at(&t.inverse_depth);
        let hit = (at(&t.edges[0]) >= 0.0) & (at(&t.edges[1]) >= 0.0) & (at(&t.edges[2]) >= 0.0) & (w > depth[i]);
        depth[i] = if hit { w } else { depth[i] };
        ids[i] = if hit { id } else { ids[i] };
    }
}
