//! Decodes image files: PNG and JPEG for colour, 16-bit grey PNG for depth, PNG for masks. The content decides, not the file name.

mod jpeg;
mod png;

use std::fmt;

use yfslam::{Image, RgbImage};

/// Largest image that is decoded, px; it bounds the memory that a forged header can request.
const MAX_PIXELS: usize = 1 << 25;

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
    /// Neither PNG nor JPEG.
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
const COLOR_KIND_CURE: &str = "colour images are 8-bit grey, RGB, RGBA or palette PNG, or JPEG";
const DEPTH_KIND_CURE: &str = "depth images are 16-bit grey PNG";

/// Decodes a colour image (PNG or JPEG; grey becomes R = G = B, alpha is dropped) into `into`, whose buffer is reused.
///
/// # Errors
/// [`DecodeError`]; a size other than `expected` is refused before any pixel is decoded.
pub fn decode_color(bytes: &[u8], expected: Option<ImageSize>, into: &mut RgbImage) -> Result<(), DecodeError> {
    match Format::of(bytes) {
        Format::Png => png::decode_color(bytes, expected, into),
        Format::Jpeg => jpeg::decode_color(bytes, expected, into),
        Format::Other(name) => Err(DecodeError::UnknownFormat(name)),
    }
}

/// Decodes a 16-bit grey PNG into `into`, whose buffer is reused.
///
/// # Errors
/// [`DecodeError`]; a size other than `expected` is refused before any pixel is decoded.
pub fn decode_depth(bytes: &[u8], expected: Option<ImageSize>, into: &mut Image<u16>) -> Result<(), DecodeError> {
    match Format::of(bytes) {
        Format::Png => png::decode_depth(bytes, expected, into),
        Format::Jpeg => {
            Err(DecodeError::WrongKind { found: "a JPEG, which cannot store depth".into(), cure: DEPTH_KIND_CURE })
        }
        Format::Other(name) => Err(DecodeError::UnknownFormat(name)),
    }
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
        Format::Other(name) => Err(DecodeError::UnknownFormat(name)),
    }
}

/// File formats, distinguished by their first bytes.
enum Format {
    Png,
    Jpeg,
    Other(&'static str),
}

impl Format {
    fn of(bytes: &[u8]) -> Self {
        match bytes {
            [] => Self::Other("an empty file"),
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Self::Png,
            [0xff, 0xd8, 0xff, ..] => Self::Jpeg,
            [b'R', b'I', b'F', b'F', ..] => Self::Other("a WebP image"),
            [b'I', b'I', 42, 0, ..] | [b'M', b'M', 0, 42, ..] => Self::Other("a TIFF image"),
            [0x76, 0x2f, 0x31, 0x01, ..] => Self::Other("an OpenEXR image"),
            [b'B', b'M', ..] => Self::Other("a BMP image"),
            [b'P', b'1'..=b'7', ..] => Self::Other("a PNM image"),
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
mod tests;
