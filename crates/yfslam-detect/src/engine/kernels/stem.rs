//! The stem: convolution 3×3 stride 2, ReLU, max pool 3×3 stride 2, both with padding 1, row by row.
//!
//! They are joined so that the large map in between (24 × 176 × 176) never exists: only two of its rows are kept, the maximum of
//! the rows with which a window begins, and the one with which it ends and the next one begins. The convolution of one row is a
//! matrix product over 3·3·channels rows of input, separated into even and odd columns.

use fearless_simd::{Level, Simd, SimdBase, dispatch};

use super::matmul::{Matrix, Rows, multiply_simd};
use super::{WIDEST, load};

/// Offsets into the scratch memory that follow from the input size and the number of channels.
#[derive(Debug)]
pub(crate) struct Geometry {
    /// Size of the convolution's result, half of the input's.
    height: usize,
    width: usize,
    /// Floats of one ring row with its margins.
    room: usize,
    /// Rows of the product for each of the three states of the input ring.
    products: [Vec<usize>; 3],
    /// Offsets of the product: two places for each filter, which alternate.
    results: [Vec<usize>; 2],
    /// Floats of scratch memory.
    pub(crate) scratch: usize,
}

impl Geometry {
    /// Computes the geometry for `channels` input planes of `height × width` (both even) and `filters` rows of the matrix, padding
    /// included.
    pub(crate) fn new((height, width): (usize, usize), channels: usize, filters: usize) -> Self {
        let width = width / 2;
        let room = WIDEST + width.next_multiple_of(WIDEST) + WIDEST;
        let part = |channel, row, odd| part_offset(room, channel, row, odd);
        let inputs = channels * 6 * room;
        let product = |state: usize| {
            let tap = |index: usize| {
                let (channel, dy, dx) = (index / 9, index / 3 % 3, index % 3);
                // Input row 2y − 1 + dy; `state` is 2y mod 3.
                let row = state + 2 + dy;
                [part(channel, row, 1) - 1, part(channel, row, 0), part(channel, row, 1)][dx]
            };
            (0..channels * 9).map(tap).collect()
        };
        let result = |state: usize| (0..filters).map(|filter| inputs + (filter * 2 + state) * room + WIDEST).collect();
        Self {
            height: height / 2,
            width,
            room,
            products: [0, 1, 2].map(product),
            results: [0, 1].map(result),
            scratch: inputs + filters * 2 * room,
        }
    }

    fn part(&self, channel: usize, row: usize, odd: usize) -> usize {
        part_offset(self.room, channel, row, odd)
    }
}

/// Returns an offset in the input ring: `[channel][row mod 3][even, odd columns]`, the values after [`WIDEST`] zeros.
fn part_offset(room: usize, channel: usize, row: usize, odd: usize) -> usize {
    ((channel * 3 + row % 3) * 2 + odd) * room + WIDEST
}

/// Convolves and pools planes of `memory`: from `inputs` to `outputs`.
pub(crate) fn stem(
    level: Level,
    memory: &mut [f32],
    scratch: &mut [f32],
    geometry: &Geometry,
    matrix: &Matrix,
    (inputs, outputs): (&[usize], &[usize]),
) {
    dispatch!(level, simd => stem_simd(simd, memory, scratch, geometry, matrix, (inputs, outputs)));
}

#[inline(always)]
fn stem_simd<S: Simd>(
    simd: S,
    memory: &mut [f32],
    scratch: &mut [f32],
    geometry: &Geometry,
    matrix: &Matrix,
    (inputs, outputs): (&[usize], &[usize]),
) {
    simd.vectorize(
        #[inline(always)]
        || {
            scratch[..geometry.scratch].fill(0.0);
            for y in 0..geometry.height {
                part_columns(simd, memory, scratch, geometry, inputs, 2 * y);
                part_columns(simd, memory, scratch, geometry, inputs, 2 * y + 1);
                // Windows are the rows 2k − 1, 2k, 2k + 1: an even row joins the odd one before it, an odd row begins a new window.
                let [begun, fresh] = [y / 2 % 2, 1 - y / 2 % 2].map(|turn| &geometry.results[turn][..]);
                let rows = Rows {
                    inputs: &geometry.products[2 * y % 3],
                    outputs: if y % 2 == 0 { begun } else { fresh },
                    addend: &[],
                    keep_larger: y % 2 == 0,
                    length: geometry.width,
                };
                multiply_simd(simd, scratch, matrix, rows);
                if y % 2 == 1 {
                    for (filter, output) in outputs.iter().enumerate() {
                        let row = &mut memory[output + y / 2 * (geometry.width / 2)..];
                        pool(simd, scratch, [begun[filter], fresh[filter]], geometry.width, row);
                    }
                }
            }
        },
    );
}

/// Copies row `y` of the input into its ring, with even and odd columns separated.
#[inline(always)]
fn part_columns<S: Simd>(
    simd: S,
    memory: &[f32],
    scratch: &mut [f32],
    geometry: &Geometry,
    inputs: &[usize],
    y: usize,
) {
    let length = geometry.width.next_multiple_of(S::f32s::LEN);
    for (channel, input) in inputs.iter().enumerate() {
        let row = &memory[input + 2 * y * geometry.width..][..2 * length];
        let parts = &mut scratch[geometry.part(channel, y, 0)..][..geometry.room + length];
        let (even, odd) = parts.split_at_mut(geometry.room);
        let parts = even.chunks_exact_mut(S::f32s::LEN).zip(odd.chunks_exact_mut(S::f32s::LEN));
        for (row, (even, odd)) in row.chunks_exact(2 * S::f32s::LEN).zip(parts) {
            let (low, high) = (load(simd, row, 0), load(simd, row, S::f32s::LEN));
            low.unzip_low(high).store_slice(even);
            low.unzip_high(high).store_slice(odd);
        }
    }
}

/// Returns, for two rows of `width`, the maximum over each window of three columns around an even one. Padding is 0, the least
/// value after ReLU.
#[inline(always)]
fn pool<S: Simd>(simd: S, scratch: &[f32], rows: [usize; 2], width: usize, pooled: &mut [f32]) {
    let length = (width / 2).next_multiple_of(S::f32s::LEN);
    let line = |start: usize| scratch[start..][..2 * length].chunks_exact(2 * S::f32s::LEN);
    let (centre, left) = (line(rows[0]).zip(line(rows[1])), line(rows[0] - 1).zip(line(rows[1] - 1)));
    for ((centre, left), pooled) in centre.zip(left).zip(pooled[..length].chunks_exact_mut(S::f32s::LEN)) {
        let (even, odd) = larger(simd, centre);
        let (before, _) = larger(simd, left);
        even.max(odd).max(before).store_slice(pooled);
    }
}

/// Returns the elementwise maximum of two slices of two vectors; even elements, odd elements.
#[inline(always)]
fn larger<S: Simd>(simd: S, (a, b): (&[f32], &[f32])) -> (S::f32s, S::f32s) {
    let low = load(simd, a, 0).max(load(simd, b, 0));
    let high = load(simd, a, S::f32s::LEN).max(load(simd, b, S::f32s::LEN));
    (low.unzip_low(high), low.unzip_high(high))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::kernels::testing::{Arena, assert_close, levels, noise};

    proptest! {
        #[test]
        fn equals_convolution_then_pool(
            (height, width) in (1..12_usize, 1..30_usize).prop_map(|(height, width)| (4 * height, 4 * width)),
            filters in 1..14_usize,
            seed in any::<u32>(),
        ) {
            let (weights, bias) = (noise(filters * 27, seed), noise(filters, seed ^ 1));
            let matrix = Matrix::pack(&weights, &bias, true);
            let geometry = Geometry::new((height, width), 3, matrix.padded_rows());
            for level in levels() {
                let pooled = (height / 4, width / 4);
                let (mut arena, offsets) = Arena::new(&[(3, (height, width)), (filters, pooled), (1, (9, 9))], seed);
                let (inputs, outputs) = (&offsets[0], &offsets[1]);
                let before = arena.memory.clone();
                let mut scratch = noise(geometry.scratch, seed);
                stem(level, &mut arena.memory, &mut scratch, &geometry, &matrix, (inputs, outputs));
                arena.assert_untouched(&before, outputs);
                let convolved = |filter: usize, y: usize, x: usize| {
                    let tap = |tap: usize| {
                        let (y, x) = ((2 * y + tap / 3 % 3).wrapping_sub(1), (2 * x + tap % 3).wrapping_sub(1));
                        let value = if y < height && x < width { before[inputs[tap / 9] + y * width + x] } else { 0.0 };
                        f64::from(weights[filter * 27 + tap]) * f64::from(value)
                    };
                    ((0..27).map(tap).sum::<f64>() + f64::from(bias[filter])).max(0.0)
                };
                for (filter, output) in outputs.iter().enumerate() {
                    let expected: Vec<f64> = (0..pooled.0 * pooled.1).map(|index| {
                        let (y, x) = (2 * (index / pooled.1), 2 * (index % pooled.1));
                        let inside = |tap: usize| Some(((y + tap / 3).checked_sub(1)?, (x + tap % 3).checked_sub(1)?));
                        (0..9).filter_map(inside).map(|(y, x)| convolved(filter, y, x)).fold(0.0, f64::max)
                    }).collect();
                    assert_close(arena.plane(*output), &expected, &format!("{level:?}"));
                }
            }
        }
    }
}
