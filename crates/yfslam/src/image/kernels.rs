//! Pixel arithmetic in SIMD vectors, with the same bits at every SIMD level.
//!
//! In: rows of bytes. Out: rows of bytes. Weights are in 1/256 and results are rounded into the high byte of a 16-bit lane. Even and
//! odd bytes are therefore computed separately, which needs no shuffle.

use fearless_simd::prelude::*;

/// Returns the bytes of `v` at even positions as 16-bit lanes.
#[inline(always)]
pub(crate) fn even<S: Simd>(v: S::u8s) -> S::u16s {
    v.bitcast::<S::u16s>() & 0x00ff
}

/// Returns the bytes of `v` at odd positions as 16-bit lanes.
#[inline(always)]
pub(crate) fn odd<S: Simd>(v: S::u8s) -> S::u16s {
    v.bitcast::<S::u16s>() >> 8
}

/// Interleaves the high bytes of `even` and `odd`.
#[inline(always)]
pub(crate) fn high_bytes<S: Simd>(even: S::u16s, odd: S::u16s) -> S::u8s {
    ((even >> 8) | (odd & 0xff00)).bitcast::<S::u8s>()
}

/// Loads the vector of bytes that starts at `slice[at]`.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, slice: &[u8], at: usize) -> S::u8s {
    S::u8s::from_slice(simd, &slice[at..at + S::u8s::LEN])
}

/// Stores the vector of bytes that starts at `slice[at]`.
#[inline(always)]
pub(crate) fn store<S: Simd>(slice: &mut [u8], at: usize, v: S::u8s) {
    v.store_slice(&mut slice[at..at + S::u8s::LEN]);
}

/// Returns the rounded weighted mean `a + (b − a) · weight`, with the weights of the even and odd bytes of `b` in 1/256, below 256.
///
/// The exact sum lies in 0..2^16, so that wrapping in intermediate results cancels.
#[inline(always)]
pub(crate) fn lerp<S: Simd>(a: S::u8s, b: S::u8s, weight: (S::u16s, S::u16s)) -> S::u8s {
    let wide = a.bitcast::<S::u16s>();
    let even_sum = (wide << 8) + (even::<S>(b) - even::<S>(a)) * weight.0 + 128;
    let odd_sum = (wide & 0xff00) + (odd::<S>(b) - odd::<S>(a)) * weight.1 + 128;
    high_bytes::<S>(even_sum, odd_sum)
}

/// Returns the rounded sum of seven vectors at distances of `stride`, the first at `slice[at]`, with the symmetric weights `kernel`
/// (centre first).
#[inline(always)]
pub(crate) fn symmetric7<S: Simd>(simd: S, slice: &[u8], at: usize, stride: usize, kernel: [u16; 4]) -> S::u8s {
    let centre = load(simd, slice, at + 3 * stride);
    let mut sums = (even::<S>(centre) * kernel[0] + 128, odd::<S>(centre) * kernel[0] + 128);
    for (i, &weight) in kernel[1..].iter().enumerate() {
        let before = load(simd, slice, at + (2 - i) * stride);
        let after = load(simd, slice, at + (4 + i) * stride);
        sums.0 += (even::<S>(before) + even::<S>(after)) * weight;
        sums.1 += (odd::<S>(before) + odd::<S>(after)) * weight;
    }
    high_bytes::<S>(sums.0, sums.1)
}

#[cfg(test)]
pub(crate) mod tests {
    use fearless_simd::{Level, Simd};

    /// Returns every SIMD level of this machine and the scalar fallback.
    pub(crate) fn levels() -> Vec<Level> {
        let best = Level::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        let narrower = [
            best.as_avx2().map(|token| token.level()),
            best.as_sse4_2().map(|token| token.level()),
            best.as_sse2().map(|token| token.level()),
        ];
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        let narrower: [Option<Level>; 0] = [];
        [best, Level::fallback()].into_iter().chain(narrower.into_iter().flatten()).collect()
    }
}
