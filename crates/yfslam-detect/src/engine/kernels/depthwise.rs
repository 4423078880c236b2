//! Depthwise convolution: one square filter per plane, zero padding `kernel / 2`, stride 1 or 2.
//!
//! A plane is copied into scratch memory with its rows separated by zeros and, for stride 2, even columns separated from odd ones.
//! Then the values that a filter tap multiplies for neighbouring outputs are neighbours, too. Vectors may write past the end of an
//! output row: the next row, written later, overwrites this, and the last one reaches into room that every plane has.
#![allow(clippy::needless_range_loop, reason = "iterator adapters are not inlined in every build, index loops are")]

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch};

use super::{WIDEST, load};

/// Output rows that are computed together, so that a loaded input row serves several of them.
pub(crate) const ROWS: usize = 6;

/// Sizes that follow from those of the input, the kernel and the stride.
#[derive(Clone, Debug)]
pub(crate) struct Geometry {
    height: usize,
    width: usize,
    pad: usize,
    stride: usize,
    /// Floats from one part of a scratch row (all columns; or the even, then the odd ones) to the next: [`WIDEST`] zeros, the
    /// values, zeros up to a multiple of [`WIDEST`].
    part: usize,
    /// Place in a scratch row of the values that each column of the filter multiplies for output 0.
    columns: Vec<usize>,
}

impl Geometry {
    /// Computes the geometry for planes of `height × width`; `kernel` is 3 or 5, `stride` 1 or 2.
    pub(crate) fn new((height, width): (usize, usize), kernel: usize, stride: usize) -> Self {
        let pad = kernel / 2;
        let part = WIDEST + width.div_ceil(stride).next_multiple_of(WIDEST);
        // Output x takes input column `stride · x + dx − pad`: value `x + (dx − pad) div stride` of part `(dx − pad) mod stride`.
        let shifted = |dx: usize| dx + pad * (stride - 1);
        let column = |dx: usize| shifted(dx) % stride * part + WIDEST - pad + shifted(dx) / stride;
        Self { height, width, pad, stride, part, columns: (0..kernel).map(column).collect() }
    }

    /// Returns the number of floats of scratch memory.
    pub(crate) fn scratch(&self) -> usize {
        (self.height.max(ROWS * self.stride) + 2 * self.pad) * self.part * self.stride + 2 * WIDEST
    }
}

/// The planes of a convolution as offsets into memory, and the filters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Planes<'a> {
    pub(crate) inputs: &'a [usize],
    pub(crate) outputs: &'a [usize],
    /// `inputs.len() × kernel²`, each filter column by column.
    pub(crate) weights: &'a [f32],
    pub(crate) bias: &'a [f32],
    pub(crate) relu: bool,
}

/// Convolves each plane with its filter.
pub(crate) fn convolve(level: Level, memory: &mut [f32], scratch: &mut [f32], geometry: &Geometry, planes: Planes) {
    dispatch!(level, simd => {
        match (geometry.columns.len(), geometry.stride) {
            (3, 1) => convolve_simd::<_, 3, 1, { 3 + ROWS - 1 }>(simd, memory, scratch, geometry, planes),
            (3, _) => convolve_simd::<_, 3, 2, { 3 + 2 * (ROWS - 1) }>(simd, memory, scratch, geometry, planes),
            (_, 1) => convolve_simd::<_, 5, 1, { 5 + ROWS - 1 }>(simd, memory, scratch, geometry, planes),
            _ => convolve_simd::<_, 5, 2, { 5 + 2 * (ROWS - 1) }>(simd, memory, scratch, geometry, planes),
        }
    });
}

/// `SPAN` is the number of input rows that [`ROWS`] output rows depend on.
#[inline(always)]
fn convolve_simd<S: Simd, const K: usize, const STRIDE: usize, const SPAN: usize>(
    simd: S,
    memory: &mut [f32],
    scratch: &mut [f32],
    geometry: &Geometry,
    planes: Planes,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let scratch = &mut scratch[..geometry.scratch()];
            scratch.fill(0.0);
            let filters = planes.weights.chunks_exact(K * K).zip(planes.bias);
            for ((input, output), (weights, bias)) in planes.inputs.iter().zip(planes.outputs).zip(filters) {
                if STRIDE == 1 {
                    spread(simd, &memory[*input..], scratch, geometry);
                } else {
                    spread_halves(simd, &memory[*input..], scratch, geometry);
                }
                let filter = Filter { weights, bias: *bias, relu: planes.relu };
                correlate::<S, K, STRIDE, SPAN>(simd, scratch, &mut memory[*output..], geometry, filter);
            }
        },
    );
}

/// Copies a plane into scratch, for stride 1.
#[inline(always)]
fn spread<S: Simd>(simd: S, plane: &[f32], scratch: &mut [f32], geometry: &Geometry) {
    let Geometry { height, width, pad, part, .. } = *geometry;
    let zero = S::f32s::splat(simd, 0.0);
    let length = width.next_multiple_of(S::f32s::LEN);
    for y in 0..height {
        let from = &plane[y * width..][..length];
        let to = &mut scratch[(y + pad) * part + WIDEST..][..length + S::f32s::LEN];
        for (from, to) in from.chunks_exact(S::f32s::LEN).zip(to.chunks_exact_mut(S::f32s::LEN)) {
            S::f32s::from_slice(simd, from).store_slice(to);
        }
        zero.store_slice(&mut to[width..][..S::f32s::LEN]);
    }
}

/// Copies a plane into scratch, even columns before odd ones, for stride 2.
#[inline(always)]
fn spread_halves<S: Simd>(simd: S, plane: &[f32], scratch: &mut [f32], geometry: &Geometry) {
    let Geometry { height, width, pad, part, .. } = *geometry;
    let zero = S::f32s::splat(simd, 0.0);
    let length = width.div_ceil(2).next_multiple_of(S::f32s::LEN);
    for y in 0..height {
        let from = &plane[y * width..][..2 * length];
        let to = &mut scratch[(y + pad) * 2 * part + WIDEST..][..part + length + S::f32s::LEN];
        let (even, odd) = to.split_at_mut(part);
        let pairs = from.chunks_exact(2 * S::f32s::LEN);
        let parts = even.chunks_exact_mut(S::f32s::LEN).zip(odd.chunks_exact_mut(S::f32s::LEN));
        for (pair, (even, odd)) in pairs.zip(parts) {
            let (low, high) = pair.split_at(S::f32s::LEN);
            let (low, high) = (S::f32s::from_slice(simd, low), S::f32s::from_slice(simd, high));
            low.unzip_low(high).store_slice(even);
            low.unzip_high(high).store_slice(odd);
        }
        zero.store_slice(&mut even[width.div_ceil(2)..][..S::f32s::LEN]);
        zero.store_slice(&mut odd[width / 2..][..S::f32s::LEN]);
    }
}

/// The filter of one plane; weights column by column.
#[derive(Clone, Copy, Debug)]
struct Filter<'a> {
    weights: &'a [f32],
    bias: f32,
    relu: bool,
}

/// Correlates scratch memory with the filter, [`ROWS`] output rows at a time, the last ones perhaps twice. Columns are processed
/// from right to left, so that the excess of the last vector of a row is overwritten by the first one of the next row.
#[inline(always)]
fn correlate<S: Simd, const K: usize, const STRIDE: usize, const SPAN: usize>(
    simd: S,
    scratch: &[f32],
    plane: &mut [f32],
    geometry: &Geometry,
    filter: Filter,
) {
    let floor = S::f32s::splat(simd, if filter.relu { 0.0 } else { f32::NEG_INFINITY });
    let (height, width) = (geometry.height.div_ceil(STRIDE), geometry.width.div_ceil(STRIDE));
    let pitch = geometry.part * STRIDE;
    for block in 0..height.div_ceil(ROWS) {
        let y = (block * ROWS).min(height.saturating_sub(ROWS));
        let mut rows = [scratch; SPAN];
        for index in 0..SPAN {
            rows[index] = &scratch[(y * STRIDE + index) * pitch..][..pitch + WIDEST];
        }
        for x in (0..width).step_by(S::f32s::LEN).rev() {
            let mut sums = [S::f32s::splat(simd, filter.bias); ROWS];
            for (column, weights) in geometry.columns.iter().zip(filter.weights.as_chunks::<K>().0) {
                let mut taps = [sums[0]; K];
                for tap in 0..K {
                    taps[tap] = S::f32s::splat(simd, weights[tap]);
                }
                for index in 0..SPAN {
                    let value = load(simd, rows[index], x + column);
                    for row in 0..ROWS {
                        if index >= row * STRIDE && index - row * STRIDE < K {
                            sums[row] = taps[index - row * STRIDE].mul_add(value, sums[row]);
                        }
                    }
                }
            }
            for row in 0..ROWS {
                sums[row].max(floor).store_slice(&mut plane[(y + row) * width + x..][..S::f32s::LEN]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::kernels::testing::{Arena, assert_close, levels, noise};

    proptest! {
        #[test]
        fn equals_the_convolution_as_defined(
            (height, width) in (1..40_usize, 1..60_usize),
            (kernel, stride) in (prop_oneof![Just(3_usize), Just(5)], 1..3_usize),
            relu in any::<bool>(),
            seed in any::<u32>(),
        ) {
            let geometry = Geometry::new((height, width), kernel, stride);
            let (weights, bias) = (noise(2 * kernel * kernel, seed), noise(2, seed ^ 1));
            let out = (height.div_ceil(stride), width.div_ceil(stride));
            for level in levels() {
                let (mut arena, offsets) = Arena::new(&[(2, (height, width)), (2, out), (1, (9, 9))], seed);
                let (inputs, outputs) = (&offsets[0], &offsets[1]);
                let before = arena.memory.clone();
                let planes = Planes { inputs, outputs, weights: &weights, bias: &bias, relu };
                let mut scratch = noise(geometry.scratch(), seed);
                convolve(level, &mut arena.memory, &mut scratch, &geometry, planes);
                arena.assert_untouched(&before, outputs);
                for plane in 0..2 {
                    let expected: Vec<f64> = (0..out.0 * out.1).map(|index| {
                        let (y, x) = (index / out.1 * stride, index % out.1 * stride);
                        let tap = |tap: usize| {
                            let (dx, dy) = (tap / kernel, tap % kernel);
                            let (y, x) = ((y + dy).wrapping_sub(kernel / 2), (x + dx).wrapping_sub(kernel / 2));
                            let weight = f64::from(weights[plane * kernel * kernel + tap]);
                            if y < height && x < width { weight * f64::from(before[inputs[plane] + y * width + x]) } else { 0.0 }
                        };
                        let sum = (0..kernel * kernel).map(tap).sum::<f64>() + f64::from(bias[plane]);
                        if relu { sum.max(0.0) } else { sum }
                    }).collect();
                    assert_close(arena.plane(outputs[plane]), &expected, &format!("{level:?}"));
                }
            }
        }
    }
}
