//! The renderer: meshes and a camera pose in; colour, exact depth and instance mask out.
//!
//! A rasteriser in homogeneous coordinates over a table of viewing rays: [`project`] sets triangles up, [`raster`] finds
//! the nearest one per pixel, [`shade`] colours it, and pixels on an edge are shaded at four places.

pub mod project;
pub mod raster;
pub mod rays;
pub mod shade;

use nalgebra::Isometry3;
use rayon::prelude::*;

use project::Projected;
use raster::{NOTHING, Visibility};
use rays::RayTable;
use shade::{Surface, View};

/// What the renderer makes of one view; row-major, `width * height` pixels.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Linear RGB, 1 is white.
    pub color: Vec<[f32; 3]>,
    /// Depth along the optical axis in metres; 0 where nothing is seen.
    pub depth: Vec<f32>,
    /// 0 static, k actor.
    pub instance: Vec<u8>,
}

/// Four samples in a rotated grid, in pixels from the centre.
const SUBSAMPLES: [[f32; 2]; 4] = [[-0.125, -0.375], [0.375, -0.125], [0.125, 0.375], [-0.375, 0.125]];

/// Depth jump between neighbours on one patch that counts as an edge, relative.
const DEPTH_JUMP: f32 = 0.03;

/// Renders the meshes of `view` from `t_cam_world`.
pub fn render(rays: &RayTable, t_cam_world: &Isometry3<f64>, view: &View, antialias: bool) -> Picture {
    let triangles = project_all(rays, t_cam_world, view);
    let seen = raster::rasterise(rays, &triangles);
    let pixels = rays.width * rays.height;
    let (mut color, mut depth, mut instance) = (vec![[0.0; 3]; pixels], vec![0.0; pixels], vec![0; pixels]);
    let rows = color.par_chunks_mut(rays.width).zip(depth.par_chunks_mut(rays.width));
    rows.zip(instance.par_chunks_mut(rays.width)).enumerate().for_each(|(row, ((color, depth), instance))| {
        let painter = Painter { rays, view, triangles: &triangles, seen: &seen };
        let mut last: Option<(u32, Surface)> = None;
        for column in 0..rays.width {
            let index = row * rays.stride + column;
            let id = seen.triangle[index];
            if id == NOTHING {
                continue;
            }
            let t = &triangles[id as usize];
            depth[column] = 1.0 / seen.inverse_depth[index];
            instance[column] = view.instance(t);
            let surface = match last {
                Some((known, surface)) if known == id => surface,
                _ => last.insert((id, view.surface(t))).1,
            };
            let center = || view.shade(&surface, rays.x[index], rays.y[index]);
            color[column] = match antialias.then(|| painter.edge_candidates(row, column)).flatten() {
                Some(candidates) => painter.supersample(index, &candidates, center),
                None => center(),
            };
        }
    });
    Picture { color, depth, instance }
}

/// Depth-free rendering for planning: share of pixels that see an actor.
pub fn actor_share(rays: &RayTable, t_cam_world: &Isometry3<f64>, view: &View) -> f64 {
    let triangles = project_all(rays, t_cam_world, view);
    let seen = raster::rasterise(rays, &triangles);
    let inside = (0..rays.height).flat_map(|row| (0..rays.width).map(move |column| row * rays.stride + column));
    let covered = inside
        .map(|index| seen.triangle[index])
        .filter(|&id| id != NOTHING && view.instance(&triangles[id as usize]) != 0)
        .count();
    covered as f64 / (rays.width * rays.height) as f64
}

fn project_all(rays: &RayTable, t_cam_world: &Isometry3<f64>, view: &View) -> Vec<Projected> {
    let frustum = rays.view();
    let mut triangles = Vec::new();
    for (index, mesh) in (0u8..).zip(view.meshes) {
        project::project(mesh, index, t_cam_world, &frustum, &mut triangles);
    }
    triangles
}

/// Shading of edge pixels.
struct Painter<'a> {
    rays: &'a RayTable,
    view: &'a View<'a>,
    triangles: &'a [Projected],
    seen: &'a Visibility,
}

/// The distinct triangles around a pixel.
type Candidates = ([u32; 9], usize);

impl Painter<'_> {
    /// The triangles around the pixel if an edge passes near it.
    fn edge_candidates(&self, row: usize, column: usize) -> Option<Candidates> {
        let stride = self.rays.stride;
        let center = row * stride + column;
        let (id, w) = (self.seen.triangle[center], self.seen.inverse_depth[center]);
        let patch = self.view.patch(&self.triangles[id as usize]);
        let (mut list, mut count, mut edge) = ([id; 9], 1, false);
        for y in row.saturating_sub(1)..=(row + 1).min(self.rays.height - 1) {
            for x in column.saturating_sub(1)..=(column + 1).min(self.rays.width - 1) {
                let other = self.seen.triangle[y * stride + x];
                if other == NOTHING || list[..count].contains(&other) {
                    continue;
                }
                list[count] = other;
                count += 1;
                let jump = (self.seen.inverse_depth[y * stride + x] - w).abs() > DEPTH_JUMP * w;
                edge |= jump || self.view.patch(&self.triangles[other as usize]) != patch;
            }
        }
        edge.then_some((list, count))
    }

    /// Mean colour of four places in the pixel; where none of the candidates is hit, `center` stands in.
    fn supersample(&self, index: usize, candidates: &Candidates, center: impl Fn() -> [f32; 3]) -> [f32; 3] {
        let (list, count) = candidates;
        let mut sum = [0.0; 3];
        for [dx, dy] in SUBSAMPLES {
            let x = self.rays.x[index] + dx * self.rays.pitch[0];
            let y = self.rays.y[index] + dy * self.rays.pitch[1];
            let at = |p: &[f32; 3]| p[0] * x + p[1] * y + p[2];
            let mut best = (0.0, None);
            for &id in &list[..*count] {
                let t = &self.triangles[id as usize];
                let w = at(&t.inverse_depth);
                if w > best.0 && t.edges.iter().all(|edge| at(edge) >= 0.0) {
                    best = (w, Some(t));
                }
            }
            let color = match best.1 {
                Some(t) => self.view.shade(&self.view.surface(t), x, y),
                None => center(),
            };
            for (total, value) in sum.iter_mut().zip(color) {
                *total += value * (1.0 / SUBSAMPLES.len() as f32);
            }
        }
        sum
    }
}
