//! Nearest-neighbour upsampling by 2: every value becomes a square of 2×2.

use fearless_simd::{Level, Simd, SimdBase, dispatch};

use super::load;

/// Writes each input plane of `height × width` twice as large; offsets into memory.
pub(crate) fn double(level: Level, memory: &mut [f32], size: (usize, usize), inputs: &[usize], outputs: &[usize]) {
    dispatch!(level, simd => double_simd(simd, memory, size, inputs, outputs));
}

/// Vectors may reach past the end of a row; rows are written in order, so the next one mends it.
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
                        values.zip_high(values).store_slice(&mut memory[to + S::f32s::LEN..][..S::f32s::LEN]);
                    }
                }
            }
        },
    );
}
