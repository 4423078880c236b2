//! Procedural noise that never repeats: hashed lattice values with smooth interpolation, summed over octaves.
//!
//! In: a position in lattice cells and a seed. Out: values in [0, 1].

use crate::rng::mix;

fn lattice(seed: u64, x: i32, y: i32) -> f32 {
    let key = (u64::from(x as u32) << 32) | u64::from(y as u32);
    (mix(seed ^ key.wrapping_mul(0x9e37_79b9_7f4a_7c15)) >> 40) as f32 / 16_777_216.0
}

/// Rounds down without the library call of `f32::floor` on processors older than SSE4.1.
fn floor(x: f32) -> i32 {
    let towards_zero = x as i32;
    towards_zero - i32::from((towards_zero as f32) > x)
}

/// Returns smooth value noise in [0, 1] with cells of size one.
pub fn value(seed: u64, x: f32, y: f32) -> f32 {
    let (i, j) = (floor(x), floor(y));
    let (fx, fy) = (fade(x - i as f32), fade(y - j as f32));
    let top = lattice(seed, i, j) * (1.0 - fx) + lattice(seed, i + 1, j) * fx;
    let bottom = lattice(seed, i, j + 1) * (1.0 - fx) + lattice(seed, i + 1, j + 1) * fx;
    top * (1.0 - fy) + bottom * fy
}

/// Returns the sum of `octaves` of value noise, each twice as fine and half as strong; in [0, 1], mean 1/2.
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

/// [`fractal`] at the pixel centres of a canvas, row by row: a lattice value is hashed once per row of cells instead of four times
/// per pixel, and the rest is mostly linear blends.
#[derive(Clone, Debug)]
pub struct Field {
    octaves: Vec<Octave>,
    row: Vec<f32>,
}

#[derive(Clone, Debug)]
struct Octave {
    seed: u64,
    weight: f32,
    /// Cells per pixel in y.
    step: f32,
    /// Cell and place within it (faded) of every column.
    columns: Vec<(u32, f32)>,
    /// The row of cells that `above` and `below` belong to.
    cells: i32,
    above: Vec<f32>,
    below: Vec<f32>,
}

fn fade(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

impl Field {
    /// Creates the noise for a canvas of `width` pixels, each `step` cells wide and high.
    pub fn new(seed: u64, width: usize, step: [f32; 2], octaves: u32) -> Self {
        let total = 2.0 - 0.5f32.powi(octaves as i32 - 1);
        let octave = |k: u32| {
            let scale = (1u32 << k) as f32;
            let columns = (0..width).map(|x| {
                let x = (x as f32 + 0.5) * step[0] * scale;
                (floor(x).max(0) as u32, fade(x - floor(x) as f32))
            });
            let columns: Vec<(u32, f32)> = columns.collect();
            let count = columns.last().map_or(0, |&(cell, _)| cell as usize + 2);
            Octave {
                seed: seed.wrapping_add(u64::from(k)),
                weight: 0.5f32.powi(k as i32) / total,
                step: step[1] * scale,
                columns,
                cells: i32::MIN,
                above: vec![0.0; count],
                below: vec![0.0; count],
            }
        };
        Self { octaves: (0..octaves).map(octave).collect(), row: vec![0.0; width] }
    }

    /// Returns the values along row `y`.
    pub fn row(&mut self, y: usize) -> &[f32] {
        self.row.fill(0.0);
        for octave in &mut self.octaves {
            octave.add(y, &mut self.row);
        }
        &self.row
    }
}

impl Octave {
    fn add(&mut self, y: usize, row: &mut [f32]) {
        let y = (y as f32 + 0.5) * self.step;
        let cells = floor(y);
        if cells != self.cells {
            let hashed = |out: &mut [f32], j: i32| (0..).zip(out).for_each(|(i, v)| *v = lattice(self.seed, i, j));
            if cells == self.cells.wrapping_add(1) {
                std::mem::swap(&mut self.above, &mut self.below);
            } else {
                hashed(&mut self.above, cells);
            }
            hashed(&mut self.below, cells + 1);
            self.cells = cells;
        }
        let down = fade(y - cells as f32);
        let (mut known, mut left, mut right) = (u32::MAX, 0.0, 0.0);
        for (out, &(cell, across)) in row.iter_mut().zip(&self.columns) {
            if cell != known {
                let at = |i: usize| self.weight * (self.above[i] * (1.0 - down) + self.below[i] * down);
                (known, left, right) = (cell, at(cell as usize), at(cell as usize + 1));
            }
            *out += left + (right - left) * across;
        }
    }
}

/// Returns white noise per cell in [0, 1].
pub fn cell(seed: u64, x: f32, y: f32) -> f32 {
    lattice(seed, floor(x), floor(y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_has_the_values_of_the_noise_at_the_pixel_centres() {
        let step = [0.37, 0.09];
        let mut field = Field::new(7, 50, step, 4);
        for y in [0, 1, 2, 30, 31, 5] {
            for (x, value) in field.row(y).iter().enumerate() {
                let want = fractal(7, (x as f32 + 0.5) * step[0], (y as f32 + 0.5) * step[1], 4);
                assert!((value - want).abs() < 1e-5, "{value} instead of {want} at {x}, {y}");
            }
        }
    }
}
