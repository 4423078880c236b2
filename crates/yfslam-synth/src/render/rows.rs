//! Images of a rolling shutter: each row shows the view at its own time.
//!
//! In: rays and one view per row. Out: the rendering. Every row is projected, drawn and shaded with the camera, the actors and the
//! light of its own time, and so are the rows above and below it, which anti-aliasing looks at: it has the bits of that row of a
//! global image at that time. That is affordable because a triangle is projected only for rows that it may touch. Which those are is
//! searched per band of rows, from its place at the first and the last of them.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::Rendering;
use super::paint::Painter;
use super::project::{self, NEAR_M, Projected, project_triangle};
use super::raster::{Visibility, draw_row};
use super::rays::{RayTable, Rect, TILE};
use super::shade::View;

/// Border around the places of a triangle at both ends of a band, px: more than it leaves them by in between, where it moves
/// unevenly. A foot that swings with 200 m/s² at 1 m leaves the chord by 0.15 px within the 3 ms of a band of the longest readout.
const BORDER_PX: f32 = 2.0;
/// Cosine between the outward normal of a triangle and the ray, beyond which it faces away over the whole band if it does at both
/// ends. In between, the angle leaves the chord by less than 0.001 rad.
const AWAY: f64 = 0.01;

/// A triangle that may touch a band.
struct Candidate {
    mesh: u8,
    triangle: u32,
    /// Range over the time of the band.
    bounds: Rect,
    /// Tiles of the band that it may touch.
    tiles: Range<usize>,
}

/// A row and its neighbours, all at the time of the row.
struct Window {
    triangles: Vec<Projected>,
    seen: Visibility,
}

/// Renders an image of which row k shows `views[k]`; there is one view per row.
pub fn render_rows(rays: &RayTable, views: &[View], antialias: bool) -> Rendering {
    let bands = views.par_chunks(TILE).enumerate();
    let windows: Vec<Window> = bands.flat_map_iter(|(band, views)| draw_band(rays, views, band)).collect();
    if let Some(view) = views.first() {
        let runs = windows.iter().flat_map(|window| {
            let runs = window.seen.triangle.chunk_by(|a, b| a == b);
            runs.filter_map(|run| window.triangles.get(run[0] as usize))
        });
        view.prepare(runs);
    }
    let paint = |(row, (window, view)): (usize, (&Window, &View))| {
        let mut out = Rendering::new(rays.width);
        Painter { rays, view, triangles: &window.triangles, seen: &window.seen, antialias }.row(row, &mut out);
        out
    };
    let painted: Vec<Rendering> = windows.par_iter().zip(views).enumerate().map(paint).collect();
    let mut rendering = Rendering::new(0);
    painted.into_iter().for_each(|row| rendering.append(row));
    rendering
}

/// Draws the rows of a band from the views of each.
fn draw_band(rays: &RayTable, views: &[View], band: usize) -> Vec<Window> {
    let rows = band * TILE..band * TILE + views.len();
    let candidates = candidates(rays, &views[0], &views[views.len() - 1], rows.clone());
    rows.zip(views).map(|(row, view)| draw(rays, view, row, &candidates)).collect()
}

/// Draws one row and its neighbours.
fn draw(rays: &RayTable, view: &View, row: usize, candidates: &[Candidate]) -> Window {
    let across = rays.stride / TILE;
    let rows = row.saturating_sub(1)..(row + 2).min(rays.height);
    let chunks: Vec<Rect> =
        rows.clone().flat_map(|row| (0..across).map(move |tile| rays.chunk(row, tile * TILE))).collect();
    let range = chunks.iter().copied().fold(Rect::EMPTY, Rect::union);
    let mut seen = Visibility::of_rows(rays, rows.clone());
    let (depths, ids) = (seen.inverse_depth.as_chunks_mut::<TILE>().0, seen.triangle.as_chunks_mut::<TILE>().0);
    let (xs, ys) = (rays.x.as_chunks::<TILE>().0, rays.y.as_chunks::<TILE>().0);
    let mut triangles = Vec::new();
    for candidate in candidates.iter().filter(|c| c.bounds.overlaps(&range)) {
        let corners = view.meshes[usize::from(candidate.mesh)].triangles[candidate.triangle as usize].vertices;
        let corners = corners.map(|vertex| view.in_camera(candidate.mesh, vertex));
        let Some(t) = project_triangle(&corners, candidate.mesh, candidate.triangle, &range) else { continue };
        let id = triangles.len() as u32;
        for local in 0..rows.len() {
            for tile in candidate.tiles.clone() {
                let here = local * across + tile;
                if t.bounds.overlaps(&chunks[here]) {
                    let ray = rows.start * across + here;
                    draw_row(&t, id, &xs[ray], &ys[ray], &mut depths[here], &mut ids[here]);
                }
            }
        }
        triangles.push(t);
    }
    Window { triangles, seen }
}

/// Returns the triangles that may touch `rows`, or their neighbours, between the time of the first and that of the last of them.
fn candidates(rays: &RayTable, first: &View, last: &View, rows: Range<usize>) -> Vec<Candidate> {
    let across = rays.stride / TILE;
    let border = rays.pitch.map(|size| BORDER_PX * size);
    // The range of each column of tiles.
    let ends = rows.start.saturating_sub(1)..(rows.end + 1).min(rays.height);
    let tiles: Vec<Rect> = (0..across)
        .map(|tile| ends.clone().map(|row| rays.chunk(row, tile * TILE)).fold(Rect::EMPTY, Rect::union).grown(border))
        .collect();
    let band = tiles.iter().copied().fold(Rect::EMPTY, Rect::union);
    let mut found = Vec::new();
    for (number, mesh) in (0u8..).zip(first.meshes) {
        let place = |view: &View| -> Vec<Vector3<f64>> {
            (0..mesh.vertices.len() as u32).map(|index| view.in_camera(number, index)).collect()
        };
        let places = [first, last].map(place);
        for (index, triangle) in (0u32..).zip(&mesh.triangles) {
            let corners = places.each_ref().map(|places| triangle.vertices.map(|vertex| places[vertex as usize]));
            let bounds = project::bounds(&corners[0]).union(project::bounds(&corners[1]));
            if !bounds.overlaps(&band) || corners.iter().all(is_hidden) {
                continue;
            }
            let touched = |tile: &Rect| bounds.overlaps(tile);
            let (Some(start), Some(end)) = (tiles.iter().position(touched), tiles.iter().rposition(touched)) else {
                continue;
            };
            let bounds = bounds.grown(border);
            found.push(Candidate { mesh: number, triangle: index, bounds, tiles: start..end + 1 });
        }
    }
    found
}

/// Returns whether a triangle clearly faces away or lies behind the camera.
fn is_hidden(v: &[Vector3<f64>; 3]) -> bool {
    let normal = (v[1] - v[0]).cross(&(v[2] - v[0]));
    v.iter().all(|p| p.z < 0.5 * NEAR_M) || normal.dot(&v[0]) > AWAY * normal.norm() * v[0].norm()
}
