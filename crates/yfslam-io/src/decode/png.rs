//! PNG by the `png` crate, with checksums verified to the end of the file.

use std::io::Cursor;

use png::{BitDepth, ColorType, Decoder, DecodingError, Reader, Transformations};
use yfslam::{Image, RgbImage};

use super::{COLOR_SIZE_CURE, DEPTH_KIND_CURE, DEPTH_SIZE_CURE, DecodeError, ImageSize, MASK_SIZE_CURE, check_size};

type PngReader<'a> = Reader<Cursor<&'a [u8]>>;

pub fn decode_color(bytes: &[u8], expected: Option<ImageSize>, into: &mut RgbImage) -> Result<(), DecodeError> {
    // Of 16 bits the upper 8 are kept.
    let mut reader = open(bytes, Transformations::EXPAND | Transformations::STRIP_16)?;
    let size = size_of(&reader);
    check_size(size, expected, COLOR_SIZE_CURE)?;
    into.resize(size.width, size.height);
    let (color_type, _) = reader.output_color_type();
    if color_type == ColorType::Rgb {
        return read_pixels(&mut reader, into.data_mut().as_flattened_mut());
    }
    let channels = color_type.samples();
    let mut pixels = vec![0; size.width * size.height * channels];
    read_pixels(&mut reader, &mut pixels)?;
    for (rgb, pixel) in into.data_mut().iter_mut().zip(pixels.chunks_exact(channels)) {
        *rgb = match *pixel {
            [r, g, b, ..] => [r, g, b],
            [grey, ..] => [grey; 3],
            [] => [0; 3],
        };
    }
    Ok(())
}

pub fn decode_depth(bytes: &[u8], expected: Option<ImageSize>, into: &mut Image<u16>) -> Result<(), DecodeError> {
    let mut reader = open(bytes, Transformations::IDENTITY)?;
    let info = reader.info();
    if (info.color_type, info.bit_depth) != (ColorType::Grayscale, BitDepth::Sixteen) {
        return Err(DecodeError::WrongKind { found: describe(&reader), cure: DEPTH_KIND_CURE });
    }
    let size = size_of(&reader);
    check_size(size, expected, DEPTH_SIZE_CURE)?;
    into.resize(size.width, size.height);
    read_pixels(&mut reader, bytemuck::cast_slice_mut(into.data_mut()))?;
    into.data_mut().iter_mut().for_each(|depth| *depth = u16::from_be(*depth));
    Ok(())
}

pub fn decode_mask(bytes: &[u8], expected: Option<ImageSize>, into: &mut Image<u8>) -> Result<(), DecodeError> {
    let mut reader = open(bytes, Transformations::EXPAND)?;
    let size = size_of(&reader);
    check_size(size, expected, MASK_SIZE_CURE)?;
    into.resize(size.width, size.height);
    let (kind, depth) = reader.output_color_type();
    let bytes_of = |samples: usize| samples * if depth == BitDepth::Sixteen { 2 } else { 1 };
    let (all, of_color) = match kind {
        ColorType::GrayscaleAlpha => (bytes_of(2), bytes_of(1)),
        ColorType::Rgba => (bytes_of(4), bytes_of(3)),
        kind => (bytes_of(kind.samples()), bytes_of(kind.samples())),
    };
    let mut pixels = vec![0; size.width * size.height * all];
    read_pixels(&mut reader, &mut pixels)?;
    for (value, pixel) in into.data_mut().iter_mut().zip(pixels.chunks_exact(all)) {
        *value = pixel.iter().take(of_color).copied().max().unwrap_or(0);
    }
    Ok(())
}

fn open(bytes: &[u8], transformations: Transformations) -> Result<PngReader<'_>, DecodeError> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(transformations);
    decoder.read_info().map_err(damaged)
}

/// Decodes the whole image and reads up to the end marker, so that a truncated or altered file is refused.
fn read_pixels(reader: &mut PngReader<'_>, pixels: &mut [u8]) -> Result<(), DecodeError> {
    if reader.output_buffer_size() != Some(pixels.len()) {
        return Err(DecodeError::Damaged("the header contradicts itself".into()));
    }
    reader.next_frame(pixels).map_err(damaged)?;
    reader.finish().map_err(damaged)
}

fn size_of(reader: &PngReader<'_>) -> ImageSize {
    ImageSize { width: reader.info().width as usize, height: reader.info().height as usize }
}

/// Describes the kind of image, such as "a PNG of 8-bit RGB".
fn describe(reader: &PngReader<'_>) -> String {
    let kind = match reader.info().color_type {
        ColorType::Grayscale => "grey",
        ColorType::GrayscaleAlpha => "grey-alpha",
        ColorType::Rgb => "RGB",
        ColorType::Rgba => "RGBA",
        ColorType::Indexed => "palette",
    };
    format!("a PNG of {}-bit {kind}", reader.info().bit_depth as u8)
}

fn damaged(error: DecodingError) -> DecodeError {
    DecodeError::Damaged(error.to_string())
}
