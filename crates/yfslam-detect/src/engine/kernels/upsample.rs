//! Nearest-neighbour upsampling by 2: every value becomes a square of 2×2.

use fearless_simd::{Level, Simd, SimdBase, dispatch};

use super::load;

/// Writes each input plane of `height × width` twice as large; the arguments are offsets into memory.
pub(crate) fn double(level: Level, memory: &mut [f32], size: (usize, usize), inputs: &[usize], outputs: &[usize]) {
    dispatch!(level, simd => double_simd(simd, memory, size, inputs, outputs));
}

/// Vectors may write past the end of a row; rows are written in order, so that the next one overwrites this.
#[inline(always)]
fn double_simd<S: Simd>(
    simd: S,
    memory: &mut [f32],
    (height, width): (usize, usize),
    inputs: &[usize],
    outputs: &[usize],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (input, output) in inputs.iter().zip(outputs) {
                for y in 0..2 * height {
                    for x in (0..width).step_by(S::f32s::LEN) {
                        let values = load(simd, memory, input + y / 2 * width + x);
                        let to = output + y * 2 * width + 2 * x;
                        values.zip_low(values).store_slice(&mut memory[to..][..S::f32s::LEN]);
                        if 2 * x + S::f32s::LEN < 2 * width {
                            values.zip_high(values).store_slice(&mut memory[to + S::f32s::LEN..][..S::f32s::LEN]);
                        }
                    }
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::kernels::testing::{Arena, levels};

    proptest! {
        #[test]
        fn every_value_becomes_a_square((height, width) in (1..30_usize, 1..40_usize), seed in any::<u32>()) {
            for level in levels() {
                let large = (2 * height, 2 * width);
                let (mut arena, offsets) = Arena::new(&[(2, (height, width)), (2, large), (1, (9, 9))], seed);
                let before = arena.memory.clone();
                double(level, &mut arena.memory, (height, width), &offsets[0], &offsets[1]);
                arena.assert_untouched(&before, &offsets[1]);
                for (input, output) in offsets[0].iter().zip(&offsets[1]) {
                    for (index, value) in arena.plane(*output).iter().enumerate() {
                        let (y, x) = (index / large.1, index % large.1);
                        prop_assert_eq!(*value, before[input + y / 2 * width + x / 2]);
                    }
                }
            }
        }
    }
}
