//! Colour to grey.
//!
//! In: 8-bit RGB. Out: 8-bit luma (ITU-R BT.601, weights 0.299, 0.587, 0.114 in 1/256).

use super::{GrayImage, RgbImage};

/// Weights of red, green, blue in 1/256; they sum to 256, so that white stays white.
const BT601: [u16; 3] = [77, 150, 29];

/// Converts `rgb` to grey; `out` takes its size.
pub fn gray_from_rgb(rgb: &RgbImage, out: &mut GrayImage) {
    out.resize(rgb.width(), rgb.height());
    for (gray, &[r, g, b]) in out.data_mut().iter_mut().zip(rgb.data()) {
        *gray = luma(r, g, b);
    }
}

/// Rounded weighted mean; the sum stays below 2^16.
#[inline(always)]
fn luma(r: u8, g: u8, b: u8) -> u8 {
    ((BT601[0] * u16::from(r) + BT601[1] * u16::from(g) + BT601[2] * u16::from(b) + 128) >> 8) as u8
}
