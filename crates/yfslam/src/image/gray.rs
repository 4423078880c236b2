//! Conversion from colour to grey.
//!
//! In: 8-bit RGB. Out: 8-bit luma (ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B, in 1/256).

use fearless_simd::{Level, dispatch, prelude::*};

use super::kernels::{even, high_bytes, load, odd, store};
use super::{GrayImage, RgbImage};

/// Weights of red, green and blue in 1/256; their sum is 256, so that white stays white.
const BT601: [u16; 3] = [77, 150, 29];

/// Converts `rgb` to grey; `out` is resized to it.
pub fn gray_from_rgb(rgb: &RgbImage, out: &mut GrayImage) {
    out.resize(rgb.width(), rgb.height());
    convert(Level::new(), rgb.data(), out.data_mut());
}

fn convert(level: Level, rgb: &[[u8; 3]], gray: &mut [u8]) {
    dispatch!(level, simd => convert_blocks(simd, rgb, gray));
}

/// Returns the rounded weighted mean; the sum stays below 2^16.
fn luma(&[r, g, b]: &[u8; 3]) -> u8 {
    ((BT601[0] * u16::from(r) + BT601[1] * u16::from(g) + BT601[2] * u16::from(b) + 128) >> 8) as u8
}

#[inline(always)]
fn convert_blocks<S: Simd>(simd: S, rgb: &[[u8; 3]], gray: &mut [u8]) {
    let lanes = S::u8s::LEN;
    // Byte i of a channel is byte 3·i + channel of three vectors. A table look-up takes two vectors: the first two are combined, then
    // the result with the third.
    let mut first = [S::u8s::splat(simd, 0); 3];
    let mut second = first;
    for channel in 0..3 {
        for i in 0..lanes {
            let byte = 3 * i + channel;
            first[channel][i] = byte.min(2 * lanes - 1) as u8;
            second[channel][i] = if byte < 2 * lanes { i } else { byte - lanes } as u8;
        }
    }
    let (blocks, rest) = rgb.split_at(rgb.len() / lanes * lanes);
    let (gray_blocks, gray_rest) = gray.split_at_mut(blocks.len());
    for (out, block) in gray_blocks.chunks_exact_mut(lanes).zip(blocks.chunks_exact(lanes)) {
        let bytes = block.as_flattened();
        let [a, b, c] = [load(simd, bytes, 0), load(simd, bytes, lanes), load(simd, bytes, 2 * lanes)];
        let mut sums = (S::u16s::splat(simd, 128), S::u16s::splat(simd, 128));
        for channel in 0..3 {
            let value = a.concat_swizzle_dyn(b, first[channel]).concat_swizzle_dyn(c, second[channel]);
            sums.0 += even::<S>(value) * BT601[channel];
            sums.1 += odd::<S>(value) * BT601[channel];
        }
        store::<S>(out, 0, high_bytes::<S>(sums.0, sums.1));
    }
    for (out, pixel) in gray_rest.iter_mut().zip(rest) {
        *out = luma(pixel);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::kernels::tests::levels;
    use super::*;

    proptest! {
        #[test]
        fn every_level_agrees_with_the_scalar_twin(rgb in proptest::collection::vec(any::<[u8; 3]>(), 0..300)) {
            let expected: Vec<u8> = rgb.iter().map(luma).collect();
            for level in levels() {
                let mut gray = vec![0; rgb.len()];
                convert(level, &rgb, &mut gray);
                prop_assert_eq!(&gray, &expected, "{:?}", level);
            }
        }

        #[test]
        fn grey_is_within_one_of_bt601(pixel: [u8; 3]) {
            let [r, g, b] = pixel.map(f64::from);
            prop_assert!((f64::from(luma(&pixel)) - (0.299 * r + 0.587 * g + 0.114 * b)).abs() < 1.0);
        }
    }

    #[test]
    fn grey_pixels_keep_their_value() {
        for value in 0..=255 {
            assert_eq!(luma(&[value; 3]), value);
        }
    }
}
