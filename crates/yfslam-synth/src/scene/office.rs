//! An office: a desk row in the middle with monitors and clutter, shelves, posters and a whiteboard around it.

use std::f32::consts::{FRAC_PI_2, PI};

use nalgebra::Point3;

use super::builder::Builder;
use super::furniture::{bin, bookshelf, chair, desk, lying_book, monitor, mug, plant};
use super::{Company, Scene, Seat};
use crate::light::{Lamp, Lights};
use crate::look_at::look_at;
use crate::mesh::Vec3;
use crate::texture::material::Material;

/// Walls: x from −3.2 to 3.2, y from −2.8 to 3.2, height 2.7 m. The camera is near −y and faces +y.
const WEST: f32 = -3.2;
const EAST: f32 = 3.2;
const SOUTH: f32 = -2.8;
const NORTH: f32 = 3.2;
const HEIGHT: f32 = 2.7;
const DESK_TOP: f32 = 0.74;

pub fn build(seed: u64) -> Scene {
    let mut b = Builder::new(seed);
    let lamps = room(&mut b);
    desks(&mut b);
    partition(&mut b);
    surroundings(&mut b);
    let blue = [0.22, 0.30, 0.46];
    let (left_heading, right_heading) = (-1.9, 1.7);
    let left = chair(&mut b, Vec3::new(-0.88, 0.28, 0.0), left_heading, blue);
    let right = chair(&mut b, Vec3::new(0.90, 0.26, 0.0), right_heading, [0.38, 0.36, 0.34]);
    let seats = vec![Seat { position: left, heading: left_heading }, Seat { position: right, heading: right_heading }];
    let stand = |x: f32, y: f32, heading: f32| Seat { position: Vec3::new(x, y, 0.0), heading };
    Scene {
        mesh: b.mesh,
        palette: b.palette,
        lights: Lights { lamps, ambient: [[0.66, 0.66, 0.69], [0.48, 0.45, 0.41]] },
        camera: look_at(Point3::new(0.0, -1.90, 1.40), Point3::new(0.0, 1.2, 1.15)),
        walk_center: Point3::new(0.0, 0.9, 0.0),
        walk_half_width: 2.3,
        walk_far_y: 2.3,
        walk_near_y: [-1.1, -0.75],
        company: Company::Apart,
        seats,
        circuit: vec![[0.0, -1.2], [-2.05, -1.0], [-2.05, 2.3], [2.1, 2.3], [2.1, -1.0]],
        stands: vec![stand(-1.75, 0.6, -2.0), stand(1.8, 0.7, 2.2), stand(-0.5, 2.1, PI), stand(0.7, 2.2, -2.6)],
    }
}

/// Adds floor, walls, ceiling, window and lamps.
fn room(b: &mut Builder) -> Vec<Lamp> {
    let (dx, dy, dz) = (Vec3::x() * (EAST - WEST), Vec3::y() * (NORTH - SOUTH), Vec3::z() * HEIGHT);
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    b.density = 250.0;
    b.rectangle(corner(WEST, NORTH, 0.0), dx, -dy, Material::Floor([0.56, 0.60, 0.66]));
    b.density = 160.0;
    b.rectangle(corner(WEST, SOUTH, HEIGHT), dx, dy, Material::Ceiling);
    b.density = 220.0;
    b.rectangle(corner(WEST, NORTH, HEIGHT), dx, -dz, Material::Plaster([0.86, 0.85, 0.80]));
    b.rectangle(corner(EAST, SOUTH, HEIGHT), -dx, -dz, Material::Plaster([0.84, 0.85, 0.84]));
    b.rectangle(corner(WEST, SOUTH, HEIGHT), dy, -dz, Material::Plaster([0.80, 0.84, 0.82]));
    b.rectangle(corner(EAST, NORTH, HEIGHT), -dy, -dz, Material::Plaster([0.86, 0.82, 0.76]));
    // Skirting boards and a cable duct along the back wall.
    b.density = 250.0;
    let wood = |_| Material::Wood([0.55, 0.45, 0.35]);
    b.cuboid(corner(0.0, NORTH - 0.01, 0.0), Vec3::new(EAST - WEST, 0.02, 0.09), 0.0, wood);
    b.cuboid(corner(WEST + 0.01, 0.2, 0.0), Vec3::new(NORTH - SOUTH, 0.02, 0.09), FRAC_PI_2, wood);
    b.cuboid(corner(EAST - 0.01, 0.2, 0.0), Vec3::new(NORTH - SOUTH, 0.02, 0.09), FRAC_PI_2, wood);
    // The window in the east wall is also a lamp.
    let window = Lamp {
        center: corner(EAST - 0.03, 0.6, 1.6),
        half: [Vec3::y() * 0.9, Vec3::z() * 0.6],
        normal: -Vec3::x(),
        radiance: [1.00, 1.12, 1.30],
        steady: true,
    };
    b.density = 250.0;
    b.glowing(corner(EAST - 0.02, 1.5, 2.2), -Vec3::y() * 1.8, -Vec3::z() * 1.2, Material::Outdoors, 1.1);
    for y in [-0.3, 0.6, 1.5] {
        let frame = |_| Material::Plain([0.90, 0.90, 0.88]);
        b.cuboid(corner(EAST - 0.02, y, 1.0), Vec3::new(0.04, 0.06, 1.2), 0.0, frame);
    }
    b.cuboid(corner(EAST - 0.06, 0.6, 0.96), Vec3::new(0.14, 1.9, 0.04), 0.0, |_| Material::Plain([0.88; 3]));
    let mut lamps = vec![window];
    for (x, y) in [(-1.3, -0.6), (1.3, -0.6), (-1.3, 1.6), (1.3, 1.6)] {
        let half = [Vec3::x() * 0.6, Vec3::y() * 0.15];
        let center = corner(x, y, HEIGHT - 0.03);
        lamps.push(b.lamp(center, half, 1.3, [2.7, 2.62, 2.46], false));
    }
    lamps
}

/// Adds the desk row and the objects on it.
fn desks(b: &mut Builder) {
    for x in [-0.78, 0.78] {
        desk(b, Vec3::new(x, 1.0, 0.0), 1.5, 0.8, DESK_TOP);
    }
    let on = |x: f32, y: f32| Vec3::new(x, y, DESK_TOP);
    monitor(b, on(-0.85, 1.12), 0.12);
    monitor(b, on(0.55, 1.15), -0.05);
    monitor(b, on(1.16, 1.05), -0.45);
    for (x, y, yaw) in [(-0.85, 0.78, 0.05), (0.60, 0.76, -0.04)] {
        b.density = 900.0;
        let keys = Material::Keyboard;
        b.cuboid(on(x, y), Vec3::new(0.44, 0.15, 0.022), yaw, |side| match side {
            super::builder::Side::Top => keys,
            _ => Material::Plain([0.18; 3]),
        });
        b.cuboid(on(x + 0.30, y), Vec3::new(0.06, 0.10, 0.03), yaw, |_| Material::Plain([0.25; 3]));
    }
    for (x, y, count) in [(-0.30, 0.95, 4), (0.12, 1.10, 6), (-1.36, 0.85, 3), (1.38, 0.74, 2), (-0.12, 0.72, 1)] {
        let mut z = DESK_TOP;
        for _ in 0..count {
            let yaw = b.rng.range(-0.4, 0.4);
            z += lying_book(b, Vec3::new(x, y, z), yaw);
        }
    }
    b.density = 900.0;
    for (x, y, yaw) in [(-0.48, 0.75, 0.3), (0.22, 0.74, -0.2), (1.05, 0.72, 0.5), (-1.2, 0.70, -0.3)] {
        b.cuboid(on(x, y), Vec3::new(0.21, 0.297, 0.003), yaw, |_| Material::Paper);
    }
    for (x, y) in [(-0.55, 1.05), (0.34, 0.95), (0.92, 0.88), (-1.15, 1.25)] {
        mug(b, on(x, y));
    }
    b.density = 600.0;
    b.cuboid(on(-1.32, 1.22), Vec3::new(0.22, 0.18, 0.20), 0.3, |_| Material::Cardboard);
    b.cuboid(on(0.05, 1.30), Vec3::new(0.30, 0.12, 0.34), 0.05, |_| Material::Poster);
}

/// Adds a plain partition behind the desks, which hides people behind it, and the papers on it.
fn partition(b: &mut Builder) {
    b.density = 300.0;
    let grey = [0.60, 0.63, 0.66];
    b.cuboid(Vec3::new(0.0, 1.47, 0.0), Vec3::new(3.1, 0.05, 1.75), 0.0, |_| Material::Cloth(grey));
    b.density = 700.0;
    for (x, z, w, h) in [(-1.30, 1.68, 0.30, 0.42), (0.02, 1.66, 0.42, 0.30), (1.14, 1.70, 0.21, 0.30)] {
        b.rectangle(Vec3::new(x, 1.44, z), Vec3::x() * w, -Vec3::z() * h, Material::Poster);
    }
}

/// Adds the objects along the walls.
fn surroundings(b: &mut Builder) {
    bookshelf(b, Vec3::new(-2.25, NORTH - 0.16, 0.0), 1.5, 2.05, 5);
    bookshelf(b, Vec3::new(2.45, NORTH - 0.16, 0.0), 1.2, 1.25, 3);
    b.density = 700.0;
    let north = NORTH - 0.012;
    for (x, z, w, h) in [(-1.30, 2.25, 0.60, 0.84), (-0.62, 2.42, 0.42, 0.60), (-0.60, 1.74, 0.38, 0.5)] {
        b.rectangle(Vec3::new(x, north, z), Vec3::x() * w, -Vec3::z() * h, Material::Poster);
    }
    b.rectangle(Vec3::new(0.0, north, 2.15), Vec3::x() * 1.6, -Vec3::z() * 1.0, Material::Whiteboard);
    for (x, z) in [(1.9, 2.4), (2.5, 2.2)] {
        b.rectangle(Vec3::new(x, north, z), Vec3::x() * 0.45, -Vec3::z() * 0.62, Material::Poster);
    }
    b.density = 500.0;
    for (y, z, w, h) in [(-1.9, 2.2, 0.9, 0.65), (-0.7, 2.3, 0.6, 0.85), (0.4, 2.1, 1.0, 0.7), (1.8, 2.2, 0.6, 0.84)] {
        let at = Vec3::new(WEST + 0.012, y, z);
        b.rectangle(at, Vec3::y() * w, -Vec3::z() * h, Material::Poster);
    }
    for (y, z, w, h) in [(-0.6, 2.2, 0.85, 0.6), (2.6, 2.2, 0.6, 0.84), (-1.7, 2.1, 0.6, 0.84)] {
        let at = Vec3::new(EAST - 0.012, y, z);
        b.rectangle(at, -Vec3::y() * w, -Vec3::z() * h, Material::Poster);
    }
    for (x, z, w, h) in [(2.4, 2.2, 0.9, 0.65), (0.6, 2.3, 1.2, 0.8), (-1.5, 2.2, 0.7, 0.9)] {
        let at = Vec3::new(x, SOUTH + 0.012, z);
        b.rectangle(at, -Vec3::x() * w, -Vec3::z() * h, Material::Poster);
    }
    b.density = 500.0;
    for (x, y, z, s, yaw) in [
        (-2.75, 0.9, 0.0, 0.50, 0.1),
        (-2.72, 0.9, 0.50, 0.38, 0.5),
        (-2.8, 0.2, 0.0, 0.42, -0.2),
        (2.78, 2.2, 0.0, 0.48, 0.2),
        (2.80, -0.9, 0.0, 0.50, 0.0),
        (2.80, -0.9, 0.50, 0.36, 0.4),
        (0.0, 1.0, 0.0, 0.34, 0.2),
        (-1.2, 1.05, 0.0, 0.30, 0.1),
        (1.2, 1.1, 0.0, 0.36, -0.3),
        (0.9, 2.95, 0.0, 0.34, 0.1),
    ] {
        b.cuboid(Vec3::new(x, y, z), Vec3::new(s, s * 0.85, s * 0.8), yaw, |_| Material::Cardboard);
    }
    plant(b, Vec3::new(2.75, 0.35, 0.0));
    plant(b, Vec3::new(-1.1, 2.95, 0.0));
    bin(b, Vec3::new(2.85, 1.45, 0.0));
    bin(b, Vec3::new(-0.25, 0.75, 0.0));
}
