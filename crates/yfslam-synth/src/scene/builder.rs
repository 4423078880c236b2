//! Building blocks of scenes: textured rectangles, boxes, cylinders and balls.
//!
//! In: shapes in metres and materials. Out: a static mesh and the list of textures that it needs.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use crate::light::Lamp;
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

/// Collects textures before they are painted.
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

    /// Returns the number of ordered textures.
    pub fn len(&self) -> usize {
        self.orders.len()
    }

    /// Paints order number `index` with `sharpness` times the texels per metre.
    pub fn paint(&self, index: usize, sharpness: f32) -> Texture {
        let o = &self.orders[index];
        Texture::new(&o.material.paint(o.size_m, o.density * sharpness, o.seed))
    }
}

/// The six sides of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards −y, where the camera is.
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
    /// The mesh built so far.
    pub mesh: Mesh,
    /// The textures of the mesh.
    pub palette: Palette,
    /// Draws for variety.
    pub rng: Rng,
    /// Texels per metre of the next shapes.
    pub density: f32,
}

impl Builder {
    /// Creates an empty scene.
    pub fn new(seed: u64) -> Self {
        Self { mesh: Mesh::default(), palette: Palette::default(), rng: Rng::new(seed, 0x5ce), density: 500.0 }
    }

    /// Creates a patch of the material for a surface of the given size.
    pub fn patch(&mut self, material: Material, size_m: [f32; 2]) -> Patch {
        let seed = self.rng.bits();
        let texture = self.palette.order(material, size_m, self.density * material.detail(), seed);
        Patch { texture, lighting: Lighting::Baked, instance: 0 }
    }

    /// Adds a flat rectangle; `right` and `down` are its edges as seen from outside.
    pub fn rectangle(&mut self, top_left: Vec3, right: Vec3, down: Vec3, material: Material) {
        let patch = self.patch(material, [right.norm(), down.norm()]);
        self.mesh.rectangle(top_left, right, down, patch);
    }

    /// Adds a rectangle that emits light.
    pub fn glowing(&mut self, top_left: Vec3, right: Vec3, down: Vec3, material: Material, factor: f32) {
        let patch = self.patch(material, [right.norm(), down.norm()]);
        self.mesh.rectangle(top_left, right, down, Patch { lighting: Lighting::Emissive(factor), ..patch });
    }

    /// Adds a lamp under the ceiling whose panel glows with `factor`, with half edges along x and y.
    pub fn lamp(&mut self, center: Vec3, half: [Vec3; 2], factor: f32, radiance: [f32; 3], steady: bool) -> Lamp {
        let strongest = radiance.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let [right, down] = half.map(|edge| edge * 2.0);
        let patch = self.patch(Material::Plain(radiance.map(|c| (c / strongest).sqrt())), [right.norm(), down.norm()]);
        let lighting = if steady { Lighting::Emissive(factor) } else { Lighting::Lamp(factor) };
        self.mesh.rectangle(center - half[0] - half[1], right, down, Patch { lighting, ..patch });
        Lamp { center, half, normal: -Vec3::z(), radiance, steady }
    }

    /// Adds a box on `base` (the middle of its bottom), turned by `yaw` about the vertical.
    pub fn cuboid(&mut self, base: Vec3, size: Vec3, yaw: f32, material: impl Fn(Side) -> Material) {
        self.tilted(upright(base, yaw), size, material);
    }

    /// Adds a box with the middle of its bottom at the origin of `pose`.
    pub fn tilted(&mut self, pose: Isometry3<f32>, size: Vec3, material: impl Fn(Side) -> Material) {
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
            // The underside of objects on the floor is never visible, and the back hardly ever.
            let density = self.density;
            self.density = if matches!(side, Side::Back | Side::Bottom) { 0.4 * density } else { density };
            if side != Side::Bottom || pose.translation.z > 0.01 {
                self.rectangle(corner, right, down, material(side));
            }
            self.density = density;
        }
        self.mesh.transform_from(first, &pose);
    }

    /// Adds a fragment: a box around the origin of `pose` whose corners are moved inward, each by its own draw.
    pub fn chunk(&mut self, pose: Isometry3<f32>, size: Vec3, material: Material) {
        let first = self.mesh.vertices.len();
        let corners: [Vec3; 8] = std::array::from_fn(|k| {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 0.5 } else { -0.5 };
            let knock = Vec3::from_fn(|_, _| self.rng.range(0.45, 1.0));
            Vec3::new(sign(0), sign(1), sign(2)).component_mul(&size).component_mul(&knock)
        });
        // Top left, top right, bottom left, bottom right of each side, seen from outside.
        for side in [[4, 5, 0, 1], [7, 6, 3, 2], [6, 4, 2, 0], [5, 7, 1, 3], [6, 7, 4, 5], [0, 1, 2, 3]] {
            let [a, b, c, d] = side.map(|k| corners[k]);
            let patch = self.patch(material, [(b - a).norm(), (c - a).norm()]);
            let normal = (c - b).cross(&(d - a)).normalize();
            let surface = |u: f32, v: f32| {
                (a * (1.0 - u) * (1.0 - v) + b * u * (1.0 - v) + c * (1.0 - u) * v + d * u * v, normal)
            };
            self.mesh.grid(1, 1, patch, surface);
        }
        self.mesh.transform_from(first, &pose);
    }

    /// Adds a body of revolution on `base`; rings are (height, radius), top first.
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
