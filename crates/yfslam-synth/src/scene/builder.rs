//! Building blocks of scenes: textured rectangles, boxes, cylinders and balls.
//!
//! In: shapes in metres and materials. Out: a static mesh and the list of textures that it needs.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use rayon::prelude::*;

use crate::mesh::{Lighting, Mesh, Patch, Vec3};
use crate::rng::Rng;
use crate::texture::Texture;
use crate::texture::material::Material;

/// A texture to be painted.
#[derive(Clone, Copy, Debug)]
struct Order {
    material: Material,
    size_m: [f32; 2],
    density: f32,
    seed: u64,
}

/// Collects textures before they are painted, all at once and in parallel.
#[derive(Clone, Debug, Default)]
pub struct Palette {
    orders: Vec<Order>,
}

impl Palette {
    /// Orders a texture for a surface of `size_m` metres with `density` texels per metre; returns its index.
    pub fn order(&mut self, material: Material, size_m: [f32; 2], density: f32, seed: u64) -> u32 {
        self.orders.push(Order { material, size_m, density, seed });
        (self.orders.len() - 1) as u32
    }

    /// Paints everything that was ordered, with `sharpness` times the texels per metre.
    pub fn paint(&self, sharpness: f32) -> Vec<Texture> {
        let paint = |o: &Order| Texture::new(&o.material.paint(o.size_m, o.density * sharpness, o.seed));
        self.orders.par_iter().map(paint).collect()
    }
}

/// The six sides of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards −y, where the camera stands.
    Front,
    /// Towards +y.
    Back,
    /// Towards −x.
    Left,
    /// Towards +x.
    Right,
    /// Towards +z.
    Top,
    /// Towards −z.
    Bottom,
}

/// Builds the static mesh of a scene.
#[derive(Debug)]
pub struct Builder {
    /// What has been built.
    pub mesh: Mesh,
    /// The textures it needs.
    pub palette: Palette,
    /// Draws for variety.
    pub rng: Rng,
    /// Texels per metre of what is built next.
    pub density: f32,
}

impl Builder {
    /// An empty scene.
    pub fn new(seed: u64) -> Self {
        Self { mesh: Mesh::default(), palette: Palette::default(), rng: Rng::new(seed, 0x5ce), density: 500.0 }
    }

    /// A patch of the material for a surface of the given size.
    pub fn patch(&mut self, material: Material, size_m: [f32; 2]) -> Patch {
        let seed = self.rng.bits();
        let texture = self.palette.order(material, size_m, self.density * material.detail(), seed);
        Patch { texture, lighting: Lighting::Baked(0), instance: 0 }
    }

    /// A flat rectangle; `right` and `down` are its edges as seen from outside.
    pub fn rectangle(&mut self, top_left: Vec3, right: Vec3, down: Vec3, material: Material) {
        let patch = self.patch(material, [right.norm(), down.norm()]);
        self.mesh.rectangle(top_left, right, down, patch);
    }

    /// A rectangle that shines by itself.
    pub fn glowing(&mut self, top_left: Vec3, right: Vec3, down: Vec3, material: Material, factor: f32) {
        let patch = self.patch(material, [right.norm(), down.norm()]);
        self.mesh.rectangle(top_left, right, down, Patch { lighting: Lighting::Emissive(factor), ..patch });
    }

    /// A box that stands on `base` (the middle of its bottom), turned by `yaw` about the vertical.
    pub fn cuboid(&mut self, base: Vec3, size: Vec3, yaw: f32, material: impl Fn(Side) -> Material) {
        let first = self.mesh.vertices.len();
        let h = Vec3::new(size.x / 2.0, size.y / 2.0, size.z);
        let (dx, dy, dz) = (Vec3::x() * size.x, Vec3::y() * size.y, Vec3::z() * size.z);
        for (side, corner, right, down) in [
            (Side::Front, Vec3::new(-h.x, -h.y, h.z), dx, -dz),
            (Side::Back, Vec3::new(h.x, h.y, h.z), -dx, -dz),
            (Side::Left, Vec3::new(-h.x, h.y, h.z), -dy, -dz),
            (Side::Right, Vec3::new(h.x, -h.y, h.z), dy, -dz),
            (Side::Top, Vec3::new(-h.x, h.y, h.z), dx, -dy),
            (Side::Bottom, Vec3::new(-h.x, -h.y, 0.0), dx, dy),
        ] {
            // The underside of what lies on the floor is never seen, and the camera hardly gets behind things.
            let density = self.density;
            self.density = if matches!(side, Side::Back | Side::Bottom) { 0.4 * density } else { density };
            if side != Side::Bottom || base.z > 0.01 {
                self.rectangle(corner, right, down, material(side));
            }
            self.density = density;
        }
        self.mesh.transform_from(first, &upright(base, yaw));
    }

    /// A body of revolution that stands on `base`; rings are (height, radius), top first.
    pub fn turned(&mut self, base: Vec3, rings: &[[f32; 2]], segments: u32, material: Material) {
        let first = self.mesh.vertices.len();
        let radius = rings.iter().map(|r| r[1]).fold(0.0, f32::max);
        let height = rings.first().map_or(0.0, |r| r[0]) - rings.last().map_or(0.0, |r| r[0]);
        let patch = self.patch(material, [std::f32::consts::TAU * radius, height.max(radius)]);
        let rings: Vec<[f32; 3]> = rings.iter().map(|&[z, r]| [z, r, r]).collect();
        self.mesh.loft(segments, &rings, patch);
        self.mesh.transform_from(first, &upright(base, 0.0));
    }
}

fn upright(base: Vec3, yaw: f32) -> Isometry3<f32> {
    Isometry3::from_parts(Translation3::from(base), UnitQuaternion::from_axis_angle(&Vec3::z_axis(), yaw))
}
