//! Arrays of NumPy (`.npy`): integers of 16, 32 or 64 bits, floating-point numbers of 16, 32 or 64 bits, in either byte order.
//!
//! Format: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use yfslam::Image;

use super::depth_values::{DepthValues, store_integers};
use super::{DEPTH_KIND_CURE, DEPTH_SIZE_CURE, DecodeError, ImageSize, check_size};

/// Decodes integers into `into`, or returns floating-point numbers.
pub fn decode_depth(
    bytes: &[u8],
    expected: Option<ImageSize>,
    into: &mut Image<u16>,
) -> Result<Option<DepthValues>, DecodeError> {
    let (header, data) = split(bytes).ok_or_else(|| DecodeError::Damaged("its header is incomplete".into()))?;
    let wrong = |found: String| DecodeError::WrongKind { found, cure: DEPTH_KIND_CURE };
    let entry = |key: &str| {
        let value = header.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start());
        value.ok_or_else(|| DecodeError::Damaged(format!("its header has no '{key}'")))
    };
    if entry("fortran_order")?.starts_with("True") {
        return Err(wrong("a NumPy array in the order of columns".into()));
    }
    let size = size(entry("shape")?).ok_or_else(|| wrong("a NumPy array that is no image".into()))?;
    check_size(size, expected, DEPTH_SIZE_CURE)?;
    let kind = entry("descr")?.trim_start_matches('\'').split('\'').next().unwrap_or_default();
    let pixels = size.width * size.height;
    let width: usize = kind.get(2..).and_then(|width| width.parse().ok()).unwrap_or(0);
    let needed = pixels.saturating_mul(width);
    if data.len() < needed {
        return Err(DecodeError::Damaged(format!("it has {} of {needed} bytes of pixels", data.len())));
    }
    let is_big = kind.starts_with('>');
    let floats = |values: Vec<f32>| Ok(Some(DepthValues { size, values }));
    match kind.get(1..) {
        Some("u2") => store_integers(numbers(data, is_big, pixels).map(|b| Some(u16::from_le_bytes(b))), size, into)?,
        Some("i2") => {
            let value = |b| Some(u16::try_from(i16::from_le_bytes(b)).unwrap_or(0));
            store_integers(numbers(data, is_big, pixels).map(value), size, into)?;
        }
        Some("u4" | "i4") => {
            let value = |b| u16::try_from(u32::from_le_bytes(b)).ok();
            store_integers(numbers(data, is_big, pixels).map(value), size, into)?;
        }
        Some("u8" | "i8") => {
            let value = |b| u16::try_from(u64::from_le_bytes(b)).ok();
            store_integers(numbers(data, is_big, pixels).map(value), size, into)?;
        }
        Some("f2") => return floats(numbers(data, is_big, pixels).map(|b| half(u16::from_le_bytes(b))).collect()),
        Some("f4") => return floats(numbers(data, is_big, pixels).map(f32::from_le_bytes).collect()),
        Some("f8") => return floats(numbers(data, is_big, pixels).map(|b| f64::from_le_bytes(b) as f32).collect()),
        _ => return Err(wrong(format!("a NumPy array of type '{kind}'"))),
    }
    Ok(None)
}

/// Returns the text of the header and the bytes after it.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let (length, rest) = match bytes.get(6..)? {
        [1, _, a, b, rest @ ..] => (usize::from(u16::from_le_bytes([*a, *b])), rest),
        [2 | 3, _, a, b, c, d, rest @ ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, rest),
        _ => return None,
    };
    let (header, data) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(header).ok()?, data))
}

/// Parses a shape such as `(480, 640)` or `(1, 480, 640, 1)`.
fn size(shape: &str) -> Option<ImageSize> {
    let inside = shape.strip_prefix('(')?.split(')').next()?;
    let sides: Vec<usize> = inside
        .split(',')
        .map(str::trim)
        .filter(|side| !side.is_empty())
        .map(str::parse)
        .collect::<Result<_, _>>()
        .ok()?;
    match sides.as_slice() {
        [height, width] | [1, height, width] | [height, width, 1] | [1, height, width, 1] | [1, 1, height, width] => {
            Some(ImageSize { width: *width, height: *height })
        }
        _ => None,
    }
}

/// Returns `count` numbers of `N` bytes in little-endian order.
fn numbers<const N: usize>(data: &[u8], is_big: bool, count: usize) -> impl Iterator<Item = [u8; N]> {
    data.as_chunks::<N>().0.iter().take(count).map(move |bytes| {
        let mut bytes = *bytes;
        if is_big {
            bytes.reverse();
        }
        bytes
    })
}

/// Converts a floating-point number of 16 bits (IEEE 754 binary16).
fn half(bits: u16) -> f32 {
    let (sign, exponent, fraction) = (bits >> 15, i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    let magnitude = match exponent {
        0 => fraction * 2f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f32.powi(exponent - 15),
    };
    if sign == 1 { -magnitude } else { magnitude }
}
