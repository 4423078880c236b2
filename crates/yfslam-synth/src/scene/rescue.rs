//! A damaged hall: bare concrete, pillars with warning stripes, heaps of rubble, a fallen slab, crates, barrels and pipes under a
//! few lamps. It has little texture and many edges.

use nalgebra::{Isometry3, Point3, UnitQuaternion};

use super::builder::Builder;
use super::wall::Wall;
use super::{Company, Scene, Seat};
use crate::light::{Lamp, Lights};
use crate::look_at::look_at;
use crate::mesh::Vec3;
use crate::texture::material::Material;

const X: [f32; 2] = [-7.0, 7.0];
const Y: [f32; 2] = [-4.0, 8.0];
const HEIGHT: f32 = 4.4;
const CONCRETE: [f32; 3] = [0.58, 0.57, 0.55];
const RUST: [f32; 3] = [0.45, 0.30, 0.22];

/// A circuit around the large heap for robots and people, which stays free of rubble.
const CIRCUIT: [[f64; 2]; 6] = [[0.0, -2.3], [-4.3, -2.2], [-4.5, 4.0], [-1.0, 6.3], [4.4, 5.8], [4.6, -2.2]];

pub fn build(seed: u64) -> Scene {
    let mut b = Builder::new(seed);
    let walls = Wall::room(X, Y);
    let lamps = shell(&mut b, &walls);
    pillars(&mut b);
    fallen(&mut b);
    for (x, y, radius, height, count) in [
        (0.2, 2.5, 1.9, 0.9, 170),
        (-2.5, 2.6, 1.0, 0.5, 45),
        (2.9, 1.5, 1.1, 0.5, 50),
        (-6.0, 0.5, 1.2, 0.6, 60),
        (6.1, 2.6, 1.2, 0.6, 50),
        (1.6, 7.4, 1.3, 0.5, 50),
        (-5.6, 6.8, 1.5, 0.7, 70),
        (5.9, -2.0, 0.9, 0.4, 30),
        (-2.4, -3.6, 1.2, 0.4, 36),
    ] {
        heap(&mut b, [x, y], radius, height, count);
    }
    stores(&mut b, &walls);
    let stand = |x: f32, y: f32, heading: f32| Seat { position: Vec3::new(x, y, 0.0), heading };
    let crate_seat = |x: f32, y: f32, heading: f32| Seat { position: Vec3::new(x, y, 0.46), heading };
    Scene {
        mesh: b.mesh,
        palette: b.palette,
        lights: Lights { lamps, ambient: [[0.34, 0.35, 0.38], [0.26, 0.25, 0.24]] },
        camera: look_at(Point3::new(0.0, -1.9, 1.36), Point3::new(0.1, 1.2, 0.80)),
        walk_center: Point3::new(0.0, -0.4, 0.0),
        walk_half_width: 2.1,
        walk_far_y: 0.45,
        walk_near_y: [-1.25, -0.90],
        circuit: CIRCUIT.to_vec(),
        company: Company::Ahead,
        seats: vec![crate_seat(-1.52, 0.88, -2.5), crate_seat(1.72, 0.86, 2.6)],
        stands: vec![stand(-0.6, 0.3, 2.9), stand(0.7, 0.25, -2.9), stand(-2.2, 0.0, -2.2), stand(2.5, -0.2, 2.2)],
    }
}

/// Adds floor, walls, ceiling beams, lamps.
fn shell(b: &mut Builder, walls: &[Wall; 4]) -> Vec<Lamp> {
    let (dx, dy) = ((X[1] - X[0]) / 4.0, (Y[1] - Y[0]) / 4.0);
    for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
        let (x, y) = (X[0] + i as f32 * dx, Y[0] + j as f32 * dy);
        b.density = 220.0;
        b.rectangle(Vec3::new(x, y + dy, 0.0), Vec3::x() * dx, -Vec3::y() * dy, Material::Concrete([0.50, 0.49, 0.47]));
        b.density = 70.0;
        b.rectangle(Vec3::new(x, y, HEIGHT), Vec3::x() * dx, Vec3::y() * dy, Material::Concrete([0.44, 0.44, 0.43]));
    }
    for wall in walls {
        b.density = 160.0;
        wall.panels(b, 3.6, [0.0, HEIGHT], Material::Concrete(CONCRETE));
        b.density = 150.0;
        wall.mount(b, [wall.length / 2.0, 3.3], Vec3::new(wall.length, 0.14, 0.14), |_| {
            Material::Rusty([0.34, 0.40, 0.36])
        });
    }
    b.density = 100.0;
    for x in [-4.6, -1.5, 1.5, 4.6] {
        let size = Vec3::new(0.3, Y[1] - Y[0], 0.35);
        b.cuboid(Vec3::new(x, (Y[0] + Y[1]) / 2.0, HEIGHT - 0.35), size, 0.0, |_| Material::Rusty([0.42, 0.42, 0.44]));
    }
    b.density = 200.0;
    let half = [Vec3::x() * 0.5, Vec3::y() * 0.25];
    [(-3.0, -1.2, true), (3.0, -1.4, false), (0.1, 0.6, false), (-3.2, 4.6, false), (3.2, 4.4, true)]
        .map(|(x, y, steady)| b.lamp(Vec3::new(x, y, HEIGHT - 0.5), half, 1.3, [6.4, 6.1, 5.4], steady))
        .to_vec()
}

fn pillars(b: &mut Builder) {
    for (x, y) in [(-2.9, 1.3), (3.0, 2.6), (-2.6, 4.6), (2.4, 4.9)] {
        b.density = 330.0;
        b.cuboid(Vec3::new(x, y, 0.0), Vec3::new(0.5, 0.5, 1.1), 0.0, |_| Material::Hazard);
        b.density = 220.0;
        b.cuboid(Vec3::new(x, y, 1.1), Vec3::new(0.48, 0.48, HEIGHT - 1.1), 0.0, |_| Material::Concrete(CONCRETE));
    }
}

/// Adds a slab of the roof that leans on the large heap, and pipes across it.
fn fallen(b: &mut Builder) {
    let tilt = UnitQuaternion::from_euler_angles(0.42, -0.14, 0.35);
    b.density = 240.0;
    b.tilted(Isometry3::from_parts(Vec3::new(0.5, 2.75, 0.50).into(), tilt), Vec3::new(1.9, 2.2, 0.16), |_| {
        Material::Concrete([0.62, 0.61, 0.58])
    });
    b.density = 300.0;
    for (x, y, z, length, turn, dip) in [
        (-0.6, 1.6, 0.80, 2.4, 0.5, 0.22),
        (1.0, 1.3, 0.55, 1.8, -0.6, -0.15),
        (-2.2, 3.3, 0.55, 2.0, 1.1, 0.2),
        (5.7, 1.2, 0.6, 2.2, 1.9, 0.25),
    ] {
        let turn = UnitQuaternion::from_euler_angles(0.0, dip, turn);
        let pose = Isometry3::from_parts(Vec3::new(x, y, z).into(), turn);
        b.tilted(pose, Vec3::new(length, 0.07, 0.07), |_| Material::Rusty(RUST));
    }
}

/// Adds broken concrete, piled higher towards the middle; the routes stay free.
fn heap(b: &mut Builder, [x, y]: [f32; 2], radius: f32, height: f32, count: usize) {
    for k in 0..count {
        let (angle, far) = (b.rng.range(0.0, std::f32::consts::TAU), b.rng.range(0.0, 1.0).sqrt());
        let at = [x + radius * far * libm::cosf(angle), y + radius * far * libm::sinf(angle)];
        let largest = if k % 5 == 0 { 0.62 } else { 0.36 };
        let size = Vec3::from_fn(|_, _| b.rng.range(0.10, largest));
        if !is_free(at, 0.45 + 0.5 * size.max()) {
            continue;
        }
        // Later fragments lie on earlier ones.
        let z = height * (1.0 - far).min(0.6) * (k as f32 / count as f32) + 0.08;
        let turn =
            UnitQuaternion::from_euler_angles(b.rng.range(-0.7, 0.7), b.rng.range(-0.7, 0.7), b.rng.range(-3.1, 3.1));
        let shade = b.rng.range(0.75, 1.1);
        let color = if b.rng.chance(0.18) { [0.55, 0.33, 0.26] } else { CONCRETE.map(|c| c * shade) };
        b.density = 330.0;
        b.chunk(Isometry3::from_parts(Vec3::new(at[0], at[1], z).into(), turn), size, Material::Concrete(color));
    }
}

/// Returns whether an object at `place` leaves the circuit and the ground before the camera free by `margin`.
fn is_free(place: [f32; 2], margin: f32) -> bool {
    let [x, y] = place.map(f64::from);
    let margin = f64::from(margin);
    let sides = CIRCUIT.iter().zip(CIRCUIT.iter().cycle().skip(1));
    let off_round = sides.into_iter().all(|(a, b)| {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let t = (((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
        libm::hypot(x - a[0] - t * dx, y - a[1] - t * dy) > margin
    });
    off_round && (x.abs() > 2.5 + margin || y < -4.0 + margin || y > 0.45 + margin)
}

/// Adds crates, barrels and boards.
fn stores(b: &mut Builder, [north, east, south, west]: &[Wall; 4]) {
    let wood = Material::Planks([0.62, 0.47, 0.30]);
    for (x, y, z, size, yaw) in [
        (-1.55, 1.00, 0.0, 0.46, 0.4),
        (1.75, 0.98, 0.0, 0.46, -0.3),
        (-3.3, 0.35, 0.0, 0.75, 0.2),
        (-3.25, 0.40, 0.75, 0.55, 0.5),
        (3.4, 0.55, 0.0, 0.70, -0.25),
        (-6.3, -2.6, 0.0, 0.8, 0.1),
        (-6.3, -2.6, 0.8, 0.6, 0.4),
        (6.2, -3.2, 0.0, 0.8, -0.2),
        (-3.6, 7.3, 0.0, 0.8, 0.2),
        (3.4, 7.3, 0.0, 0.75, -0.1),
        (3.5, 7.3, 0.75, 0.5, 0.3),
        (0.0, 4.5, 0.0, 0.6, 0.7),
    ] {
        b.density = 380.0;
        b.cuboid(Vec3::new(x, y, z), Vec3::new(size * 1.15, size, size), yaw, |_| wood);
    }
    b.density = 330.0;
    let rings = [[0.88, 0.0], [0.88, 0.29], [0.0, 0.29]];
    for (x, y, color) in [
        (2.65, 1.15, [0.20, 0.34, 0.46]),
        (-2.2, 1.45, [0.52, 0.22, 0.16]),
        (6.4, -0.2, [0.24, 0.40, 0.30]),
        (6.3, 0.5, [0.52, 0.22, 0.16]),
        (-6.4, 3.4, [0.20, 0.34, 0.46]),
        (5.9, 7.2, [0.62, 0.50, 0.14]),
        (-0.9, 4.1, [0.62, 0.50, 0.14]),
    ] {
        b.turned(Vec3::new(x, y, 0.0), &rings, 24, Material::Rusty(color));
    }
    b.density = 400.0;
    for (wall, s, z) in [(north, 4.4, 2.6), (north, 10.0, 2.4), (east, 6.0, 2.3), (south, 7.2, 2.4), (west, 5.2, 2.3)] {
        let color = b.rng.pick([[0.10, 0.46, 0.28], [0.66, 0.15, 0.13], [0.16, 0.36, 0.62]]);
        wall.attach(b, [s, z], [0.9, 0.45], Material::Sign(color));
    }
    b.density = 260.0;
    north.door(b, 6.3, [2.2, 2.5], [0.40, 0.44, 0.46]);
    south.attach(b, [3.0, 2.5], [2.2, 2.5], Material::Ribs([0.46, 0.48, 0.47]));
    for (wall, s) in [(west, 2.0), (west, 8.5), (east, 3.0), (north, 1.5), (north, 12.0)] {
        wall.mount(b, [s, 0.4], Vec3::new(0.9, 0.22, 1.3), |_| Material::Rusty([0.40, 0.44, 0.42]));
    }
}
