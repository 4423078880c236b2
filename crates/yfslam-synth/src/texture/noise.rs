//! Procedural noise that never repeats: hashed lattice values with smooth interpolation, summed over octaves.
//!
//! In: a position in lattice cells and a seed. Out: values in [0, 1].

use crate::rng::mix;

fn lattice(seed: u64, x: i32, y: i32) -> f32 {
    let key = (u64::from(x as u32) << 32) | u64::from(y as u32);
    (mix(seed ^ key.wrapping_mul(0x9e37_79b9_7f4a_7c15)) >> 40) as f32 / 16_777_216.0
}

/// Rounds down without the library call that `f32::floor` is on processors older than SSE4.1.
fn floor(x: f32) -> i32 {
    let towards_zero = x as i32;
    towards_zero - i32::from((towards_zero as f32) > x)
}

/// Smooth value noise in [0, 1] with cells of size one.
pub fn value(seed: u64, x: f32, y: f32) -> f32 {
    let fade = |t: f32| t * t * (3.0 - 2.0 * t);
    let (i, j) = (floor(x), floor(y));
    let (fx, fy) = (fade(x - i as f32), fade(y - j as f32));
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
    lattice(seed, floor(x), floor(y))
}
