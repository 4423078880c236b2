//! Decodes image files: PNG, JPEG and PNM for colour; PNG, PGM, TIFF, NumPy arrays and OpenEXR for depth; PNG for masks. The content
//! decides, not the file name.

mod depth_values;
mod exif;
#[cfg(feature = "exr")]
mod exr;
mod jpeg;
mod npy;
mod png;
mod pnm;
#[cfg(feature = "tiff")]
mod tiff;

use std::fmt;

use yfslam::{DepthImage, Image, RgbImage};

use depth_values::DepthValues;

/// Largest image that is decoded, px; it bounds the memory that a forged header can request.
pub(crate) const MAX_PIXELS: usize = 1 << 25;

/// Width and height of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl fmt::Display for ImageSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}×{}", self.width, self.height)
    }
}

/// Why the bytes of a file are not the image that is needed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// A format that is not read.
    #[error("is {0}, neither PNG nor JPEG; convert it to PNG")]
    UnknownFormat(&'static str),
    /// An image of another kind than is needed.
    #[error("is {found}; {cure}")]
    WrongKind {
        /// Kind of the image.
        found: String,
        /// What to do.
        cure: &'static str,
    },
    /// The size of the image differs from that of the camera.
    #[error("has {found} pixels, but the camera has {expected}; {cure}")]
    WrongSize {
        /// Size of the image.
        found: ImageSize,
        /// Size of the camera.
        expected: ImageSize,
        /// What to do.
        cure: &'static str,
    },
    /// More pixels than are decoded.
    #[error("claims {0} pixels, more than are supported; unpack the file again if it is damaged, or scale it down")]
    TooLarge(ImageSize),
    /// Truncated or damaged.
    #[error("is damaged ({0}); record or unpack the file again")]
    Damaged(String),
}

const COLOR_SIZE_CURE: &str = "use the camera file of this recording (camera.yaml)";
const DEPTH_SIZE_CURE: &str = "register depth to colour, so that both have the same size";
const MASK_SIZE_CURE: &str = "make the masks from the colour images in their original size";
const DEPTH_KIND_CURE: &str = "depth images are 16-bit grey PNG, PGM or TIFF, or arrays of numbers (.npy, .exr, TIFF); convert it to 16-bit grey PNG";

/// Decodes a colour image (PNG, JPEG, PGM or PPM; grey becomes R = G = B, alpha is dropped, of 16 bits the upper 8 are used) into `into`,
/// whose buffer is reused.
///
/// # Errors
/// [`DecodeError`]; a size other than `expected` is refused before any pixel is decoded.
pub fn decode_color(bytes: &[u8], expected: Option<ImageSize>, into: &mut RgbImage) -> Result<(), DecodeError> {
    match Format::of(bytes) {
        Format::Png => png::decode_color(bytes, expected, into),
        Format::Jpeg => jpeg::decode_color(bytes, expected, into),
        Format::Pnm => pnm::decode_color(bytes, expected, into),
        Format::Tiff => Err(DecodeError::UnknownFormat("a TIFF image")),
        Format::Exr => Err(DecodeError::UnknownFormat("an OpenEXR image")),
        Format::Npy => Err(DecodeError::UnknownFormat("a NumPy array")),
        Format::Other(name) => Err(DecodeError::UnknownFormat(name)),
    }
}

/// Decodes a photo as a viewer shows it: as [`decode_color`], then turned and mirrored by the orientation that its Exif data state.
///
/// # Errors
/// As for [`decode_color`].
pub fn decode_photo(bytes: &[u8]) -> Result<RgbImage, DecodeError> {
    let mut image = RgbImage::default();
    decode_color(bytes, None, &mut image)?;
    Ok(exif::upright(bytes, image))
}

/// Decodes a depth image of 16-bit integers (PNG, PGM, TIFF, NumPy) into `into`, whose buffer is reused. The value 65535, with which
/// sensors and exporters mark pixels without a measurement, becomes 0.
///
/// # Errors
/// [`DecodeError`], also for floating-point numbers; a size other than `expected` is refused before any pixel is decoded.
pub fn decode_depth(bytes: &[u8], expected: Option<ImageSize>, into: &mut Image<u16>) -> Result<(), DecodeError> {
    match decode_values(bytes, expected, into)? {
        None => Ok(()),
        Some(_) => {
            Err(DecodeError::WrongKind { found: "an image of floating-point numbers".into(), cure: DEPTH_KIND_CURE })
        }
    }
}

/// Decodes a depth image of integers or floating-point numbers, with `depth_factor` units per metre, into `into`, whose buffer is
/// reused. 0, negative values, NaN, infinity and the integer 65535 are no measurement. Floating-point numbers are rounded as
/// [`DepthImage::from_f32`] does.
///
/// # Errors
/// [`DecodeError`]; a size other than `expected` is refused before any pixel is decoded.
pub fn decode_depth_image(
    bytes: &[u8],
    expected: Option<ImageSize>,
    depth_factor: f64,
    into: &mut DepthImage,
) -> Result<(), DecodeError> {
    match decode_values(bytes, expected, &mut into.raw)? {
        None => into.metres_per_unit = (1.0 / depth_factor) as f32,
        Some(values) => *into = values.into_metres(depth_factor)?,
    }
    Ok(())
}

/// Decodes 16-bit integers into `into`, or returns floating-point numbers.
fn decode_values(
    bytes: &[u8],
    expected: Option<ImageSize>,
    into: &mut Image<u16>,
) -> Result<Option<DepthValues>, DecodeError> {
    let values = match Format::of(bytes) {
        Format::Png => {
            png::decode_depth(bytes, expected, into)?;
            None
        }
        Format::Pnm => {
            pnm::decode_depth(bytes, expected, into)?;
            None
        }
        Format::Npy => npy::decode_depth(bytes, expected, into)?,
        #[cfg(feature = "tiff")]
        Format::Tiff => tiff::decode_depth(bytes, expected, into)?,
        #[cfg(not(feature = "tiff"))]
        Format::Tiff => return Err(not_built("a TIFF image, which needs the feature `tiff` of this build")),
        #[cfg(feature = "exr")]
        Format::Exr => Some(exr::decode_depth(bytes, expected)?),
        #[cfg(not(feature = "exr"))]
        Format::Exr => return Err(not_built("an OpenEXR image, which needs the feature `exr` of this build")),
        Format::Jpeg => {
            let found = "a JPEG, which cannot store depth".into();
            return Err(DecodeError::WrongKind { found, cure: DEPTH_KIND_CURE });
        }
        Format::Other(name) => return Err(DecodeError::WrongKind { found: name.into(), cure: DEPTH_KIND_CURE }),
    };
    if values.is_none() {
        into.data_mut().iter_mut().filter(|depth| **depth == u16::MAX).for_each(|depth| *depth = 0);
    }
    Ok(values)
}

#[cfg(not(all(feature = "tiff", feature = "exr")))]
fn not_built(found: &str) -> DecodeError {
    DecodeError::WrongKind { found: found.into(), cure: DEPTH_KIND_CURE }
}

/// Decodes a mask, a PNG of any kind, into `into`, whose buffer is reused. A pixel becomes the largest byte of its colours; transparency
/// is ignored. For 8-bit grey this is the value itself.
///
/// # Errors
/// [`DecodeError`]; a size other than `expected` is refused before any pixel is decoded.
pub fn decode_mask(bytes: &[u8], expected: Option<ImageSize>, into: &mut Image<u8>) -> Result<(), DecodeError> {
    match Format::of(bytes) {
        Format::Png => png::decode_mask(bytes, expected, into),
        Format::Jpeg => {
            Err(DecodeError::WrongKind { found: "a JPEG, whose zeros are not exact".into(), cure: "masks are PNG" })
        }
        Format::Pnm | Format::Tiff | Format::Exr | Format::Npy => {
            Err(DecodeError::WrongKind { found: "an image of another format".into(), cure: "masks are PNG" })
        }
        Format::Other(name) => Err(DecodeError::UnknownFormat(name)),
    }
}

/// File formats, distinguished by their first bytes.
enum Format {
    Png,
    Jpeg,
    Pnm,
    Tiff,
    Exr,
    Npy,
    Other(&'static str),
}

impl Format {
    fn of(bytes: &[u8]) -> Self {
        match bytes {
            [] => Self::Other("an empty file"),
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Self::Png,
            [0xff, 0xd8, 0xff, ..] => Self::Jpeg,
            [b'R', b'I', b'F', b'F', ..] => Self::Other("a WebP image"),
            [b'I', b'I', 42, 0, ..] | [b'M', b'M', 0, 42, ..] => Self::Tiff,
            [0x76, 0x2f, 0x31, 0x01, ..] => Self::Exr,
            [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => Self::Npy,
            [b'B', b'M', ..] => Self::Other("a BMP image"),
            [b'P', b'5' | b'6', ..] => Self::Pnm,
            [b'P', b'1'..=b'7', ..] => Self::Other("a PNM image of another kind than P5 and P6"),
            _ => Self::Other("a file of unknown format"),
        }
    }
}

/// Checks a size from a header before anything is allocated for it.
pub(crate) fn check_size(found: ImageSize, expected: Option<ImageSize>, cure: &'static str) -> Result<(), DecodeError> {
    if found.width.checked_mul(found.height).is_none_or(|pixels| pixels > MAX_PIXELS) {
        return Err(DecodeError::TooLarge(found));
    }
    match expected {
        Some(expected) if expected != found => Err(DecodeError::WrongSize { found, expected, cure }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod format_tests;
#[cfg(test)]
mod tests;
