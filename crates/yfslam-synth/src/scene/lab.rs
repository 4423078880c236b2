//! An empty laboratory: white walls with hardly any texture. Only edges are visible: skirting, cable duct, sockets, lamps, floor
//! seams, a whiteboard, two doors, a bench along the wall.

use nalgebra::Point3;

use super::builder::{Builder, Side};
use super::wall::Wall;
use super::{Company, Scene, Seat};
use crate::light::{Lamp, Lights};
use crate::look_at::look_at;
use crate::mesh::Vec3;
use crate::texture::material::Material;

const X: [f32; 2] = [-3.0, 3.0];
const Y: [f32; 2] = [-2.4, 3.0];
const HEIGHT: f32 = 2.8;
const DOOR: [f32; 2] = [1.02, 2.08];
const WHITE: [f32; 3] = [0.90, 0.91, 0.90];
const GREY: [f32; 3] = [0.66, 0.68, 0.70];
const STEEL: [f32; 3] = [0.58, 0.60, 0.62];

pub fn build(seed: u64) -> Scene {
    let mut b = Builder::new(seed);
    let walls = Wall::room(X, Y);
    let lamps = shell(&mut b, &walls);
    fixtures(&mut b, &walls);
    let seats = vec![stool(&mut b, -0.95, 0.75, -2.2), stool(&mut b, 0.9, 0.85, 2.4)];
    let stand = |x: f32, y: f32, heading: f32| Seat { position: Vec3::new(x, y, 0.0), heading };
    Scene {
        mesh: b.mesh,
        palette: b.palette,
        lights: Lights { lamps, ambient: [[0.62, 0.63, 0.66], [0.55, 0.55, 0.55]] },
        camera: look_at(Point3::new(0.0, -1.3, 1.36), Point3::new(0.0, 1.4, 1.02)),
        walk_center: Point3::new(0.0, 0.9, 0.0),
        walk_half_width: 2.2,
        walk_far_y: 2.0,
        walk_near_y: [-0.65, -0.30],
        circuit: vec![[0.0, -1.3], [-1.6, -1.2], [-1.6, 1.5], [1.6, 1.5], [1.6, -1.2]],
        company: Company::Apart,
        seats,
        stands: vec![stand(-1.7, 1.2, -2.4), stand(1.8, 1.1, 2.4), stand(-0.4, 2.0, 3.0), stand(0.6, 1.9, -2.8)],
    }
}

/// Adds floor, ceiling, walls, lamps.
fn shell(b: &mut Builder, walls: &[Wall; 4]) -> Vec<Lamp> {
    b.density = 260.0;
    // Sheets of floor, 1.5 m × 1.8 m.
    for (i, j) in (0..4).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let top_left = Vec3::new(X[0] + 1.5 * i as f32, Y[1] - 1.8 * j as f32, 0.0);
        b.rectangle(top_left, Vec3::x() * 1.5, -Vec3::y() * 1.8, Material::Vinyl([0.70, 0.73, 0.75]));
    }
    b.density = 140.0;
    b.rectangle(Vec3::new(X[0], Y[0], HEIGHT), Vec3::x() * (X[1] - X[0]), Vec3::y() * (Y[1] - Y[0]), Material::Ceiling);
    for wall in walls {
        b.density = 220.0;
        wall.panels(b, 3.1, [0.0, HEIGHT], Material::Paint(WHITE));
        b.density = 200.0;
        let middle = wall.length / 2.0;
        wall.mount(b, [middle, 0.0], Vec3::new(wall.length, 0.015, 0.08), |_| Material::Plain(GREY));
    }
    let half = [Vec3::x() * 0.6, Vec3::y() * 0.15];
    let places = [(-1.5, -1.0, true), (1.5, -1.0, false), (-1.5, 1.6, false), (1.5, 1.6, true)];
    b.density = 250.0;
    places.map(|(x, y, steady)| b.lamp(Vec3::new(x, y, HEIGHT - 0.03), half, 1.3, [2.6, 2.6, 2.55], steady)).to_vec()
}

/// Adds the few objects on and along the walls.
fn fixtures(b: &mut Builder, [north, east, south, west]: &[Wall; 4]) {
    b.density = 400.0;
    // Left edges of the doors, which interrupt the duct.
    let doors = [None, None, Some(1.2), Some(3.0)];
    for (wall, door) in [north, east, south, west].into_iter().zip(doors) {
        let blocked = |from: f32, to: f32| door.is_some_and(|left| to > left && from < left + DOOR[0]);
        // The cable duct at bench height with a lid joint every metre, and sockets on it.
        let joints = (wall.length - 0.2).floor() as usize;
        let section = (wall.length - 0.1) / joints as f32;
        for k in 0..joints {
            let s = 0.05 + (k as f32 + 0.5) * section;
            if blocked(s - 0.5 * section, s + 0.5 * section) {
                continue;
            }
            wall.mount(b, [s, 1.02], Vec3::new(section - 0.006, 0.05, 0.13), |_| Material::Plain([0.80, 0.81, 0.82]));
        }
        for s in
            [0.7, 1.1, 2.4, 3.9, 4.3, 5.1].into_iter().filter(|&s| s + 0.2 < wall.length && !blocked(s - 0.5, s + 0.6))
        {
            b.density = 900.0;
            b.rectangle(wall.at(s, 1.13, 0.062), wall.right * 0.16, -Vec3::z() * 0.08, Material::Socket);
            b.density = 400.0;
        }
    }
    b.density = 500.0;
    north.attach(b, [0.9, 2.05], [1.5, 0.95], Material::Whiteboard);
    north.mount(b, [1.65, 1.09], Vec3::new(1.4, 0.06, 0.02), |_| Material::Plain(STEEL));
    north.attach(b, [5.0, 2.35], [0.34, 0.17], Material::Sign([0.10, 0.48, 0.30]));
    b.density = 900.0;
    north.attach(b, [2.6, 1.75], [0.21, 0.297], Material::Paper);
    north.attach(b, [4.15, 1.62], [0.15, 0.15], Material::Sign([0.16, 0.36, 0.62]));
    b.density = 350.0;
    // Ventilation grilles and a pipe under the ceiling.
    north.attach(b, [3.1, 2.55], [0.6, 0.25], Material::Ribs([0.80; 3]));
    west.attach(b, [3.4, 2.55], [0.6, 0.25], Material::Ribs([0.80; 3]));
    north.mount(b, [3.0, 2.62], Vec3::new(5.9, 0.08, 0.08), |_| Material::Plain([0.78, 0.79, 0.80]));
    for s in [0.9, 2.5, 4.1, 5.6] {
        north.mount(b, [s, 2.60], Vec3::new(0.04, 0.10, 0.12), |_| Material::Plain(STEEL));
    }
    b.density = 450.0;
    west.door(b, 3.0, DOOR, [0.66, 0.70, 0.74]);
    south.door(b, 1.2, DOOR, [0.66, 0.70, 0.74]);
    b.density = 800.0;
    west.attach(b, [4.2, 1.30], [0.09, 0.09], Material::Socket);
    west.attach(b, [2.6, 2.3], [0.30, 0.15], Material::Sign([0.62, 0.14, 0.13]));
    east.attach(b, [1.6, 1.9], [0.42, 0.6], Material::Poster);
    east.attach(b, [3.6, 1.8], [0.21, 0.297], Material::Paper);
    south.attach(b, [3.4, 1.9], [0.6, 0.42], Material::Poster);
    bench(b, north);
    b.density = 300.0;
    east.mount(b, [4.3, 0.0], Vec3::new(0.9, 0.45, 1.9), |side| match side {
        Side::Front => Material::Ribs([0.72, 0.74, 0.76]),
        _ => Material::Plain([0.72, 0.74, 0.76]),
    });
    b.density = 450.0;
    west.mount(b, [1.7, 0.0], Vec3::new(0.42, 0.36, 0.32), |_| Material::Cardboard);
}

/// Adds a bench along the right half of the north wall, empty except for a clamp stand and a box.
fn bench(b: &mut Builder, north: &Wall) {
    b.density = 350.0;
    north.mount(b, [4.55, 0.86], Vec3::new(2.5, 0.62, 0.035), |_| Material::Plain([0.56, 0.58, 0.60]));
    for s in [3.4, 4.2, 5.0] {
        north.mount(b, [s + 0.36, 0.08], Vec3::new(0.76, 0.55, 0.76), |_| Material::Plain([0.82, 0.83, 0.84]));
        for z in [0.24, 0.48, 0.72] {
            let handle = north.at(s + 0.36, z, 0.57);
            b.cuboid(handle, Vec3::new(0.18, 0.02, 0.015), north.yaw(), |_| Material::Plain(STEEL));
        }
    }
    let on = |s: f32, out: f32| north.at(s, 0.895, out);
    b.density = 500.0;
    b.cuboid(on(3.7, 0.3), Vec3::new(0.26, 0.16, 0.02), 0.1, |_| Material::Plain(GREY));
    b.turned(on(3.7, 0.3), &[[0.62, 0.0], [0.62, 0.008], [0.0, 0.008]], 8, Material::Plain(STEEL));
    b.cuboid(on(4.6, 0.28), Vec3::new(0.32, 0.26, 0.20), -0.15, |side| match side {
        Side::Front => Material::Keyboard,
        _ => Material::Plain([0.80, 0.80, 0.78]),
    });
    b.turned(on(5.2, 0.35), &[[0.17, 0.0], [0.17, 0.03], [0.11, 0.05], [0.0, 0.06]], 16, Material::Plain(STEEL));
}

/// Adds a round stool; returns its seat.
fn stool(b: &mut Builder, x: f32, y: f32, heading: f32) -> Seat {
    const SEAT_Z: f32 = 0.46;
    let base = Vec3::new(x, y, 0.0);
    b.density = 400.0;
    b.turned(
        base,
        &[[SEAT_Z, 0.0], [SEAT_Z, 0.17], [0.42, 0.18], [0.41, 0.03], [0.03, 0.03], [0.02, 0.20], [0.0, 0.21]],
        20,
        Material::Plain([0.30, 0.33, 0.38]),
    );
    Seat { position: base + Vec3::z() * SEAT_Z, heading }
}
