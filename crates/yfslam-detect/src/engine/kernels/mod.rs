//! The vector kernels, written once over `fearless_simd` and compiled for each instruction set.
//!
//! All kernels work on one slice of floats, the memory of the network, at offsets fixed when the model is loaded. Functions called
//! by a kernel must be inlined into it, or they are compiled for the wrong instruction set.

pub(crate) mod depthwise;
pub(crate) mod integers;
pub(crate) mod matmul;
pub(crate) mod stem;
pub(crate) mod upsample;

use fearless_simd::{Level, Simd, SimdBase};

/// The widest vector, floats. Every buffer has that much room for vectors that reach past the end of a row.
pub(crate) const WIDEST: usize = 16;

/// Loads one vector from `memory` at `offset`.
#[inline(always)]
fn load<S: Simd>(simd: S, memory: &[f32], offset: usize) -> S::f32s {
    S::f32s::from_slice(simd, &memory[offset..][..S::f32s::LEN])
}

/// Returns the instruction sets of this machine, slowest first, the best one last.
pub fn available_levels() -> Vec<Level> {
    let best = Level::new();
    let mut levels = vec![Level::baseline()];
    #[cfg(target_arch = "x86_64")]
    {
        levels.extend(best.as_sse4_2().map(Level::Sse4_2));
        levels.extend(best.as_avx2().map(Level::Avx2));
        levels.extend(best.as_avx512().map(Level::Avx512));
    }
    levels.dedup_by_key(|level| std::mem::discriminant(level));
    if !levels.iter().any(|level| std::mem::discriminant(level) == std::mem::discriminant(&best)) {
        levels.push(best);
    }
    levels
}

#[cfg(test)]
mod testing {
    //! Planes with random contents, placed as the network places them, for comparing kernels with plain loops.

    use fearless_simd::Level;

    use super::WIDEST;
    use crate::engine::buffer_planner::stride;

    /// Value after the planes, which must stay.
    const SENTINEL: f32 = 12345.0;

    /// Returns every level, including the scalar one.
    pub(crate) fn levels() -> Vec<Level> {
        [vec![Level::fallback()], super::available_levels()].concat()
    }

    /// Returns values in [−1, 1) that differ for each `seed`.
    pub(crate) fn noise(count: usize, seed: u32) -> Vec<f32> {
        let mut state = seed.wrapping_mul(2_654_435_761) | 1;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    /// Memory with groups of planes, filled with noise, and a sentinel after them.
    pub(crate) struct Arena {
        pub(crate) memory: Vec<f32>,
        planes: Vec<(usize, (usize, usize))>,
        end: usize,
    }

    impl Arena {
        pub(crate) fn new(groups: &[(usize, (usize, usize))], seed: u32) -> (Self, Vec<Vec<usize>>) {
            let (mut planes, mut end, mut offsets) = (Vec::new(), 0, Vec::new());
            for (count, size) in groups {
                offsets.push((0..*count).map(|index| end + index * stride(*size)).collect::<Vec<usize>>());
                planes.extend(offsets.last().into_iter().flatten().map(|offset| (*offset, *size)));
                end += count * stride(*size);
            }
            let mut memory = noise(end, seed);
            memory.resize(end + 8 * WIDEST, SENTINEL);
            (Self { memory, planes, end }, offsets)
        }

        pub(crate) fn plane(&self, offset: usize) -> &[f32] {
            let (_, (height, width)) =
                self.planes.iter().find(|(start, _)| *start == offset).expect("a plane starts here");
            &self.memory[offset..][..height * width]
        }

        /// Fails if a plane other than `written` or the sentinel differs from `before`.
        pub(crate) fn assert_untouched(&self, before: &[f32], written: &[usize]) {
            assert!(self.memory[self.end..].iter().all(|value| *value == SENTINEL), "written after the last plane");
            for (offset, (height, width)) in self.planes.iter().filter(|(offset, _)| !written.contains(offset)) {
                let range = *offset..offset + height * width;
                assert_eq!(self.memory[range.clone()], before[range], "the plane at {offset} was overwritten");
            }
        }
    }

    pub(crate) fn assert_close(values: &[f32], expected: &[f64], what: &str) {
        assert_eq!(values.len(), expected.len());
        for (index, (value, expected)) in values.iter().zip(expected).enumerate() {
            assert!(
                (f64::from(*value) - expected).abs() < 1e-4,
                "{what}, element {index}: {value} instead of {expected}"
            );
        }
    }
}
