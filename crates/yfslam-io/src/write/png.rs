//! Writes colour, depth and mask images as PNG, with fast compression.

use std::io::{self, Write};
use std::path::Path;

use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};
use yfslam::{Image, RgbImage};

use crate::atomic_file::write_atomically;
use crate::error::Result;

/// Writes an 8-bit RGB PNG.
///
/// # Errors
/// The file cannot be written, or the image is empty.
pub fn write_color_png(path: &Path, image: &RgbImage) -> Result<()> {
    write_atomically(path, |writer| encode_color(image, writer))
}

/// Writes depth in sensor units as a 16-bit grey PNG, like the recordings of TUM and Bonn.
///
/// # Errors
/// The file cannot be written, or the image is empty.
pub fn write_depth_png(path: &Path, depth: &Image<u16>) -> Result<()> {
    write_atomically(path, |writer| encode_depth(depth, writer))
}

/// Writes an 8-bit grey PNG, such as a mask.
///
/// # Errors
/// The file cannot be written, or the image is empty.
pub fn write_mask_png(path: &Path, mask: &Image<u8>) -> Result<()> {
    write_atomically(path, |writer| encode_mask(mask, writer))
}

pub(super) fn encode_color(image: &RgbImage, writer: &mut dyn Write) -> io::Result<()> {
    let kind = (ColorType::Rgb, BitDepth::Eight);
    encode((image.width(), image.height()), kind, image.data().as_flattened(), writer)
}

pub(super) fn encode_depth(depth: &Image<u16>, writer: &mut dyn Write) -> io::Result<()> {
    let bytes: Vec<u8> = depth.data().iter().flat_map(|value| value.to_be_bytes()).collect();
    encode((depth.width(), depth.height()), (ColorType::Grayscale, BitDepth::Sixteen), &bytes, writer)
}

/// Encodes a mask as 8-bit grey; the value is the instance.
pub(super) fn encode_mask(mask: &Image<u8>, writer: &mut dyn Write) -> io::Result<()> {
    encode((mask.width(), mask.height()), (ColorType::Grayscale, BitDepth::Eight), mask.data(), writer)
}

fn encode(
    size: (usize, usize),
    (color, depth): (ColorType, BitDepth),
    bytes: &[u8],
    writer: &mut dyn Write,
) -> io::Result<()> {
    let side = |length: usize| u32::try_from(length).map_err(io::Error::other);
    let mut encoder = Encoder::new(writer, side(size.0)?, side(size.1)?);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(Compression::Fast);
    let mut writer = encoder.write_header().map_err(io_error)?;
    writer.write_image_data(bytes).map_err(io_error)?;
    writer.finish().map_err(io_error)
}

/// Returns the error of the operating system, which says what to do, such as to free some space.
fn io_error(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        error => io::Error::other(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::{decode_color, decode_depth};

    #[test]
    fn a_full_device_is_an_error_with_a_cure() {
        let error = write_color_png(Path::new("/dev/full"), &RgbImage::new(200, 200)).unwrap_err().to_string();
        assert!(error.contains("free some space"), "{error}");
    }

    #[test]
    fn written_images_decode_to_the_same_pixels() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.png");
        let color = RgbImage::from_vec(5, 3, (0..15u8).map(|i| [i, 255 - i, i * 7]).collect()).unwrap();
        write_color_png(&path, &color).unwrap();
        let mut again = RgbImage::default();
        decode_color(&std::fs::read(&path).unwrap(), None, &mut again).unwrap();
        assert_eq!(again, color);

        let depth = Image::from_vec(5, 3, (0..15u16).map(|i| i * 4369).collect()).unwrap();
        write_depth_png(&path, &depth).unwrap();
        let mut again = Image::default();
        decode_depth(&std::fs::read(&path).unwrap(), None, &mut again).unwrap();
        assert_eq!(again, depth);
    }

    #[test]
    fn an_empty_image_is_refused_and_nothing_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.png");
        assert!(write_color_png(&path, &RgbImage::default()).unwrap_err().to_string().contains("image.png"));
        assert!(!path.exists());
    }
}
