//! The renderer. In: meshes and a camera pose. Out: colour, exact depth and instance mask.
//!
//! A rasteriser in homogeneous coordinates over a table of viewing rays: [`project`] sets triangles up, [`raster`] finds the
//! nearest one per pixel, [`shade`] computes the colour at a place on it, [`paint`] does so for every pixel; [`rows`] does all this
//! for images whose rows are read at different times.

pub mod paint;
pub mod project;
pub mod raster;
pub mod rays;
mod rows;
pub mod shade;

use nalgebra::Isometry3;
use rayon::prelude::*;
pub use rows::render_rows;

use paint::Painter;
use project::Projected;
use raster::{NOTHING, Visibility};
use rays::{RayTable, TILE};
use shade::View;

use crate::mesh::Mesh;

/// The result for one view; row-major, `width * height` pixels.
#[derive(Clone, Debug, Default)]
pub struct Rendering {
    /// Linear RGB, 1 is white.
    pub color: Vec<[f32; 3]>,
    /// Depth along the optical axis, m; 0 where nothing is visible.
    pub depth: Vec<f32>,
    /// 0 static, k actor.
    pub instance: Vec<u8>,
    /// Share of the infrared light of the projector that the surface reflects.
    pub reflectance: Vec<f32>,
}

impl Rendering {
    /// Creates an empty rendering of so many pixels.
    pub fn new(pixels: usize) -> Self {
        Self {
            color: vec![[0.0; 3]; pixels],
            depth: vec![0.0; pixels],
            instance: vec![0; pixels],
            reflectance: vec![0.0; pixels],
        }
    }

    /// Appends the rows below this rendering.
    pub fn append(&mut self, below: Self) {
        self.color.extend(below.color);
        self.depth.extend(below.depth);
        self.instance.extend(below.instance);
        self.reflectance.extend(below.reflectance);
    }
}

/// Renders `view`, whose meshes are in world coordinates.
pub fn render(rays: &RayTable, view: &View, antialias: bool) -> Rendering {
    let triangles = project_all(rays, view);
    let mut seen = Visibility::empty(rays);
    seen.add(rays, &triangles);
    view.prepare(visible(&triangles, &seen.triangle));
    let painter = Painter { rays, view, triangles: &triangles, seen: &seen, antialias };
    let bands: Vec<Rendering> = (0..rays.bands.len())
        .into_par_iter()
        .map(|band| {
            let rows = TILE.min(rays.height - band * TILE);
            let mut out = Rendering::new(rows * rays.width);
            painter.band(band, &mut out);
            out
        })
        .collect();
    let mut rendering = Rendering::new(0);
    bands.into_iter().for_each(|band| rendering.append(band));
    rendering
}

/// Returns the triangles that any pixel shows.
fn visible<'t>(triangles: &'t [Projected], seen: &[u32]) -> impl Iterator<Item = &'t Projected> {
    let mut visible = vec![false; triangles.len()];
    for &id in seen {
        if let Some(visible) = visible.get_mut(id as usize) {
            *visible = true;
        }
    }
    triangles.iter().zip(visible).filter(|(_, visible)| *visible).map(|(t, _)| t)
}

fn project_all(rays: &RayTable, view: &View) -> Vec<Projected> {
    let frustum = rays.view();
    let mut triangles = Vec::new();
    for (index, mesh) in (0u8..).zip(view.meshes) {
        project::project(mesh, index, &view.t_cam_world, &frustum, &mut triangles);
    }
    triangles
}

/// The static part of a view, kept to compute repeatedly how much of it people hide.
#[derive(Clone, Debug)]
pub struct Backdrop {
    t_cam_world: Isometry3<f64>,
    seen: Visibility,
}

impl Backdrop {
    /// Renders the static mesh from `t_cam_world`.
    pub fn new(rays: &RayTable, t_cam_world: Isometry3<f64>, mesh: &Mesh) -> Self {
        let mut triangles = Vec::new();
        project::project(mesh, 0, &t_cam_world, &rays.view(), &mut triangles);
        let mut seen = Visibility::empty(rays);
        seen.add(rays, &triangles);
        seen.triangle.fill(NOTHING);
        Self { t_cam_world, seen }
    }

    /// Returns the share of pixels that `people` cover.
    pub fn share(&self, rays: &RayTable, people: &Mesh) -> f64 {
        let mut triangles = Vec::new();
        project::project(people, 1, &self.t_cam_world, &rays.view(), &mut triangles);
        let mut seen = self.seen.clone();
        seen.add(rays, &triangles);
        let rows = seen.triangle.chunks(rays.stride).take(rays.height);
        let covered = rows.flat_map(|row| &row[..rays.width]).filter(|&&id| id != NOTHING).count();
        covered as f64 / (rays.width * rays.height) as f64
    }
}
