//! Four corridors around a block, as in an institute: similar everywhere (doors, lamps, radiators at the same pitch), but each
//! place differs in its plates, papers, colours and objects.

use nalgebra::Point3;

use super::builder::{Builder, Side};
use super::furniture::{bin, plant};
use super::wall::Wall;
use super::{Company, Scene, Seat};
use crate::light::{Lamp, Lights};
use crate::look_at::look_at;
use crate::mesh::Vec3;
use crate::texture::material::Material;
use crate::texture::print::ink;

/// Half extent of the middle line of the corridors: 4 · (6.4 + 5.0) = 45.6 m around.
const MIDDLE: [f32; 2] = [6.4, 5.0];
/// Half the width of a corridor.
const HALF: f32 = 1.2;
const HEIGHT: f32 = 2.7;
/// Height up to which the walls are painted in the colour of the corridor.
const DADO: f32 = 1.05;
/// Colours of the corridors.
const COLORS: [[f32; 3]; 4] = [[0.60, 0.66, 0.58], [0.56, 0.63, 0.72], [0.74, 0.66, 0.52], [0.68, 0.60, 0.60]];
const WHITE: [f32; 3] = [0.86, 0.86, 0.83];
const STEEL: [f32; 3] = [0.60, 0.61, 0.63];

pub fn build(seed: u64) -> Scene {
    let mut b = Builder::new(seed);
    let [mx, my] = MIDDLE;
    let span = |m: f32| [-m, m];
    let outer = Wall::room(span(mx + HALF), span(my + HALF));
    let inner = Wall::block(span(mx - HALF), span(my - HALF));
    // The south side of the block faces the south corridor and so on: both are brought into the order north, east, south, west.
    let inner = [inner[2], inner[1], inner[0], inner[3]];
    let lamps = floor_and_ceiling(&mut b);
    for (k, color) in COLORS.into_iter().enumerate() {
        for wall in [&outer[k], &inner[k]] {
            b.density = 180.0;
            wall.panels(&mut b, 2.7, [DADO, HEIGHT], Material::Plaster(WHITE));
            wall.panels(&mut b, 2.7, [0.0, DADO], Material::Plaster(color));
            let middle = wall.length / 2.0;
            wall.mount(&mut b, [middle, 0.0], Vec3::new(wall.length, 0.02, 0.09), |_| {
                Material::Plain([0.36, 0.36, 0.38])
            });
            wall.mount(&mut b, [middle, DADO], Vec3::new(wall.length, 0.02, 0.05), |_| {
                Material::Wood([0.62, 0.50, 0.36])
            });
        }
        outer_bays(&mut b, &outer[k], k);
        inner_bays(&mut b, &inner[k], k);
    }
    landmarks(&mut b, &outer);
    let seats = bench(&mut b, &outer[3]);
    let west = -f64::from(mx);
    let stand = |x: f32, y: f32, heading: f32| Seat { position: Vec3::new(x - mx, y, 0.0), heading };
    Scene {
        mesh: b.mesh,
        palette: b.palette,
        lights: Lights { lamps, ambient: [[0.55, 0.55, 0.56], [0.46, 0.45, 0.43]] },
        camera: look_at(Point3::new(west, -3.3, 1.40), Point3::new(west, 0.0, 1.15)),
        walk_center: Point3::new(west + 0.1, 0.0, 0.0),
        walk_half_width: 0.65,
        walk_far_y: 2.2,
        walk_near_y: [-2.65, -2.3],
        circuit: vec![
            [west, -2.0],
            [west, my.into()],
            [mx.into(), my.into()],
            [mx.into(), -f64::from(my)],
            [west, -f64::from(my)],
        ],
        company: Company::BothWays(0.76),
        seats,
        stands: vec![stand(0.75, -0.6, 1.9), stand(0.7, 0.9, 2.3), stand(-0.6, 2.4, -2.9), stand(0.5, 3.0, 2.9)],
    }
}

/// Adds floor sheets, ceiling tiles and a lamp in the middle of every second section; the corners belong to north and south.
fn floor_and_ceiling(b: &mut Builder) -> Vec<Lamp> {
    let [mx, my] = MIDDLE;
    let mut lamps = Vec::new();
    let mut section = |b: &mut Builder, x: [f32; 2], y: [f32; 2], along_x: bool| {
        let (dx, dy) = (Vec3::x() * (x[1] - x[0]), Vec3::y() * (y[1] - y[0]));
        b.density = 200.0;
        b.rectangle(Vec3::new(x[0], y[1], 0.0), dx, -dy, Material::Vinyl([0.52, 0.55, 0.54]));
        b.density = 130.0;
        b.rectangle(Vec3::new(x[0], y[0], HEIGHT), dx, dy, Material::Ceiling);
        let half = if along_x { [0.6, 0.14] } else { [0.14, 0.6] };
        let middle = Vec3::new((x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0, HEIGHT - 0.03);
        let steady = lamps.len().is_multiple_of(2);
        lamps.push(b.lamp(middle, [Vec3::x() * half[0], Vec3::y() * half[1]], 1.3, [2.3, 2.25, 2.1], steady));
    };
    let (long, short) = (2.0 * (mx + HALF) / 6.0, 2.0 * (my - HALF) / 3.0);
    for middle in [my, -my] {
        for k in 0..6 {
            let x = -(mx + HALF) + k as f32 * long;
            section(b, [x, x + long], [middle - HALF, middle + HALF], true);
        }
    }
    for middle in [mx, -mx] {
        for k in 0..3 {
            let y = -(my - HALF) + k as f32 * short;
            section(b, [middle - HALF, middle + HALF], [y, y + short], false);
        }
    }
    lamps
}

/// Adds offices: a door every 2.6 m, papers beside some.
fn inner_bays(b: &mut Builder, wall: &Wall, corridor: usize) {
    let pitch = 2.6;
    let count = (wall.length / pitch) as usize;
    let start = (wall.length - count as f32 * pitch) / 2.0;
    for bay in 0..count {
        let s = start + bay as f32 * pitch;
        b.density = 350.0;
        wall.door(b, s + 0.25, [0.98, 2.06], [0.60, 0.46, 0.32]);
        let paper = s + 1.45;
        match (bay + corridor) % 4 {
            0 => {
                b.density = 450.0;
                wall.attach(b, [paper, 2.05], [0.6, 0.84], Material::Poster);
            }
            1 => {
                b.density = 420.0;
                wall.attach(b, [paper - 0.05, 2.0], [0.95, 0.7], Material::NoticeBoard);
            }
            2 => {
                b.density = 700.0;
                wall.attach(b, [paper, 1.75], [0.21, 0.297], Material::Paper);
                wall.attach(b, [paper + 0.35, 1.80], [0.297, 0.42], Material::Poster);
                extinguisher(b, wall, paper + 0.75);
            }
            _ => {
                b.density = 450.0;
                wall.attach(b, [paper, 1.95], [0.84, 0.6], Material::Poster);
            }
        }
        if bay % 2 == corridor % 2 {
            b.density = 600.0;
            let color = b.rng.pick([[0.10, 0.46, 0.28], [0.16, 0.36, 0.62], [0.62, 0.14, 0.13]]);
            wall.attach(b, [s + 0.55, 2.42], [0.40, 0.20], Material::Sign(color));
        }
    }
}

/// Adds the outside: windows above radiators in the north and east, boards and lockers in the south and west.
fn outer_bays(b: &mut Builder, wall: &Wall, corridor: usize) {
    let pitch = 2.5;
    corner_prints(b, wall, corridor);
    // The corners have landmarks.
    let count = ((wall.length - 3.2) / pitch) as usize;
    let start = (wall.length - count as f32 * pitch) / 2.0;
    for bay in 0..count {
        let s = start + bay as f32 * pitch;
        match (corridor + bay * 3) % 5 {
            0 | 3 => {
                b.density = 260.0;
                b.glowing(
                    wall.at(s + 0.45, 2.25, 0.012),
                    wall.right * 1.5,
                    -Vec3::z() * 1.15,
                    Material::Outdoors,
                    0.95,
                );
                for edge in [0.45, 1.2, 1.95] {
                    wall.mount(b, [s + edge, 1.10], Vec3::new(0.06, 0.04, 1.15), |_| Material::Plain([0.88; 3]));
                }
                wall.mount(b, [s + 1.2, 0.12], Vec3::new(1.3, 0.09, 0.6), |side| match side {
                    Side::Front => Material::Ribs([0.84, 0.84, 0.80]),
                    _ => Material::Plain([0.84, 0.84, 0.80]),
                });
            }
            1 => {
                b.density = 420.0;
                wall.attach(b, [s + 0.4, 2.15], [1.5, 0.85], Material::NoticeBoard);
            }
            2 => {
                b.density = 420.0;
                for (left, top, w, h) in [(0.3, 2.2, 0.6, 0.84), (1.1, 2.1, 0.9, 0.65)] {
                    let jitter = b.rng.range(-0.08, 0.08);
                    wall.attach(b, [s + left + jitter, top + jitter], [w, h], Material::Poster);
                }
            }
            _ => {
                b.density = 350.0;
                wall.door(b, s + 0.7, [0.98, 2.06], [0.42, 0.48, 0.55]);
                b.density = 600.0;
                wall.attach(b, [s + 1.9, 1.9], [0.42, 0.6], Material::Poster);
            }
        }
    }
}

/// Adds plans, boards and signs to the sections of wall at both ends, which fill the view of a camera that comes around a corner.
fn corner_prints(b: &mut Builder, wall: &Wall, corridor: usize) {
    let end = wall.length;
    b.density = 420.0;
    let prints = [
        (0.25, 2.15, 0.84, 0.6, Material::Poster),
        (1.22, 2.05, 0.35, 0.5, Material::Poster),
        (
            end - 1.75,
            2.1,
            1.05,
            0.75,
            if corridor.is_multiple_of(2) { Material::NoticeBoard } else { Material::Poster },
        ),
        (end - 0.6, 1.95, 0.35, 0.5, Material::Poster),
        (end - 0.55, 0.85, 0.297, 0.42, Material::Paper),
        (1.3, 0.80, 0.297, 0.21, Material::Paper),
    ];
    for (s, z, w, h, material) in prints {
        let jitter = b.rng.range(-0.06, 0.06);
        wall.attach(b, [s + jitter, z + jitter], [w, h], material);
    }
    b.density = 600.0;
    wall.attach(b, [end - 1.45, 2.45], [0.50, 0.22], Material::Sign([0.10, 0.46, 0.28]));
    wall.attach(b, [1.25, 0.35], [0.16, 0.08], Material::Socket);
    wall.attach(b, [end - 1.3, 0.35], [0.16, 0.08], Material::Socket);
}

fn extinguisher(b: &mut Builder, wall: &Wall, s: f32) {
    b.density = 500.0;
    let rings = [[0.52, 0.0], [0.52, 0.03], [0.44, 0.035], [0.40, 0.08], [0.0, 0.08]];
    b.turned(wall.at(s, 0.25, 0.10), &rings, 14, Material::Rusty([0.72, 0.12, 0.10]));
    wall.attach(b, [s - 0.1, 1.45], [0.2, 0.2], Material::Sign([0.70, 0.13, 0.11]));
}

/// Adds a different object to each outer corner.
fn landmarks(b: &mut Builder, [north, east, south, west]: &[Wall; 4]) {
    plant(b, north.at(0.42, 0.0, 0.42));
    plant(b, south.at(0.45, 0.0, 0.42));
    plant(b, south.at(1.05, 0.0, 0.36));
    b.density = 420.0;
    let color = ink(&mut b.rng);
    east.mount(b, [0.75, 0.0], Vec3::new(0.8, 0.55, 1.85), |side| match side {
        Side::Front => Material::Poster,
        _ => Material::Plain(color),
    });
    for k in 0..3 {
        let s = west.length - 1.2 + 0.4 * k as f32;
        west.mount(b, [s, 0.0], Vec3::new(0.39, 0.40, 1.8), |side| match side {
            Side::Front => Material::Ribs([0.45, 0.52, 0.60]),
            _ => Material::Plain([0.45, 0.52, 0.60]),
        });
    }
    for (wall, s, size) in [(north, 13.9, 0.5), (south, 13.8, 0.44), (east, 11.2, 0.40), (north, 13.3, 0.34)] {
        wall.mount(b, [s, 0.0], Vec3::new(size, 0.8 * size, 0.75 * size), |_| Material::Cardboard);
    }
    bin(b, east.at(6.2, 0.0, 0.18));
    bin(b, south.at(7.6, 0.0, 0.18));
    bin(b, west.at(8.4, 0.0, 0.18));
}

/// Adds a bench in the corridor where the camera starts; returns its seats.
fn bench(b: &mut Builder, west: &Wall) -> Vec<Seat> {
    const SEAT_Z: f32 = 0.46;
    // From y = −1.2 to y = 0.2.
    let middle = 5.7;
    b.density = 400.0;
    west.mount(b, [middle, SEAT_Z - 0.05], Vec3::new(1.4, 0.38, 0.05), |_| Material::Wood([0.66, 0.50, 0.34]));
    for s in [middle - 0.6, middle + 0.6] {
        west.mount(b, [s, 0.0], Vec3::new(0.05, 0.34, SEAT_Z - 0.05), |_| Material::Plain(STEEL));
    }
    let seat = |s: f32| Seat { position: west.at(s, SEAT_Z, 0.24), heading: -std::f32::consts::FRAC_PI_2 };
    vec![seat(middle - 0.35), seat(middle + 0.35)]
}
