//! Rotated BRIEF descriptors.
//!
//! In: a blurred grey image, a pixel and its orientation. Out: 256 bits, one per test pair (Rublee et al., ICCV 2011, section 4).

use super::Descriptor;
use super::pattern::TEST_PAIRS;
use crate::image::GrayImage;

/// Descriptor of the patch around `(x, y)`; bit `i` says that the first point of pair `i` is darker than the second.
pub(crate) fn describe(blurred: &GrayImage, x: usize, y: usize, angle_rad: f32) -> Descriptor {
    let (sin, cos) = angle_rad.sin_cos();
    let pixel = |u: i8, v: i8| {
        let (u, v) = (f32::from(u), f32::from(v));
        let dx = (u * cos - v * sin).round() as isize;
        let dy = (u * sin + v * cos).round() as isize;
        blurred.row(y.wrapping_add_signed(dy))[x.wrapping_add_signed(dx)]
    };
    let mut bits = [0u64; 4];
    for (i, &[xa, ya, xb, yb]) in TEST_PAIRS.iter().enumerate() {
        bits[i / 64] |= u64::from(pixel(xa, ya) < pixel(xb, yb)) << (i % 64);
    }
    Descriptor(bits)
}
