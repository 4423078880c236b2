//! Rigid actors: a tracked rescue robot, an office chair, cardboard boxes, an open laptop.
//!
//! In: the kind of actor and a seed. Out: a mesh in its own axes (right, forward, up; the origin on the floor below its middle),
//! and that mesh at a pose.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Isometry3, Point3, UnitQuaternion};

use super::Class;
use crate::config::UnknownObject;
use crate::light::Occluder;
use crate::mesh::{Lighting, Mesh, Vec3};
use crate::rig::Rig;
use crate::rng::Rng;
use crate::scene::builder::{Builder, Palette, Side};
use crate::scene::furniture;
use crate::texture::material::{Material, Pattern};

const RUBBER: [f32; 3] = [0.13, 0.13, 0.14];
const STEEL: [f32; 3] = [0.50, 0.52, 0.55];
const DARK: [f32; 3] = [0.19, 0.19, 0.21];
/// A screen that is switched off.
const GLASS: [f32; 3] = [0.04, 0.04, 0.05];
/// Height of the lid of a laptop, m, and its inclination backward from upright, rad.
const LID_M: f32 = 0.225;
const LID_LEANS: f32 = 0.35;

/// A rigid actor.
#[derive(Clone, Debug)]
pub struct RigidActor {
    /// Class.
    pub class: Class,
    mesh: Mesh,
    /// Spheres that darken the surroundings, in own axes.
    spheres: Vec<Occluder>,
}

impl RigidActor {
    /// Builds a robot on two tracks, 0.75 m long and 1.2 m high, with a mast, a camera head, an arm and a beacon.
    pub fn robot(instance: u8, palette: &mut Palette, seed: u64) -> Self {
        let spheres = [(0.2, 0.2), (-0.2, 0.2)].map(|(y, radius)| ball(0.0, y, 0.18, radius));
        Self::build(Class::Robot, instance, palette, seed, spheres.to_vec(), |b| {
            let paint = b.rng.pick([[0.88, 0.46, 0.10], [0.86, 0.70, 0.12], [0.74, 0.16, 0.12], [0.20, 0.42, 0.62]]);
            robot(b, paint);
        })
    }

    /// Builds an office chair on castors.
    pub fn chair(instance: u8, palette: &mut Palette, seed: u64) -> Self {
        let spheres = vec![ball(0.0, 0.0, 0.42, 0.2), ball(0.0, 0.0, 0.1, 0.12)];
        Self::build(Class::Chair, instance, palette, seed, spheres, |b| {
            let color = b.rng.pick([[0.48, 0.14, 0.14], [0.16, 0.34, 0.24], [0.20, 0.21, 0.24], [0.60, 0.40, 0.14]]);
            furniture::chair(b, Vec3::zeros(), 0.0, color);
        })
    }

    /// Builds a cardboard box of the given size.
    pub fn cardboard(instance: u8, palette: &mut Palette, size: Vec3, seed: u64) -> Self {
        let spheres = vec![ball(0.0, 0.0, size.z / 2.0, 0.4 * size.min().max(0.2))];
        Self::build(Class::Box, instance, palette, seed, spheres, |b| {
            b.density = 600.0;
            // Slightly above the floor, so that the bottom is visible when the box is lifted.
            b.cuboid(Vec3::z() * 0.011, size - Vec3::z() * 0.011, 0.0, |_| Material::Cardboard);
        })
    }

    /// Builds an open laptop whose lower half has the given size; its screen is off and faces back.
    pub fn laptop(instance: u8, palette: &mut Palette, size: Vec3, seed: u64) -> Self {
        let spheres = vec![ball(0.0, 0.0, 0.06, 0.12)];
        Self::build(Class::Laptop, instance, palette, seed, spheres, |b| {
            let paint = b.rng.pick([STEEL, [0.30, 0.31, 0.34], [0.74, 0.74, 0.76], [0.20, 0.28, 0.42]]);
            b.density = 900.0;
            // Slightly above the floor, like boxes.
            b.cuboid(Vec3::z() * 0.011, size, 0.0, |side| match side {
                Side::Top => Material::Keyboard,
                _ => Material::Plain(paint),
            });
            let hinge = Vec3::new(0.0, size.y / 2.0, 0.011 + size.z);
            let lean = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), -LID_LEANS);
            let lid = Vec3::new(size.x, 0.008, LID_M);
            b.tilted(Isometry3::from_parts(hinge.into(), lean), lid, |side| match side {
                Side::Front => Material::Plain(GLASS),
                _ => Material::Plain(paint),
            });
        })
    }

    /// Builds an object that no person detector knows.
    pub fn unknown(object: UnknownObject, instance: u8, palette: &mut Palette, seed: u64) -> Self {
        match object {
            UnknownObject::Box => Self::cardboard(instance, palette, Vec3::new(0.45, 0.35, 0.35), seed),
            UnknownObject::LargeBox => Self::cardboard(instance, palette, Vec3::new(0.95, 0.45, 0.80), seed),
            UnknownObject::Laptop => Self::laptop(instance, palette, Vec3::new(0.36, 0.25, 0.02), seed),
            UnknownObject::Door => Self::build(Class::Door, instance, palette, seed, Vec::new(), |b| {
                // The hinge is at the left edge.
                let wood = b.rng.pick([[0.52, 0.34, 0.20], [0.66, 0.50, 0.32], [0.40, 0.30, 0.24]]);
                b.cuboid(Vec3::new(0.45, 0.0, 0.0), Vec3::new(0.90, 0.04, 2.0), 0.0, |_| Material::Wood(wood));
                poster(b, Vec3::new(0.45, -0.021, 1.05), [0.42, 0.60]);
                b.cuboid(Vec3::new(0.83, -0.045, 1.02), Vec3::new(0.12, 0.03, 0.03), 0.0, |_| Material::Plain(STEEL));
            }),
            UnknownObject::Wall => Self::build(Class::Wall, instance, palette, seed, Vec::new(), |b| {
                b.cuboid(Vec3::z() * 0.011, Vec3::new(1.7, 0.05, 1.4), 0.0, |_| Material::Plaster([0.60, 0.64, 0.68]));
                for (x, z) in [(-0.60, 0.80), (-0.05, 0.95), (0.50, 0.75), (-0.35, 0.18), (0.35, 0.12)] {
                    poster(b, Vec3::new(x, -0.026, z), [0.36, 0.50]);
                }
            }),
        }
    }

    /// Builds a mesh with the scene builder and turns it into an actor.
    fn build(
        class: Class,
        instance: u8,
        palette: &mut Palette,
        seed: u64,
        spheres: Vec<Occluder>,
        shape: impl FnOnce(&mut Builder),
    ) -> Self {
        let mut builder = Builder::new(seed);
        builder.palette = std::mem::take(palette);
        builder.rng = Rng::new(seed, 0x7819 + u64::from(instance));
        shape(&mut builder);
        *palette = builder.palette;
        let mut mesh = builder.mesh;
        for patch in &mut mesh.patches {
            patch.instance = instance;
            if matches!(patch.lighting, Lighting::Baked) {
                patch.lighting = Lighting::Vertex;
            }
        }
        Self { class, mesh, spheres }
    }

    /// Adds the surface to a rig in which it is carried by bone number `bone`.
    pub fn attach(&self, rig: &mut Rig, bone: usize) {
        rig.attach(&self.mesh, |_| bone);
    }

    /// Returns the spheres at `pose`.
    pub fn occluders(&self, pose: &Isometry3<f32>) -> impl Iterator<Item = Occluder> {
        self.spheres.iter().map(move |s| Occluder { center: (pose * Point3::from(s.center)).coords, ..*s })
    }
}

fn ball(x: f32, y: f32, z: f32, radius: f32) -> Occluder {
    Occluder { center: Vec3::new(x, y, z), radius }
}

/// Adds a poster on a surface that faces the front; `bottom` is the middle of its lower edge.
fn poster(b: &mut Builder, bottom: Vec3, [width, height]: [f32; 2]) {
    let corner = bottom + Vec3::new(-width / 2.0, 0.0, height);
    b.rectangle(corner, Vec3::x() * width, Vec3::z() * -height, Material::Poster);
}

fn robot(b: &mut Builder, paint: [f32; 3]) {
    let cube = |b: &mut Builder, at: [f32; 3], size: [f32; 3], yaw: f32, color: [f32; 3]| {
        b.cuboid(at.into(), size.into(), yaw, |_| Material::Plain(color));
    };
    b.density = 500.0;
    for side in [-1.0, 1.0] {
        track(b, side * 0.24, 0.75, 0.24, 0.11);
        cube(b, [side * 0.24, 0.0, 0.245], [0.12, 0.60, 0.015], 0.0, paint);
    }
    b.cuboid(Vec3::new(0.0, 0.0, 0.10), Vec3::new(0.36, 0.62, 0.17), 0.0, |side| match side {
        Side::Top | Side::Bottom => Material::Plain(paint),
        _ => Material::Shirt(paint, [0.95, 0.94, 0.90], Pattern::Print),
    });
    // Electronics, mast and camera head.
    b.cuboid(Vec3::new(0.0, -0.12, 0.27), Vec3::new(0.28, 0.28, 0.14), 0.0, |side| match side {
        Side::Top => Material::Keyboard,
        _ => Material::Plain(DARK),
    });
    b.turned(Vec3::new(0.0, -0.10, 0.41), &[[0.62, 0.0], [0.62, 0.024], [0.0, 0.028]], 12, Material::Plain(STEEL));
    cube(b, [0.0, -0.08, 1.00], [0.26, 0.12, 0.10], 0.0, paint);
    for x in [-0.08, 0.08] {
        lens(b, Vec3::new(x, -0.02, 1.05), 0.034);
    }
    cube(b, [0.0, -0.02, 0.965], [0.16, 0.05, 0.03], 0.0, DARK);
    b.turned(
        Vec3::new(0.0, -0.10, 1.10),
        &[[0.07, 0.0], [0.06, 0.03], [0.0, 0.035]],
        12,
        Material::Plain([0.95, 0.35, 0.10]),
    );
    b.turned(Vec3::new(0.13, -0.22, 0.41), &[[0.50, 0.0], [0.50, 0.005], [0.0, 0.006]], 6, Material::Plain(DARK));
    // A laser scanner in front and a folded arm.
    let scanner = [[0.09, 0.0], [0.09, 0.05], [0.05, 0.055], [0.04, 0.04], [0.0, 0.055]];
    b.turned(Vec3::new(-0.08, 0.22, 0.27), &scanner, 14, Material::Plain(DARK));
    cube(b, [0.10, 0.12, 0.27], [0.08, 0.08, 0.10], 0.0, STEEL);
    cube(b, [0.10, 0.20, 0.36], [0.05, 0.30, 0.05], 0.0, paint);
    cube(b, [0.10, 0.34, 0.30], [0.07, 0.05, 0.10], 0.0, DARK);
}

/// Adds a track at `x`: a rubber belt around two wheels, with lugs as a pattern, and a flat side.
fn track(b: &mut Builder, x: f32, length: f32, height: f32, width: f32) {
    let (radius, straight) = (height / 2.0, length - height);
    let perimeter = 2.0 * straight + TAU * radius;
    // Outline at share u of the perimeter, from the front of the upper straight, backward: (forward, up) and normal.
    let outline = move |u: f32| -> ([f32; 2], [f32; 2]) {
        let route = u * perimeter;
        let arc = PI * radius;
        let wheel = |middle: f32, angle: f32| {
            let (sin, cos) = libm::sincosf(angle);
            ([middle + radius * cos, radius + radius * sin], [cos, sin])
        };
        if route < straight {
            ([straight / 2.0 - route, 2.0 * radius], [0.0, 1.0])
        } else if route < straight + arc {
            wheel(-straight / 2.0, FRAC_PI_2 + (route - straight) / radius)
        } else if route < 2.0 * straight + arc {
            ([-straight / 2.0 + route - straight - arc, 0.0], [0.0, -1.0])
        } else {
            wheel(straight / 2.0, -FRAC_PI_2 + (route - 2.0 * straight - arc) / radius)
        }
    };
    let belt = b.patch(Material::Shirt(RUBBER, [0.26, 0.26, 0.27], Pattern::Stripes), [width, perimeter]);
    b.mesh.grid(1, 40, belt, |u, v| {
        let ([y, z], [ny, nz]) = outline(v);
        (Vec3::new(x + width * (0.5 - u), y, z), Vec3::new(0.0, ny, nz))
    });
    for side in [-1.0, 1.0] {
        let patch = b.patch(Material::Shirt([0.22, 0.22, 0.23], STEEL, Pattern::Motifs), [perimeter / 2.0, radius]);
        b.mesh.grid(40, 1, patch, |u, v| {
            let ([y, z], _) = outline(if side > 0.0 { 1.0 - u } else { u });
            let share = 1.0 - v;
            let at = Vec3::new(x + side * width / 2.0, y * (1.0 - 0.5 * share), radius + (z - radius) * (1.0 - share));
            (at, Vec3::x() * side)
        });
    }
}

/// Adds a round lens that faces forward.
fn lens(b: &mut Builder, at: Vec3, radius: f32) {
    let first = b.mesh.vertices.len();
    b.turned(Vec3::zeros(), &[[0.03, 0.0], [0.03, radius], [0.0, radius]], 14, Material::Plain([0.07, 0.08, 0.12]));
    let forward = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), -FRAC_PI_2);
    b.mesh.transform_from(first, &Isometry3::from_parts(at.into(), forward));
}
