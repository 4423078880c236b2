//! Grey TIFF by the `tiff` crate: integers of 16 or 32 bits, floating-point numbers of 16, 32 or 64 bits.

use std::io::Cursor;

use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use yfslam::Image;

use super::depth_values::{DepthValues, store_integers};
use super::{DEPTH_KIND_CURE, DEPTH_SIZE_CURE, DecodeError, ImageSize, MAX_PIXELS, check_size};

/// Decodes integers into `into`, or returns floating-point numbers.
pub fn decode_depth(
    bytes: &[u8],
    expected: Option<ImageSize>,
    into: &mut Image<u16>,
) -> Result<Option<DepthValues>, DecodeError> {
    let damaged = |error: tiff::TiffError| DecodeError::Damaged(error.to_string());
    let mut limits = Limits::default();
    limits.decoding_buffer_size = 8 * MAX_PIXELS;
    limits.intermediate_buffer_size = 8 * MAX_PIXELS;
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(damaged)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(damaged)?;
    let size = ImageSize { width: width as usize, height: height as usize };
    check_size(size, expected, DEPTH_SIZE_CURE)?;
    let kind = decoder.colortype().map_err(damaged)?;
    let wrong = || DecodeError::WrongKind { found: format!("a TIFF of {kind:?}"), cure: DEPTH_KIND_CURE };
    let ColorType::Gray(16..) = kind else { return Err(wrong()) };
    let values: Vec<f32> = match decoder.read_image().map_err(damaged)? {
        DecodingResult::U16(values) => return integers(values.into_iter().map(Some), size, into),
        DecodingResult::U32(values) => {
            return integers(values.into_iter().map(|value| u16::try_from(value).ok()), size, into);
        }
        DecodingResult::F16(values) => values.into_iter().map(f32::from).collect(),
        DecodingResult::F32(values) => values,
        DecodingResult::F64(values) => values.into_iter().map(|value| value as f32).collect(),
        _ => return Err(wrong()),
    };
    Ok(Some(DepthValues { size, values }))
}

fn integers(
    values: impl ExactSizeIterator<Item = Option<u16>>,
    size: ImageSize,
    into: &mut Image<u16>,
) -> Result<Option<DepthValues>, DecodeError> {
    if values.len() != size.width * size.height {
        return Err(DecodeError::Damaged("it has another number of pixels than its header".into()));
    }
    store_integers(values, size, into).map(|()| None)
}
