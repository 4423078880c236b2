//! The renderer: meshes and a camera pose in; colour, exact depth and instance mask out.
//!
//! A rasteriser in homogeneous coordinates over a table of viewing rays: [`project`] sets triangles up, [`raster`] finds
//! the nearest one per pixel, [`shade`] colours a place on it, [`paint`] does so for every pixel.

pub mod paint;
pub mod project;
pub mod raster;
pub mod rays;
pub mod shade;

use nalgebra::Isometry3;
use rayon::prelude::*;

use paint::Painter;
use project::Projected;
use raster::NOTHING;
use rays::{RayTable, TILE};
use shade::View;

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

impl Picture {
    fn new(pixels: usize) -> Self {
        Self { color: vec![[0.0; 3]; pixels], depth: vec![0.0; pixels], instance: vec![0; pixels] }
    }
}

/// Renders the meshes of `view` from `t_cam_world`.
pub fn render(rays: &RayTable, t_cam_world: &Isometry3<f64>, view: &View, antialias: bool) -> Picture {
    let triangles = project_all(rays, t_cam_world, view);
    let seen = raster::rasterise(rays, &triangles);
    let painter = Painter { rays, view, triangles: &triangles, seen: &seen, antialias };
    let bands: Vec<Picture> = (0..rays.bands.len())
        .into_par_iter()
        .map(|band| {
            let rows = TILE.min(rays.height - band * TILE);
            let mut out = Picture::new(rows * rays.width);
            painter.band(band, &mut out);
            out
        })
        .collect();
    let mut picture = Picture { color: Vec::new(), depth: Vec::new(), instance: Vec::new() };
    for band in bands {
        picture.color.extend(band.color);
        picture.depth.extend(band.depth);
        picture.instance.extend(band.instance);
    }
    picture
}

/// Share of pixels that see an actor.
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
