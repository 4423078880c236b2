//! Matrix product over planes: the 1×1 convolutions and the stem.
//!
//! In: a list of rows of floats (one per input channel or filter tap), packed weights. Out: one row per output channel. The inner
//! loop keeps 6 output channels × 2 vectors in registers; rows are read in place and not copied.
#![allow(clippy::needless_range_loop, reason = "iterator adapters are not inlined in every build, index loops are")]

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch};

use super::{WIDEST, load};

/// Output channels that are computed together.
pub(crate) const BLOCK: usize = 6;

/// A weight matrix in the order of the kernel, padded with zero rows to a multiple of [`BLOCK`].
#[derive(Debug)]
pub(crate) struct Matrix {
    depth: usize,
    /// `[row / BLOCK][depth][BLOCK]`
    weights: Vec<[f32; BLOCK]>,
    bias: Vec<[f32; BLOCK]>,
    relu: bool,
}

impl Matrix {
    /// Packs `bias.len() × depth` row-major `weights`.
    pub(crate) fn pack(weights: &[f32], bias: &[f32], relu: bool) -> Self {
        let depth = weights.len() / bias.len();
        let at = |row: usize, k: usize| weights.get(row * depth + k).copied().unwrap_or(0.0);
        let blocks = bias.len().div_ceil(BLOCK);
        Self {
            depth,
            weights: (0..blocks)
                .flat_map(|block| (0..depth).map(move |k| std::array::from_fn(|row| at(block * BLOCK + row, k))))
                .collect(),
            bias: (0..blocks)
                .map(|block| std::array::from_fn(|row| bias.get(block * BLOCK + row).copied().unwrap_or(0.0)))
                .collect(),
            relu,
        }
    }

    /// Returns the number of rows including padding.
    pub(crate) fn padded_rows(&self) -> usize {
        self.bias.len() * BLOCK
    }
}

/// Offsets of a product into the memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<'a> {
    /// One per column of the matrix.
    pub(crate) inputs: &'a [usize],
    /// One per padded row of the matrix.
    pub(crate) outputs: &'a [usize],
    /// Added to the product before ReLU, one per padded row, or empty.
    pub(crate) addend: &'a [usize],
    /// Whether a result is dropped if it is smaller than the old value.
    pub(crate) keep_larger: bool,
    /// Floats per row; all are processed up to the next multiple of [`WIDEST`].
    pub(crate) length: usize,
}

/// Computes `outputs = relu(weights · inputs + bias + addend)`, or the maximum of that and the old `outputs`.
pub(crate) fn multiply(level: Level, memory: &mut [f32], matrix: &Matrix, rows: Rows) {
    dispatch!(level, simd => multiply_simd(simd, memory, matrix, rows));
}

/// [`multiply`], called from within a kernel.
#[inline(always)]
pub(crate) fn multiply_simd<S: Simd>(simd: S, memory: &mut [f32], matrix: &Matrix, rows: Rows) {
    simd.vectorize(
        #[inline(always)]
        || {
            let length = rows.length.next_multiple_of(WIDEST);
            let wide = length / (2 * S::f32s::LEN) * 2 * S::f32s::LEN;
            for column in (0..wide).step_by(2 * S::f32s::LEN) {
                blocks::<S, 2>(simd, memory, matrix, rows, column);
            }
            for column in (wide..length).step_by(S::f32s::LEN) {
                blocks::<S, 1>(simd, memory, matrix, rows, column);
            }
        },
    );
}

/// Computes all output channels for `V` vectors from `column` on.
#[inline(always)]
fn blocks<S: Simd, const V: usize>(simd: S, memory: &mut [f32], matrix: &Matrix, rows: Rows, column: usize) {
    let floor = S::f32s::splat(simd, if matrix.relu { 0.0 } else { f32::NEG_INFINITY });
    let blocks = matrix.weights.chunks_exact(matrix.depth).zip(&matrix.bias).zip(rows.outputs.as_chunks::<BLOCK>().0);
    for (block, ((weights, bias), outputs)) in blocks.enumerate() {
        let sums = product::<S, V>(simd, memory, weights, bias, rows.inputs, column);
        for row in 0..BLOCK {
            for vector in 0..V {
                let (mut sum, at) = (sums[row][vector], column + vector * S::f32s::LEN);
                if let Some(addend) = rows.addend.get(block * BLOCK + row) {
                    sum += load(simd, memory, addend + at);
                }
                let place = &mut memory[outputs[row] + at..][..S::f32s::LEN];
                if rows.keep_larger {
                    sum = sum.max(S::f32s::from_slice(simd, place));
                }
                sum.max(floor).store_slice(place);
            }
        }
    }
}

/// Computes one block of output channels for `V` vectors.
#[inline(always)]
fn product<S: Simd, const V: usize>(
    simd: S,
    memory: &[f32],
    weights: &[[f32; BLOCK]],
    bias: &[f32; BLOCK],
    inputs: &[usize],
    column: usize,
) -> [[S::f32s; V]; BLOCK] {
    let mut sums = [[S::f32s::splat(simd, 0.0); V]; BLOCK];
    for row in 0..BLOCK {
        sums[row] = [S::f32s::splat(simd, bias[row]); V];
    }
    let depth = weights.len().min(inputs.len());
    let (weights, inputs) = (&weights[..depth], &inputs[..depth]);
    for k in 0..depth {
        let line = &memory[inputs[k] + column..][..V * S::f32s::LEN];
        let mut values = [sums[0][0]; V];
        for vector in 0..V {
            values[vector] = load(simd, line, vector * S::f32s::LEN);
        }
        for row in 0..BLOCK {
            let weight = S::f32s::splat(simd, weights[k][row]);
            for vector in 0..V {
                sums[row][vector] = weight.mul_add(values[vector], sums[row][vector]);
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::kernels::testing::{Arena, assert_close, levels, noise};

    proptest! {
        #[test]
        fn equals_the_sum_of_products(
            (count, depth, length) in (1..30_usize, 1..40_usize, 1..150_usize),
            (relu, adds, keep_larger) in any::<(bool, bool, bool)>(),
            seed in any::<u32>(),
        ) {
            let (weights, bias) = (noise(count * depth, seed), noise(count, seed ^ 1));
            let matrix = Matrix::pack(&weights, &bias, relu);
            let padded = matrix.padded_rows();
            let size = (1, length);
            for level in levels() {
                let (mut arena, offsets) = Arena::new(&[(depth, size), (padded, size), (padded, size)], seed);
                let [inputs, addend, outputs] = &offsets[..] else { unreachable!() };
                let before = arena.memory.clone();
                let addend = if adds { &addend[..] } else { &[] };
                multiply(level, &mut arena.memory, &matrix, Rows { inputs, outputs, addend, keep_larger, length });
                arena.assert_untouched(&before, outputs);
                for row in 0..count {
                    let expected: Vec<f64> = (0..length).map(|column| {
                        let product = |k: usize| f64::from(weights[row * depth + k]) * f64::from(before[inputs[k] + column]);
                        let added = if adds { f64::from(before[addend[row] + column]) } else { 0.0 };
                        let sum = (0..depth).map(product).sum::<f64>() + f64::from(bias[row]) + added;
                        let least = if keep_larger { f64::from(before[outputs[row] + column]) } else { f64::NEG_INFINITY };
                        sum.max(least).max(if relu { 0.0 } else { f64::NEG_INFINITY })
                    }).collect();
                    assert_close(arena.plane(outputs[row]), &expected, &format!("{level:?}"));
                }
            }
        }
    }
}
