//! Pixels of depth images as `sensor_msgs/Image` stores them (REP 118: 16-bit millimetres, or 32-bit metres).

use yfslam::DepthImage;

use super::rows;
use super::types::Image;
use crate::decode::{DecodeError, ImageSize};

pub const SIZE_CURE: &str =
    "depth must be registered to colour: choose the topic of aligned depth images with --depth-topic, or record it";
pub const KIND_CURE: &str = "the depth encodings are 16UC1, mono16, 32FC1 and compressedDepth (png or rvl) of both";

/// Units per metre of depth that was recorded in metres, unless the camera has finer ones: 0.5 mm, and a range of 32 m.
pub const METRES_UNITS: f64 = 2000.0;

/// Units that are coarser than 2 mm are meant for integers, not for metres.
const COARSE_UNITS: f64 = 500.0;

/// Decodes a depth image into `into`; metres are rounded to `depth_factor` units per metre.
pub fn decode(
    image: &Image<'_>,
    depth_factor: f64,
    expected: Option<ImageSize>,
    into: &mut DepthImage,
) -> Result<(), DecodeError> {
    let metres_factor = metres_factor(depth_factor);
    let is_integer = image.encoding != "32FC1";
    into.metres_per_unit = (1.0 / if is_integer { depth_factor } else { metres_factor }) as f32;
    match (image.encoding, image.is_bigendian) {
        ("16UC1" | "mono16", false) => each::<2>(image, expected, into, |b| measured(u16::from_le_bytes(b))),
        ("16UC1" | "mono16", true) => each::<2>(image, expected, into, |b| measured(u16::from_be_bytes(b))),
        ("32FC1", false) => each::<4>(image, expected, into, |b| units(f32::from_le_bytes(b), metres_factor)),
        ("32FC1", true) => each::<4>(image, expected, into, |b| units(f32::from_be_bytes(b), metres_factor)),
        (other, _) => Err(DecodeError::WrongKind { found: format!("an image in encoding '{other}'"), cure: KIND_CURE }),
    }
}

fn each<const N: usize>(
    image: &Image<'_>,
    expected: Option<ImageSize>,
    into: &mut DepthImage,
    convert: impl Fn([u8; N]) -> u16,
) -> Result<(), DecodeError> {
    let (size, rows) = rows(image, N, expected, SIZE_CURE)?;
    into.raw.resize(size.width, size.height);
    for (to, from) in into.raw.data_mut().chunks_exact_mut(size.width).zip(rows) {
        let (pixels, _) = from.as_chunks::<N>();
        to.iter_mut().zip(pixels).for_each(|(to, &from)| *to = convert(from));
    }
    Ok(())
}

/// Returns 0 for the value with which sensors mark pixels without a measurement.
fn measured(raw: u16) -> u16 {
    if raw == u16::MAX { 0 } else { raw }
}

/// Returns the units per metre of depth that was recorded in metres.
pub fn metres_factor(depth_factor: f64) -> f64 {
    if depth_factor < COARSE_UNITS { METRES_UNITS } else { depth_factor }
}

/// Returns a depth in units; 0, which means not measured, for what is not a number or out of range.
pub fn units(metres: f32, depth_factor: f64) -> u16 {
    let units = (f64::from(metres) * depth_factor).round();
    if (1.0..=f64::from(u16::MAX)).contains(&units) { units as u16 } else { 0 }
}
