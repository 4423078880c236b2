//! Furniture and clutter.

use nalgebra::{Isometry3, UnitQuaternion};

use super::builder::{Builder, Side};
use crate::mesh::Vec3;
use crate::texture::material::{Material, Pattern, tint};
use crate::texture::print::ink;

const STEEL: [f32; 3] = [0.52, 0.54, 0.57];
const DARK: [f32; 3] = [0.20, 0.20, 0.22];

/// Adds a desk; `base` is the middle of its footprint on the floor.
pub fn desk(b: &mut Builder, base: Vec3, width: f32, depth: f32, height: f32) {
    let top = base + Vec3::z() * (height - 0.03);
    b.density = 600.0;
    b.cuboid(top, Vec3::new(width, depth, 0.03), 0.0, |_| Material::Wood([0.80, 0.66, 0.48]));
    b.density = 300.0;
    for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        let at = base + Vec3::new(sx * (width / 2.0 - 0.05), sy * (depth / 2.0 - 0.05), 0.0);
        b.cuboid(at, Vec3::new(0.05, 0.05, height - 0.03), 0.0, |_| Material::Plain(STEEL));
    }
    let panel = base + Vec3::new(0.0, depth / 2.0 - 0.12, 0.04);
    b.cuboid(panel, Vec3::new(width - 0.12, 0.02, height - 0.10), 0.0, |_| Material::Plain([0.62, 0.64, 0.66]));
}

/// Adds a monitor that faces −y before it is turned by `yaw`; `base` is the place of its foot.
pub fn monitor(b: &mut Builder, base: Vec3, yaw: f32) {
    let (sin, cos) = libm::sincosf(yaw);
    let turned = |x: f32, y: f32, z: f32| base + Vec3::new(cos * x - sin * y, sin * x + cos * y, z);
    b.density = 400.0;
    b.cuboid(base, Vec3::new(0.24, 0.18, 0.015), yaw, |_| Material::Plain(DARK));
    b.cuboid(turned(0.0, 0.03, 0.015), Vec3::new(0.05, 0.03, 0.16), yaw, |_| Material::Plain(DARK));
    b.cuboid(turned(0.0, 0.0, 0.11), Vec3::new(0.56, 0.045, 0.36), yaw, |_| Material::Plain(tint(DARK, 0.8)));
    b.density = 900.0;
    let (top_left, right) = (turned(-0.265, -0.0235, 0.455), turned(1.0, 0.0, 0.0) - base);
    b.glowing(top_left, right * 0.53, -Vec3::z() * 0.315, Material::Screen, 0.85);
}

/// Adds a book lying flat; returns the height of its top above `base`.
pub fn lying_book(b: &mut Builder, base: Vec3, yaw: f32) -> f32 {
    let size = Vec3::new(b.rng.range(0.15, 0.20), b.rng.range(0.22, 0.27), b.rng.range(0.02, 0.05));
    let color = ink(&mut b.rng);
    b.density = 1000.0;
    b.cuboid(base, size, yaw, |side| match side {
        Side::Top | Side::Bottom => Material::Cover(color),
        Side::Left => Material::Spine(color),
        _ => Material::Pages,
    });
    size.z
}

/// Adds a row of standing books from `start` along +x over `length`, with the fronts towards −y.
pub fn book_row(b: &mut Builder, start: Vec3, length: f32) {
    b.density = 700.0;
    let mut x = 0.0;
    loop {
        let size = Vec3::new(b.rng.range(0.022, 0.06), b.rng.range(0.15, 0.21), b.rng.range(0.20, 0.30));
        if x + size.x > length {
            return;
        }
        if b.rng.chance(0.06) {
            x += b.rng.range(0.03, 0.12);
            continue;
        }
        let color = ink(&mut b.rng);
        let base = start + Vec3::new(x + size.x / 2.0, b.rng.range(0.0, 0.03) - 0.02, 0.0);
        b.cuboid(base, size, 0.0, |side| match side {
            Side::Front => Material::Spine(color),
            Side::Top | Side::Back | Side::Bottom => Material::Pages,
            _ => Material::Plain(color),
        });
        x += size.x + 0.002;
    }
}

/// Adds an open shelf full of books, open towards −y; `base` is the middle of its footprint.
pub fn bookshelf(b: &mut Builder, base: Vec3, width: f32, height: f32, boards: usize) {
    let (depth, thick) = (0.30, 0.025);
    let wood = Material::Wood([0.62, 0.48, 0.33]);
    b.density = 350.0;
    for side in [-1.0, 1.0] {
        let at = base + Vec3::new(side * (width - thick) / 2.0, 0.0, 0.0);
        b.cuboid(at, Vec3::new(thick, depth, height), 0.0, |_| wood);
    }
    b.cuboid(base + Vec3::y() * (depth / 2.0 - 0.01), Vec3::new(width, 0.012, height), 0.0, |_| wood);
    let pitch = (height - thick) / boards as f32;
    for board in 0..=boards {
        b.density = 350.0;
        let z = board as f32 * pitch;
        b.cuboid(base + Vec3::z() * z, Vec3::new(width - 2.0 * thick, depth - 0.02, thick), 0.0, |_| wood);
        if board < boards {
            let left = base + Vec3::new(-width / 2.0 + thick + 0.01, -0.03, z + thick);
            book_row(b, left, width - 2.0 * thick - 0.02);
        }
    }
}

/// Adds an office chair whose sitter faces `yaw` (0 is +y); returns the middle of the top of the seat.
pub fn chair(b: &mut Builder, base: Vec3, yaw: f32, color: [f32; 3]) -> Vec3 {
    let (sin, cos) = libm::sincosf(yaw);
    let turned = |x: f32, y: f32, z: f32| base + Vec3::new(cos * x - sin * y, sin * x + cos * y, z);
    b.density = 400.0;
    let seat_z = 0.46;
    b.cuboid(turned(0.0, 0.0, seat_z - 0.07), Vec3::new(0.46, 0.44, 0.07), yaw, |_| Material::Cloth(color));
    b.cuboid(turned(0.0, -0.23, seat_z + 0.14), Vec3::new(0.42, 0.06, 0.42), yaw, |_| Material::Cloth(color));
    b.cuboid(turned(0.0, -0.24, seat_z - 0.06), Vec3::new(0.06, 0.03, 0.40), yaw, |_| Material::Plain(DARK));
    b.turned(turned(0.0, 0.0, 0.08), &[[0.32, 0.03], [0.0, 0.03]], 10, Material::Plain(STEEL));
    for leg in 0..5 {
        let angle = yaw + leg as f32 * std::f32::consts::TAU / 5.0;
        let at = base + Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0) * 0.15 + Vec3::z() * 0.06;
        b.cuboid(at, Vec3::new(0.30, 0.045, 0.03), angle, |_| Material::Plain(DARK));
        let wheel = base + Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0) * 0.28;
        b.cuboid(wheel, Vec3::new(0.06, 0.04, 0.06), angle, |_| Material::Plain(DARK));
    }
    turned(0.0, 0.0, seat_z)
}

/// Adds a mug.
pub fn mug(b: &mut Builder, base: Vec3) {
    let color = ink(&mut b.rng);
    b.density = 900.0;
    let rings = [[0.085, 0.0], [0.085, 0.034], [0.095, 0.036], [0.095, 0.042], [0.0, 0.038]];
    b.turned(base, &rings, 18, Material::Shirt(color, [0.92, 0.92, 0.90], Pattern::Stripes));
}

/// Adds a potted plant: long leaves that rise from the pot and bend outward.
pub fn plant(b: &mut Builder, base: Vec3) {
    b.density = 400.0;
    b.turned(base, &[[0.34, 0.0], [0.34, 0.15], [0.36, 0.18], [0.0, 0.13]], 20, Material::Plain([0.66, 0.36, 0.24]));
    for leaf in 0..22 {
        let azimuth = leaf as f32 * 2.4 + b.rng.range(-0.3, 0.3);
        let (tilt, length) = (b.rng.range(0.15, 0.95), b.rng.range(0.22, 0.42));
        let out = Vec3::new(libm::cosf(azimuth), libm::sinf(azimuth), 0.0);
        let stem =
            out * (0.35 * libm::sinf(tilt)) + Vec3::z() * (0.45 + 0.55 * libm::cosf(tilt) * b.rng.range(0.6, 1.0));
        let rings: Vec<[f32; 3]> = [(1.0, 0.0), (0.7, 0.6), (0.3, 1.0), (-0.3, 0.9), (-0.8, 0.4), (-1.0, 0.0)]
            .map(|(z, r)| [z * length / 2.0, 0.006 * r, 0.055 * r])
            .to_vec();
        let first = b.mesh.vertices.len();
        let patch = b.patch(Material::Leaves, [0.2, length]);
        b.mesh.loft(8, &rings, patch);
        // The thin side of the blade points outward and up.
        let turn = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), azimuth)
            * UnitQuaternion::from_axis_angle(&Vec3::y_axis(), 0.4 + tilt);
        b.mesh.transform_from(first, &Isometry3::from_parts((base + stem).into(), turn));
        b.turned(base + Vec3::z() * 0.3 + out * 0.02, &[[0.3, 0.006], [0.0, 0.008]], 5, Material::Leaves);
    }
}

/// Adds a waste-paper bin.
pub fn bin(b: &mut Builder, base: Vec3) {
    b.density = 500.0;
    b.turned(base, &[[0.30, 0.0], [0.31, 0.13], [0.33, 0.15], [0.0, 0.11]], 18, Material::Plain(DARK));
}
