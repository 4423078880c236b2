//! The stem: convolution 3×3 stride 2, ReLU, max pool 3×3 stride 2, both with padding 1, row by row.
//!
//! Joined so that the large map in between (24 × 176 × 176) never leaves the first-level cache: only its last three rows exist.
//! The convolution of one row is a matrix product over 3·3·channels rows of input, parted into even and odd columns.

use fearless_simd::{Level, Simd, SimdBase, dispatch};

use super::matmul::{Matrix, Rows, multiply_simd};
use super::{WIDEST, load};

/// Offsets that follow from the input size and the number of channels; fixed when the model is loaded.
#[derive(Debug)]
pub(crate) struct Geometry {
    /// Size of the convolution's result, half of the input's.
    height: usize,
    width: usize,
    /// Floats of one ring row with its margins.
    room: usize,
    /// Rows of the product for each of the three states of the input ring, relative to the scratch.
    products: [Vec<usize>; 3],
    /// Where the product writes for each of the three states of its ring, relative to the scratch.
    results: [Vec<usize>; 3],
    /// Floats of scratch memory.
    pub(crate) scratch: usize,
}

impl Geometry {
    /// For `channels` input planes of `height × width` (both even) and `filters` rows of the matrix, padding included.
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
        let result = |state: usize| (0..filters).map(|filter| inputs + (filter * 3 + state) * room + WIDEST).collect();
        Self {
            height: height / 2,
            width,
            room,
            products: [0, 1, 2].map(product),
            results: [0, 1, 2].map(result),
            scratch: inputs + filters * 3 * room,
        }
    }

    fn part(&self, channel: usize, row: usize, odd: usize) -> usize {
        part_offset(self.room, channel, row, odd)
    }
}

/// Input ring: `[channel][row mod 3][even, odd columns]`, the values after [`WIDEST`] zeros.
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
                let (inputs, results) = (&geometry.products[2 * y % 3], &geometry.results[y % 3]);
                let rows = Rows { inputs, outputs: results, addend: &[], length: geometry.width };
                multiply_simd(simd, scratch, matrix, rows);
                if y % 2 == 1 {
                    pool(simd, memory, scratch, geometry, outputs, y / 2);
                }
            }
        },
    );
}

/// Copies row `y` of the input into its ring, even columns and odd columns apart.
#[inline(always)]
fn part_columns<S: Simd>(
    simd: S,
    memory: &[f32],
    scratch: &mut [f32],
    geometry: &Geometry,
    inputs: &[usize],
    y: usize,
) {
    for (channel, input) in inputs.iter().enumerate() {
        let (even, odd) = (geometry.part(channel, y, 0), geometry.part(channel, y, 1));
        for x in (0..geometry.width).step_by(S::f32s::LEN) {
            let from = input + 2 * (y * geometry.width + x);
            let (low, high) = (load(simd, memory, from), load(simd, memory, from + S::f32s::LEN));
            low.unzip_low(high).store_slice(&mut scratch[even + x..][..S::f32s::LEN]);
            low.unzip_high(high).store_slice(&mut scratch[odd + x..][..S::f32s::LEN]);
        }
    }
}

/// Row `y` of the result: of the three rows of the ring, the maximum over each window of three columns around an even one.
/// Padding is 0, the least value after ReLU.
#[inline(always)]
fn pool<S: Simd>(simd: S, memory: &mut [f32], scratch: &[f32], geometry: &Geometry, outputs: &[usize], y: usize) {
    let width = geometry.width / 2;
    let [first, second, third] = &geometry.results;
    for (filter, output) in outputs.iter().enumerate() {
        let rows = [first[filter], second[filter], third[filter]];
        for x in (0..width).step_by(S::f32s::LEN) {
            let (low, high) = (highest(simd, scratch, rows, 2 * x), highest(simd, scratch, rows, 2 * x + S::f32s::LEN));
            let left = highest(simd, scratch, rows, 2 * x - 1);
            let left = left.unzip_low(highest(simd, scratch, rows, 2 * x + S::f32s::LEN - 1));
            let maxima = low.unzip_low(high).max(low.unzip_high(high)).max(left);
            maxima.store_slice(&mut memory[output + y * width + x..][..S::f32s::LEN]);
        }
    }
}

/// The maximum over three rows.
#[inline(always)]
fn highest<S: Simd>(simd: S, scratch: &[f32], [a, b, c]: [usize; 3], at: usize) -> S::f32s {
    load(simd, scratch, a + at).max(load(simd, scratch, b + at)).max(load(simd, scratch, c + at))
}
