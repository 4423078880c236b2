//! The stem: convolution 3×3 stride 2, ReLU, max pool 3×3 stride 2, both with padding 1, row by row.
//!
//! Joined so that the large map in between (24 × 176 × 176) never leaves the first-level cache: only its last three rows exist.
//! The convolution of one row is a matrix product over 3·3·channels rows of input, parted into even and odd columns.

use fearless_simd::{Level, Simd, SimdBase, dispatch};

use super::matmul::{Matrix, Rows, WIDEST, load, multiply_simd};

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
    /// Start of the line that holds the maximum over three rows, relative to the scratch.
    line: usize,
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
            line: inputs + filters * 3 * room + WIDEST,
        }
    }

    fn part(&self, channel: usize, row: usize, odd: usize) -> usize {
        part_offset(self.room, channel, row, odd)
    }

    /// Floats of scratch memory.
    pub(crate) fn scratch(&self) -> usize {
        self.line + self.width.next_multiple_of(WIDEST) + 2 * WIDEST
    }
}

/// Input ring: `[channel][row mod 3][even, odd columns]`, the values after [`WIDEST`] zeros.
fn part_offset(room: usize, channel: usize, row: usize, odd: usize) -> usize {
    ((channel * 3 + row % 3) * 2 + odd) * room + WIDEST
}

/// Where the stem reads and writes, offsets into memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Planes<'a> {
    pub(crate) inputs: &'a [usize],
    pub(crate) outputs: &'a [usize],
    pub(crate) scratch: usize,
}

/// Convolves and pools.
pub(crate) fn stem(level: Level, memory: &mut [f32], geometry: &Geometry, matrix: &Matrix, planes: Planes) {
    dispatch!(level, simd => stem_simd(simd, memory, geometry, matrix, planes));
}

#[inline(always)]
fn stem_simd<S: Simd>(simd: S, memory: &mut [f32], geometry: &Geometry, matrix: &Matrix, planes: Planes) {
    simd.vectorize(
        #[inline(always)]
        || {
            memory[planes.scratch..][..geometry.scratch()].fill(0.0);
            for y in 0..geometry.height {
                part_columns(simd, memory, geometry, planes, 2 * y);
                part_columns(simd, memory, geometry, planes, 2 * y + 1);
                let (inputs, outputs) = (&geometry.products[2 * y % 3], &geometry.results[y % 3]);
                let rows = Rows { inputs, outputs, addend: &[], length: geometry.width };
                multiply_simd(simd, &mut memory[planes.scratch..], matrix, rows);
                if y % 2 == 1 {
                    pool(simd, memory, geometry, planes, y / 2);
                }
            }
        },
    );
}

/// Copies row `y` of the input into its ring, even columns and odd columns apart.
#[inline(always)]
fn part_columns<S: Simd>(simd: S, memory: &mut [f32], geometry: &Geometry, planes: Planes, y: usize) {
    for (channel, input) in planes.inputs.iter().enumerate() {
        let [even, odd] = [0, 1].map(|odd| planes.scratch + geometry.part(channel, y, odd));
        for x in (0..geometry.width).step_by(S::f32s::LEN) {
            let from = input + 2 * (y * geometry.width + x);
            let (low, high) = (load(simd, memory, from), load(simd, memory, from + S::f32s::LEN));
            low.unzip_low(high).store_slice(&mut memory[even + x..][..S::f32s::LEN]);
            low.unzip_high(high).store_slice(&mut memory[odd + x..][..S::f32s::LEN]);
        }
    }
}

/// Row `y` of the result: the maximum over the three rows of the ring, then over three columns, of which every other remains.
/// Padding is 0, the least value after ReLU.
#[inline(always)]
fn pool<S: Simd>(simd: S, memory: &mut [f32], geometry: &Geometry, planes: Planes, y: usize) {
    let line = planes.scratch + geometry.line;
    for (filter, output) in planes.outputs.iter().enumerate() {
        let rows = [0, 1, 2].map(|state: usize| planes.scratch + geometry.results[state][filter]);
        for x in (0..geometry.width).step_by(S::f32s::LEN) {
            let [a, b, c] = rows.map(|row| load(simd, memory, row + x));
            a.max(b).max(c).store_slice(&mut memory[line + x..][..S::f32s::LEN]);
        }
        for x in (0..geometry.width / 2).step_by(S::f32s::LEN) {
            let triple = |at: usize| {
                let [left, centre, right] = [at - 1, at, at + 1].map(|at| load(simd, memory, at));
                left.max(centre).max(right)
            };
            let maxima = triple(line + 2 * x).unzip_low(triple(line + 2 * x + S::f32s::LEN));
            maxima.store_slice(&mut memory[output + y * (geometry.width / 2) + x..][..S::f32s::LEN]);
        }
    }
}
