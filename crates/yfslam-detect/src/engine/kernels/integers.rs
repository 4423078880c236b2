//! Matrix product with 8-bit integers: the 1×1 convolutions of a model that has the scales of their inputs.
//!
//! An input x is stored as round(x / step) + zero, from 0 to 255; a weight as round(w / step of its row), from −127 to 127. Sums of
//! products are exact, so every instruction set gives the same bits. Source: Jacob et al., Quantization and training of neural
//! networks for efficient integer-arithmetic-only inference, CVPR 2018.
#![allow(clippy::needless_range_loop, reason = "iterator adapters are not inlined in every build, index loops are")]

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch};

use super::matmul::{BLOCK, Rows};
use super::{WIDEST, load};

/// Inputs whose bytes share a word, as in the dot product instruction.
const GROUP: usize = 4;

/// Scale of a tensor in bytes: `value ≈ (byte − zero) · step`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    pub(crate) step: f32,
    pub(crate) zero: u8,
}

/// A weight matrix in the order of the kernel, padded with zeros to multiples of [`BLOCK`] and [`GROUP`].
#[derive(Debug)]
pub(crate) struct IntegerMatrix {
    input: Scale,
    groups: usize,
    /// `[row / BLOCK][column / GROUP][BLOCK]`, the weights of a group in one word, the first in its lowest byte.
    weights: Vec<[i32; BLOCK]>,
    /// Start value of a sum, which compensates `zero`.
    start: Vec<[i32; BLOCK]>,
    /// Factor of a sum.
    step: Vec<[f32; BLOCK]>,
    bias: Vec<[f32; BLOCK]>,
    relu: bool,
}

impl IntegerMatrix {
    /// Packs `bias.len() × depth` row-major `weights`, which are multiplied with values stored as `input`.
    pub(crate) fn pack(weights: &[f32], bias: &[f32], relu: bool, input: Scale) -> Self {
        let depth = weights.len() / bias.len();
        let (groups, blocks) = (depth.div_ceil(GROUP), bias.len().div_ceil(BLOCK));
        let row = |row: usize| weights.get(row * depth..(row + 1) * depth).unwrap_or_default();
        let largest = |row: &[f32]| row.iter().fold(f32::MIN_POSITIVE, |most, weight| most.max(weight.abs()));
        let step = |index: usize| largest(row(index)) / 127.0;
        let bytes = |index: usize| row(index).iter().map(move |weight| (weight / step(index)).round_ties_even() as i8);
        let word = |index: usize, group: usize| {
            let mut word = [0; GROUP];
            word.iter_mut().zip(bytes(index).skip(group * GROUP)).for_each(|(place, byte)| *place = byte as u8);
            i32::from_le_bytes(word)
        };
        let per_block = |value: &dyn Fn(usize) -> f32| -> Vec<[f32; BLOCK]> {
            (0..blocks).map(|block| std::array::from_fn(|index| value(block * BLOCK + index))).collect()
        };
        let start = |index| -i32::from(input.zero) * bytes(index).map(i32::from).sum::<i32>();
        Self {
            input,
            groups,
            weights: (0..blocks)
                .flat_map(|block| {
                    (0..groups).map(move |group| std::array::from_fn(|index| word(block * BLOCK + index, group)))
                })
                .collect(),
            start: (0..blocks).map(|block| std::array::from_fn(|index| start(block * BLOCK + index))).collect(),
            step: per_block(&|index| step(index) * input.step),
            bias: per_block(&|index| bias.get(index).copied().unwrap_or(0.0)),
            relu,
        }
    }

    /// Returns the number of rows including padding.
    pub(crate) fn padded_rows(&self) -> usize {
        self.bias.len() * BLOCK
    }

    /// Returns the number of words of scratch memory for rows of `length` values.
    pub(crate) fn scratch(&self, length: usize) -> usize {
        self.groups * length.next_multiple_of(WIDEST)
    }
}

/// Computes `outputs = relu(weights · inputs + bias + addend)` with rounded inputs and weights.
pub(crate) fn multiply(level: Level, memory: &mut [f32], words: &mut [i32], matrix: &IntegerMatrix, rows: Rows) {
    dispatch!(level, simd => store(simd, memory, words, matrix, rows));
    #[cfg(target_arch = "x86_64")]
    if let Some(avx512) = level.as_avx512() {
        return sum_avx512(avx512, memory, words, matrix, rows);
    }
    sum(memory, words, matrix, rows);
}

/// Rounds the inputs and stores them in `words`: a row for each group of inputs, a word for each position.
#[inline(always)]
fn store<S: Simd>(simd: S, memory: &[f32], words: &mut [i32], matrix: &IntegerMatrix, rows: Rows) {
    simd.vectorize(
        #[inline(always)]
        || {
            let length = rows.length.next_multiple_of(WIDEST);
            let inverse = S::f32s::splat(simd, 1.0 / matrix.input.step);
            let zero = S::f32s::splat(simd, f32::from(matrix.input.zero));
            let (least, most) = (S::f32s::splat(simd, 0.0), S::f32s::splat(simd, 255.0));
            for (group, inputs) in rows.inputs.chunks(GROUP).enumerate() {
                for column in (0..length).step_by(S::f32s::LEN) {
                    let mut word = S::i32s::splat(simd, 0);
                    for (index, input) in inputs.iter().enumerate() {
                        // No fused operation: not every instruction set has one, and all must round alike.
                        let value = (load(simd, memory, input + column) * inverse).round_ties_even() + zero;
                        let byte: S::i32s = value.max(least).min(most).to_int();
                        word |= byte << (8 * index as u32);
                    }
                    word.store_slice(&mut words[group * length + column..][..S::i32s::LEN]);
                }
            }
        },
    );
}

/// Computes the products in plain Rust.
fn sum(memory: &mut [f32], words: &[i32], matrix: &IntegerMatrix, rows: Rows) {
    let length = rows.length.next_multiple_of(WIDEST);
    for (index, output) in rows.outputs.iter().enumerate() {
        let (block, row) = (index / BLOCK, index % BLOCK);
        let weights = &matrix.weights[block * matrix.groups..][..matrix.groups];
        for column in 0..length {
            let mut sum = matrix.start[block][row];
            for (group, weights) in weights.iter().enumerate() {
                let (bytes, weights) = (words[group * length + column].to_le_bytes(), weights[row].to_le_bytes());
                sum += bytes
                    .iter()
                    .zip(weights)
                    .map(|(byte, weight)| i32::from(*byte) * i32::from(weight as i8))
                    .sum::<i32>();
            }
            let mut value = sum as f32 * matrix.step[block][row] + matrix.bias[block][row];
            value += rows.addend.get(index).map_or(0.0, |addend| memory[addend + column]);
            memory[output + column] = if matrix.relu { value.max(0.0) } else { value };
        }
    }
}

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    /// Computes the products with AVX-512 VNNI.
    fn sum_avx512(simd: Avx512, memory: &mut [f32], words: &[i32], matrix: &IntegerMatrix, rows: Rows<'_>) {
        let length = rows.length.next_multiple_of(WIDEST);
        let wide = length / (2 * WIDEST) * (2 * WIDEST);
        for column in (0..wide).step_by(2 * WIDEST) {
            blocks_avx512::<2>(simd, memory, words, matrix, rows, column);
        }
        for column in (wide..length).step_by(WIDEST) {
            blocks_avx512::<1>(simd, memory, words, matrix, rows, column);
        }
    }
);

/// Computes all output channels for `V` vectors from `column` on.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vnni,avx512vl,avx512bw,avx512dq")]
#[inline]
fn blocks_avx512<const V: usize>(
    simd: fearless_simd::x86::Avx512,
    memory: &mut [f32],
    words: &[i32],
    matrix: &IntegerMatrix,
    rows: Rows<'_>,
    column: usize,
) {
    use fearless_simd::{f32x16, i32x16, prelude::*};
    use std::arch::x86_64::{_mm512_cvtepi32_ps, _mm512_dpbusd_epi32, _mm512_set1_epi32};
    let length = rows.length.next_multiple_of(WIDEST);
    let floor = f32x16::splat(simd, if matrix.relu { 0.0 } else { f32::NEG_INFINITY });
    for (block, outputs) in rows.outputs.as_chunks::<BLOCK>().0.iter().enumerate() {
        let mut sums = [[_mm512_set1_epi32(0); V]; BLOCK];
        for row in 0..BLOCK {
            sums[row] = [_mm512_set1_epi32(matrix.start[block][row]); V];
        }
        for (group, weights) in matrix.weights[block * matrix.groups..][..matrix.groups].iter().enumerate() {
            let line = &words[group * length + column..][..V * WIDEST];
            for vector in 0..V {
                let bytes = i32x16::from_slice(simd, &line[vector * WIDEST..][..WIDEST]).into();
                for row in 0..BLOCK {
                    sums[row][vector] = _mm512_dpbusd_epi32(sums[row][vector], bytes, _mm512_set1_epi32(weights[row]));
                }
            }
        }
        for row in 0..BLOCK {
            let step = f32x16::splat(simd, matrix.step[block][row]);
            let bias = f32x16::splat(simd, matrix.bias[block][row]);
            for vector in 0..V {
                let at = column + vector * WIDEST;
                let sum: f32x16<_> = _mm512_cvtepi32_ps(sums[row][vector]).simd_into(simd);
                let mut value = sum * step + bias;
                if let Some(addend) = rows.addend.get(block * BLOCK + row) {
                    value += load(simd, memory, addend + at);
                }
                value.max(floor).store_slice(&mut memory[outputs[row] + at..][..WIDEST]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::kernels::testing::{Arena, levels, noise};

    proptest! {
        #[test]
        fn equals_the_product_of_the_rounded_values(
            (count, depth, length) in (1..30_usize, 1..40_usize, 1..150_usize),
            (relu, adds) in any::<(bool, bool)>(),
            zero in any::<u8>(),
            seed in any::<u32>(),
        ) {
            let (weights, bias) = (noise(count * depth, seed), noise(count, seed ^ 1));
            let scale = Scale { step: 1.6 / 255.0, zero };
            let matrix = IntegerMatrix::pack(&weights, &bias, relu, scale);
            let size = (1, length);
            let mut first = Vec::new();
            for level in levels() {
                let (mut arena, offsets) = Arena::new(&[(depth, size), (matrix.padded_rows(), size), (matrix.padded_rows(), size)], seed);
                let [inputs, addend, outputs] = &offsets[..] else { unreachable!() };
                let before = arena.memory.clone();
                let addend = if adds { &addend[..] } else { &[] };
                let mut words = vec![-1; matrix.scratch(length)];
                multiply(level, &mut arena.memory, &mut words, &matrix, Rows { inputs, outputs, addend, keep_larger: false, length });
                arena.assert_untouched(&before, outputs);
                for row in 0..count {
                    let weights = &weights[row * depth..][..depth];
                    let step = weights.iter().fold(0.0_f32, |most, weight| most.max(weight.abs())) / 127.0;
                    for (column, value) in arena.plane(outputs[row]).iter().enumerate() {
                        let product = |k: usize| {
                            let byte = (before[inputs[k] + column] / scale.step).round_ties_even() + f32::from(zero);
                            f64::from((byte.clamp(0.0, 255.0) - f32::from(zero)) * scale.step) * f64::from((weights[k] / step).round_ties_even() * step)
                        };
                        let added = if adds { f64::from(before[addend[row] + column]) } else { 0.0 };
                        let expected = (0..depth).map(product).sum::<f64>() + f64::from(bias[row]) + added;
                        let expected = if relu { expected.max(0.0) } else { expected };
                        // An input halfway between two bytes may become either.
                        let slack = 1e-4 + depth as f64 * 1e-9;
                        prop_assert!((f64::from(*value) - expected).abs() < slack + f64::from(scale.step), "{level:?}: {value} instead of {expected}");
                    }
                }
                let result: Vec<u32> = outputs[..count].iter().flat_map(|plane| arena.plane(*plane)).map(|value| value.to_bits()).collect();
                if first.is_empty() {
                    first = result;
                } else {
                    prop_assert!(first == result, "{level:?} differs from the scalar twin");
                }
            }
        }
    }
}
