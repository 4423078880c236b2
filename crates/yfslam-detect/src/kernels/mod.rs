//! The vector kernels, written once over `fearless_simd` and compiled for each instruction set.
//!
//! All work on one slice of floats, the network's memory, at offsets fixed when the model is loaded. They are generic over the
//! instruction set, and everything they call must be inlined; array methods that take closures are not, hence plain loops.

pub(crate) mod depthwise;
pub(crate) mod matmul;
pub(crate) mod stem;
pub(crate) mod upsample;

use fearless_simd::{Level, Simd, SimdBase};

/// The widest vector, floats. Whoever lays out memory leaves that much room for vectors that reach past the end of a row.
pub(crate) const WIDEST: usize = 16;

/// One vector from `memory` at `offset`.
#[inline(always)]
fn load<S: Simd>(simd: S, memory: &[f32], offset: usize) -> S::f32s {
    S::f32s::from_slice(simd, &memory[offset..][..S::f32s::LEN])
}

/// The instruction sets that can be chosen on this machine, slowest first, the best one last.
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
