//! Depth images of `compressed_depth_image_transport`, and plain 16-bit PNG of `compressed_image_transport`.
//!
//! In: a `CompressedImage` with 12 bytes (codec, two parameters of the quantisation) and a PNG, or width, height and RVL (Wilson, "Fast
//! lossless depth image compression", ISS 2017). Out: depth; that of 32 bits was stored as 16-bit inverse depth.

use yfslam::{DepthImage, Image};

use super::depth::{KIND_CURE, SIZE_CURE, metres_factor, units};
use super::types::CompressedImage;
use crate::decode::{DecodeError, ImageSize, check_size, decode_depth};

const PNG: &[u8] = b"\x89PNG";

/// Decodes a depth image into `into`; metres are rounded to `depth_factor` units per metre.
pub fn decode(
    image: &CompressedImage<'_>,
    depth_factor: f64,
    expected: Option<ImageSize>,
    into: &mut DepthImage,
) -> Result<(), DecodeError> {
    into.metres_per_unit = (1.0 / depth_factor) as f32;
    if image.data.starts_with(PNG) {
        return decode_depth(image.data, expected, &mut into.raw);
    }
    let format = image.format;
    if !format.contains("compressedDepth") {
        return Err(DecodeError::WrongKind {
            found: format!("a compressed image in format '{format}'"),
            cure: KIND_CURE,
        });
    }
    let Some((head, rest)) = image.data.split_first_chunk::<12>() else {
        return Err(DecodeError::Damaged(format!("{} bytes are too few for compressed depth", image.data.len())));
    };
    if rest.starts_with(PNG) {
        decode_depth(rest, expected, &mut into.raw)?;
    } else if format.contains("rvl") {
        decode_rvl(rest, expected, &mut into.raw)?;
    } else {
        return Err(DecodeError::WrongKind {
            found: format!("compressed depth in format '{format}'"),
            cure: KIND_CURE,
        });
    }
    if format.starts_with("32FC1") {
        let parameter = |at: usize| {
            let bytes = head.get(at..).and_then(|rest| rest.first_chunk::<4>());
            bytes.map_or(0.0, |bytes| f32::from_le_bytes(*bytes))
        };
        let (a, b) = (parameter(4), parameter(8));
        let metres_factor = metres_factor(depth_factor);
        into.metres_per_unit = (1.0 / metres_factor) as f32;
        let of_inverse = |raw: u16| if raw == 0 { 0 } else { units(a / (f32::from(raw) - b), metres_factor) };
        into.raw.data_mut().iter_mut().for_each(|raw| *raw = of_inverse(*raw));
    }
    Ok(())
}

/// Decodes runs of zeros and of differences to the last pixel, in numbers of a variable count of nibbles.
fn decode_rvl(bytes: &[u8], expected: Option<ImageSize>, into: &mut Image<u16>) -> Result<(), DecodeError> {
    let damaged = || DecodeError::Damaged("the RVL data contradict themselves or end early".into());
    let side = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk::<4>()?) as usize);
    let (width, height) = side(0).zip(side(4)).ok_or_else(damaged)?;
    let size = ImageSize { width, height };
    check_size(size, expected, SIZE_CURE)?;
    into.resize(width, height);
    into.data_mut().fill(0);
    let mut numbers = Numbers { nibbles: bytes.get(8..).unwrap_or(&[]), next: 0 };
    let mut pixels = into.data_mut();
    let mut last = 0u16;
    while !pixels.is_empty() {
        let zeros = numbers.next().ok_or_else(damaged)?;
        let values = if zeros == pixels.len() { 0 } else { numbers.next().ok_or_else(damaged)? };
        let (_, rest) = pixels.split_at_mut_checked(zeros).ok_or_else(damaged)?;
        let (run, rest) = rest.split_at_mut_checked(values).ok_or_else(damaged)?;
        if zeros == 0 && values == 0 {
            return Err(damaged());
        }
        for pixel in run {
            let number = numbers.next().ok_or_else(damaged)?;
            // The lowest bit is the sign.
            let difference = (number >> 1) as u16 ^ ((number & 1) as u16).wrapping_neg();
            last = last.wrapping_add(difference);
            *pixel = last;
        }
        pixels = rest;
    }
    Ok(())
}

/// Numbers in nibbles: three bits each, the lowest first; the highest bit says that more follow. Eight nibbles make a little-endian word,
/// the highest first.
struct Numbers<'a> {
    nibbles: &'a [u8],
    next: usize,
}

impl Numbers<'_> {
    fn next(&mut self) -> Option<usize> {
        let mut number = 0;
        // 33 bits are more than any number needs.
        for shift in (0..33).step_by(3) {
            let in_word = self.next % 8;
            let byte = *self.nibbles.get(self.next / 8 * 4 + 3 - in_word / 2)?;
            let nibble = if in_word.is_multiple_of(2) { byte >> 4 } else { byte & 15 };
            self.next += 1;
            number |= usize::from(nibble & 7) << shift;
            if nibble < 8 {
                return Some(number);
            }
        }
        None
    }
}
