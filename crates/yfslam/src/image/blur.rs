//! Gaussian blur before descriptors are computed.
//!
//! In: a grey image. Out: the image smoothed by a Gaussian of 7 × 7 px, σ = 2 px (ORB-SLAM2, IEEE T-RO 2017, section III).

use fearless_simd::{Level, dispatch, prelude::*};

use super::kernels::{store, symmetric7};
use super::plane::{LANES, Plane};

/// Half the kernel's width, px.
pub(crate) const BLUR_RADIUS: usize = 3;

/// Centre and one side of the symmetric kernel exp(−i²/2σ²), σ = 2 px, in 1/256; the seven weights sum to 256.
const KERNEL: [u16; 4] = [56, 49, 33, 18];

/// Blurs `src` into `dst`, which is resized to it; the outermost [`BLUR_RADIUS`] pixels on each side are unspecified.
///
/// `line` is a buffer for one row.
pub(crate) fn blur(level: Level, src: &Plane, dst: &mut Plane, line: &mut Vec<u8>) {
    dst.resize(src.width(), src.height());
    line.resize(src.stride() + 2 * LANES, 0);
    if src.width() > 2 * BLUR_RADIUS && src.height() > 2 * BLUR_RADIUS {
        dispatch!(level, simd => blur_rows(simd, src, dst, line));
    }
}

#[inline(always)]
fn blur_rows<S: Simd>(simd: S, src: &Plane, dst: &mut Plane, line: &mut [u8]) {
    let (width, stride) = (src.width(), src.stride());
    for y in BLUR_RADIUS..src.height() - BLUR_RADIUS {
        let rows = &src.data()[(y - BLUR_RADIUS) * stride..(y + BLUR_RADIUS + 1) * stride];
        for x in (0..width).step_by(S::u8s::LEN) {
            store::<S>(line, x, symmetric7(simd, rows, x, stride, KERNEL));
        }
        let out = dst.row_mut(y);
        for x in (0..width - 2 * BLUR_RADIUS).step_by(S::u8s::LEN) {
            store::<S>(out, x + BLUR_RADIUS, symmetric7(simd, line, x, 1, KERNEL));
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::kernels::tests::levels;
    use super::super::plane::tests::images;
    use super::*;

    /// Blurs one pixel with the same arithmetic: columns first, rounded, then rows.
    fn blurred(src: &Plane, x: usize, y: usize) -> u8 {
        let weighted = |v: &dyn Fn(usize) -> u8| {
            let sum: u32 = (0..7).map(|i| u32::from(KERNEL[BLUR_RADIUS.abs_diff(i)]) * u32::from(v(i))).sum();
            ((sum + 128) >> 8) as u8
        };
        weighted(&|i| weighted(&|j| src.row(y + j - BLUR_RADIUS)[x + i - BLUR_RADIUS]))
    }

    proptest! {
        #[test]
        fn every_level_agrees_with_the_scalar_twin(image in images(0..150)) {
            let src = Plane::from(&image);
            for level in levels() {
                let mut dst = Plane::default();
                blur(level, &src, &mut dst, &mut Vec::new());
                for y in BLUR_RADIUS..src.height().saturating_sub(BLUR_RADIUS) {
                    for x in BLUR_RADIUS..src.width().saturating_sub(BLUR_RADIUS) {
                        prop_assert_eq!(dst.row(y)[x], blurred(&src, x, y), "{:?} at {}, {}", level, x, y);
                    }
                }
            }
        }
    }

    #[test]
    fn the_kernel_is_a_gaussian_of_two_pixels() {
        let gauss = |i: usize| (-((i * i) as f64) / 8.0).exp();
        let sum: f64 = (0..7).map(|i| gauss(BLUR_RADIUS.abs_diff(i))).sum();
        for (i, &weight) in KERNEL.iter().enumerate() {
            assert!((f64::from(weight) - 256.0 * gauss(i) / sum).abs() < 0.7);
        }
        assert_eq!(KERNEL[0] + 2 * (KERNEL[1] + KERNEL[2] + KERNEL[3]), 256);
    }
}
