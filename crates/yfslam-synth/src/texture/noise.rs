//! Procedural noise that never repeats: hashed lattice values with smooth interpolation, summed over octaves.
//!
//! In: a position in lattice cells and a seed. Out: values in [0, 1].

use crate::rng::mix;

fn lattice(seed: u64, x: i32, y: i32) -> f32 {
    let key = (u64::from(x as u32) << 32) | u64::from(y as u32);
    (mix(seed ^ key.wrapping_mul(0x9e37_79b9_7f4a_7c15)) >> 40) as f32 / 16_777_216.0
}

/// Smooth value noise in [0, 1] with cells of size one.
pub fn value(seed: u64, x: f32, y: f32) -> f32 {
    let (x0, y0) = (x.floor(), y.floor());
    let fade = |t: f32| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (fade(x - x0), fade(y - y0));
    let (i, j) = (x0 as i32, y0 as i32);
    let top = lattice(seed, i, j) * (1.0 - fx) + lattice(seed, i + 1, j) * fx;
    let bottom = lattice(seed, i, j + 1) * (1.0 - fx) + lattice(seed, i + 1, j + 1) * fx;
    top * (1.0 - fy) + bottom * fy
}

/// Sum of `octaves` of value noise, each twice as fine and half as strong; in [0, 1], mean 1/2.
pub fn fractal(seed: u64, x: f32, y: f32, octaves: u32) -> f32 {
    let (mut sum, mut weight, mut total, mut scale) = (0.0, 1.0, 0.0, 1.0);
    for octave in 0..octaves {
        sum += weight * value(seed.wrapping_add(u64::from(octave)), x * scale, y * scale);
        total += weight;
        weight *= 0.5;
        scale *= 2.0;
    }
    if total > 0.0 { sum / total } else { 0.5 }
}

/// White noise per cell in [0, 1].
pub fn cell(seed: u64, x: f32, y: f32) -> f32 {
    lattice(seed, x.floor() as i32, y.floor() as i32)
}
