//! Gaussian blur before descriptors are read.
//!
//! In: a grey image. Out: the same size, smoothed by 7 × 7, σ = 2 px (ORB-SLAM2, IEEE T-RO 2017, section III).

use super::GrayImage;

/// Half the kernel's width, px.
pub const BLUR_RADIUS: usize = 3;

/// Centre and one side of the symmetric kernel exp(−i²/2σ²), σ = 2 px, in 1/256; all seven sum to 256.
const KERNEL: [u16; 4] = [56, 49, 33, 18];

/// Blurs `src` into `dst`, which takes its size; the outermost [`BLUR_RADIUS`] pixels on each side stay unspecified.
pub fn blur(src: &GrayImage, dst: &mut GrayImage) {
    let (width, height) = (src.width(), src.height());
    dst.resize(width, height);
    if width <= 2 * BLUR_RADIUS || height <= 2 * BLUR_RADIUS {
        return;
    }
    let mut line = vec![0u8; width];
    for y in BLUR_RADIUS..height - BLUR_RADIUS {
        for (x, out) in line.iter_mut().enumerate() {
            let tap = |d: usize| u16::from(src.row(y - d)[x]) + u16::from(src.row(y + d)[x]);
            *out = weighted(u16::from(src.row(y)[x]), tap(1), tap(2), tap(3));
        }
        let out = dst.row_mut(y);
        for x in BLUR_RADIUS..width - BLUR_RADIUS {
            let tap = |d: usize| u16::from(line[x - d]) + u16::from(line[x + d]);
            out[x] = weighted(u16::from(line[x]), tap(1), tap(2), tap(3));
        }
    }
}

/// Centre and sums of the pairs at distance 1, 2, 3, weighted and rounded.
#[inline(always)]
fn weighted(centre: u16, one: u16, two: u16, three: u16) -> u8 {
    ((KERNEL[0] * centre + KERNEL[1] * one + KERNEL[2] * two + KERNEL[3] * three + 128) >> 8) as u8
}
