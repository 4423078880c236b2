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
use super::project::{NEAR_M, Projected, project_triangle};
use super::raster::{Visibility, draw_row};
use super::rays::{RayTable, Rect, TILE};
use super::shade::View;
use crate::mesh::{Mesh, Vec3};

/// Border around the places of a triangle at both ends of a band, px: more than it leaves them by in between, where it moves
/// unevenly. A foot that swings with 200 m/s² at 1 m leaves the chord by 0.15 px within the 3 ms of a band of the longest readout.
const BORDER_PX: f32 = 2.0;
/// Cosine between the outward normal of a triangle and the ray, beyond which it faces away over the whole band if it does at both
/// ends. In between, the angle leaves the chord by less than 0.001 rad.
const AWAY: f32 = 0.01;

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
    // The places of all vertices at the first row of every band and at the last row of all.
    let ends = (0..=views.len().div_ceil(TILE)).into_par_iter().map(|band| (band * TILE).min(views.len().max(1) - 1));
    let places: Vec<[Vec<Place>; 2]> = ends.filter_map(|row| views.get(row)).map(places).collect();
    let bands = views.par_chunks(TILE).zip(places.par_windows(2)).enumerate();
    let windows: Vec<Window> =
        bands.flat_map_iter(|(band, (views, ends))| draw_band(rays, views, ends, band * TILE)).collect();
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

/// Returns the places of all vertices of both meshes.
fn places(view: &View) -> [Vec<Place>; 2] {
    [0, 1].map(|mesh: u8| {
        let count = view.meshes[usize::from(mesh)].vertices.len() as u32;
        (0..count).map(|vertex| Place::new(&view.in_camera(mesh, vertex))).collect()
    })
}

/// Draws the rows of a band that starts at row `first` from the view of each.
fn draw_band(rays: &RayTable, views: &[View], ends: &[[Vec<Place>; 2]], first: usize) -> Vec<Window> {
    let rows = first..first + views.len();
    let candidates = candidates(rays, views[0].meshes, ends, rows.clone());
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

/// Returns the triangles that may touch `rows`, or their neighbours, while their vertices move between the places at both `ends`.
fn candidates(rays: &RayTable, meshes: [&Mesh; 2], ends: &[[Vec<Place>; 2]], rows: Range<usize>) -> Vec<Candidate> {
    let across = rays.stride / TILE;
    let border = rays.pitch.map(|size| BORDER_PX * size);
    // The range of each column of tiles.
    let rows = rows.start.saturating_sub(1)..(rows.end + 1).min(rays.height);
    let tiles: Vec<Rect> = (0..across)
        .map(|tile| rows.clone().map(|row| rays.chunk(row, tile * TILE)).fold(Rect::EMPTY, Rect::union).grown(border))
        .collect();
    let band = tiles.iter().copied().fold(Rect::EMPTY, Rect::union);
    let mut found = Vec::new();
    for (number, mesh) in (0u8..).zip(meshes) {
        for (index, triangle) in (0u32..).zip(&mesh.triangles) {
            let corners = |end: &[Vec<Place>; 2]| triangle.vertices.map(|k| end[usize::from(number)][k as usize]);
            let mut bounds = Rect::EMPTY;
            ends.iter().flat_map(corners).for_each(|place| bounds = bounds.union(place.range()));
            if !bounds.overlaps(&band) || ends.iter().all(|end| is_hidden(&corners(end))) {
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

/// The place of a vertex at the end of a band.
#[derive(Clone, Copy)]
struct Place {
    /// In camera coordinates, m.
    point: Vec3,
    /// In normalised image coordinates, if it lies in front of the camera.
    image: Option<[f32; 2]>,
}

impl Place {
    fn new(point: &Vector3<f64>) -> Self {
        let image = (point.z >= NEAR_M).then(|| [(point.x / point.z) as f32, (point.y / point.z) as f32]);
        Self { point: point.cast(), image }
    }

    /// Returns where triangles with this corner may lie on its account: anywhere if it is behind the camera.
    fn range(&self) -> Rect {
        match self.image {
            Some([x, y]) => Rect { x: [x, x], y: [y, y] },
            None => Rect::EVERYTHING,
        }
    }
}

/// Returns whether a triangle clearly faces away or lies behind the camera.
fn is_hidden(corners: &[Place; 3]) -> bool {
    let v = corners.map(|corner| corner.point);
    let normal = (v[1] - v[0]).cross(&(v[2] - v[0]));
    corners.iter().all(|corner| corner.image.is_none()) || normal.dot(&v[0]) > AWAY * normal.norm() * v[0].norm()
}
