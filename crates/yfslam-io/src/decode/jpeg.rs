//! Baseline and progressive JPEG by `zune-jpeg`.

use yfslam::RgbImage;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::{COLOR_SIZE_CURE, DecodeError, ImageSize, check_size};

pub fn decode_color(bytes: &[u8], expected: Option<ImageSize>, into: &mut RgbImage) -> Result<(), DecodeError> {
    if !is_complete(bytes) {
        return Err(DecodeError::Damaged("it ends before the end-of-image marker".into()));
    }
    // Without strict mode the rest of a damaged image would be grey.
    let options = DecoderOptions::default().set_strict_mode(true).jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let damaged = |error: zune_jpeg::errors::DecodeErrors| DecodeError::Damaged(error.to_string());
    decoder.decode_headers().map_err(damaged)?;
    let (width, height) = decoder.dimensions().ok_or_else(|| DecodeError::Damaged("no frame header".into()))?;
    check_size(ImageSize { width, height }, expected, COLOR_SIZE_CURE)?;
    into.resize(width, height);
    decoder.decode_into(into.data_mut().as_flattened_mut()).map_err(damaged)
}

/// Checks for an end-of-image marker after the last scan. The decoder itself accepts a file whose last few bytes are missing.
fn is_complete(bytes: &[u8]) -> bool {
    const START_OF_SCAN: [u8; 2] = [0xff, 0xda];
    const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
    // Inside a scan 0xff is followed by 0 or a restart marker, so neither marker can occur within the pixels.
    let last = bytes.windows(2).rev().find(|&mark| mark == START_OF_SCAN || mark == END_OF_IMAGE);
    last == Some(&END_OF_IMAGE)
}
