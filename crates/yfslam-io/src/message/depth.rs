//! Pixels of depth images as `sensor_msgs/Image` stores them (REP 118: 16-bit millimetres, or 32-bit metres).

use yfslam::Image as Pixels;

use super::rows;
use super::types::Image;
use crate::decode::{DecodeError, ImageSize};

pub const SIZE_CURE: &str =
    "depth must be registered to colour: choose the topic of aligned depth images with --depth-topic, or record it";
pub const KIND_CURE: &str = "the depth encodings are 16UC1, mono16, 32FC1 and compressedDepth (png or rvl) of both";

/// Decodes a depth image into `into`; metres are rounded to `depth_factor` units per metre.
pub fn decode(
    image: &Image<'_>,
    depth_factor: f64,
    expected: Option<ImageSize>,
    into: &mut Pixels<u16>,
) -> Result<(), DecodeError> {
    match (image.encoding, image.is_bigendian) {
        ("16UC1" | "mono16", false) => each::<2>(image, expected, into, u16::from_le_bytes),
        ("16UC1" | "mono16", true) => each::<2>(image, expected, into, u16::from_be_bytes),
        ("32FC1", false) => each::<4>(image, expected, into, |b| units(f32::from_le_bytes(b), depth_factor)),
        ("32FC1", true) => each::<4>(image, expected, into, |b| units(f32::from_be_bytes(b), depth_factor)),
        (other, _) => Err(DecodeError::WrongKind { found: format!("an image in encoding '{other}'"), cure: KIND_CURE }),
    }
}

fn each<const N: usize>(
    image: &Image<'_>,
    expected: Option<ImageSize>,
    into: &mut Pixels<u16>,
    convert: impl Fn([u8; N]) -> u16,
) -> Result<(), DecodeError> {
    let (size, rows) = rows(image, N, expected, SIZE_CURE)?;
    into.resize(size.width, size.height);
    for (to, from) in into.data_mut().chunks_exact_mut(size.width).zip(rows) {
        let (pixels, _) = from.as_chunks::<N>();
        to.iter_mut().zip(pixels).for_each(|(to, &from)| *to = convert(from));
    }
    Ok(())
}

/// Returns a depth in units; 0, which means not measured, for what is not a number or out of range.
pub fn units(metres: f32, depth_factor: f64) -> u16 {
    let units = (f64::from(metres) * depth_factor).round();
    if (1.0..=f64::from(u16::MAX)).contains(&units) { units as u16 } else { 0 }
}
