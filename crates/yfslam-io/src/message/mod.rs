//! Messages of ROS 1 and ROS 2: their fields, and the images in them.
//!
//! In: the bytes of a message, from a bag or a topic. Out: images, calibrations and poses. [`wire`] has the two forms of the bytes,
//! [`types`] the messages.

mod bayer;
mod color;
mod compressed_depth;
mod depth;
pub mod encode;
pub use depth::METRES_UNITS;
pub mod types;
pub mod wire;

use yfslam::{DepthImage, RgbImage};

use self::types::{CompressedImage, Image};
use self::wire::{Reader, Wire, WireError};
use crate::decode::{DecodeError, ImageSize, check_size, decode_color};

/// The types of messages that are understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MessageType {
    /// `sensor_msgs/Image`.
    Image,
    /// `sensor_msgs/CompressedImage`.
    CompressedImage,
    /// `sensor_msgs/CameraInfo`.
    CameraInfo,
    /// `tf2_msgs/TFMessage`, and `tf/tfMessage` of early bags.
    Tf,
    /// `geometry_msgs/PoseStamped`, `PoseWithCovarianceStamped`.
    Pose,
    /// `geometry_msgs/TransformStamped`, `nav_msgs/Odometry`.
    PoseOfChild,
}

impl MessageType {
    /// Returns the type of this name, which ROS 2 writes as `package/msg/Name`; `None` if it is not understood.
    pub fn of(name: &str) -> Option<Self> {
        Some(match name.replace("/msg/", "/").as_str() {
            "sensor_msgs/Image" => Self::Image,
            "sensor_msgs/CompressedImage" => Self::CompressedImage,
            "sensor_msgs/CameraInfo" => Self::CameraInfo,
            "tf2_msgs/TFMessage" | "tf/tfMessage" => Self::Tf,
            "geometry_msgs/PoseStamped" | "geometry_msgs/PoseWithCovarianceStamped" => Self::Pose,
            "geometry_msgs/TransformStamped" | "nav_msgs/Odometry" => Self::PoseOfChild,
            _ => return None,
        })
    }
}

/// What the first bytes of an image message say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImageHead {
    /// Time of the image, ns.
    pub stamp_ns: i64,
    /// Name of the frame.
    pub frame_id: String,
    /// Size; `None` for compressed images.
    pub size: Option<ImageSize>,
    /// The encoding, or the format of a compressed image.
    pub encoding: String,
}

impl ImageHead {
    /// Reads the first fields of an image message; the bytes may end after them.
    ///
    /// # Errors
    /// The bytes end before, or the type is not that of an image.
    pub fn read(kind: MessageType, wire: Wire, bytes: &[u8]) -> Result<Self, WireError> {
        let mut from = Reader::new(wire, bytes)?;
        if kind == MessageType::CompressedImage {
            let image = CompressedImage::read_head(&mut from)?;
            let (stamp_ns, frame_id) = (image.header.stamp_ns, image.header.frame_id.to_owned());
            return Ok(Self { stamp_ns, frame_id, size: None, encoding: image.format.trim().to_owned() });
        }
        let image = Image::read_head(&mut from)?;
        let size = Some(ImageSize { width: image.width as usize, height: image.height as usize });
        let (stamp_ns, frame_id) = (image.header.stamp_ns, image.header.frame_id.to_owned());
        Ok(Self { stamp_ns, frame_id, size, encoding: image.encoding.to_owned() })
    }

    /// Returns whether the encoding is one of depth images; 16-bit grey may be either.
    pub fn is_depth(&self, topic: &str) -> bool {
        let encoding = self.encoding.as_str();
        let deep = ["16UC1", "32FC1"].iter().any(|deep| encoding.starts_with(deep));
        let named = topic.to_lowercase().contains("depth");
        encoding.contains("compressedDepth") || deep || (named && encoding.starts_with("mono16"))
    }
}

/// Decodes the colour image of an `Image` or `CompressedImage` into `into`, whose buffer is reused.
///
/// # Errors
/// [`DecodeError`], as for an image file; also an encoding that is not understood.
pub fn decode_color_message(
    kind: MessageType,
    wire: Wire,
    bytes: &[u8],
    expected: Option<ImageSize>,
    into: &mut RgbImage,
) -> Result<(), DecodeError> {
    let mut from = Reader::new(wire, bytes).map_err(damaged)?;
    if kind != MessageType::CompressedImage {
        return decode_color_image(&Image::read(&mut from).map_err(damaged)?, expected, into);
    }
    decode_compressed_color(&CompressedImage::read(&mut from).map_err(damaged)?, expected, into)
}

/// Decodes the colour image of a message that was read already; as [`decode_color_message`].
///
/// # Errors
/// As [`decode_color_message`].
pub fn decode_color_image(
    image: &Image<'_>,
    expected: Option<ImageSize>,
    into: &mut RgbImage,
) -> Result<(), DecodeError> {
    color::decode(image, expected, into)
}

/// Decodes the compressed colour image of a message that was read already; as [`decode_color_message`].
///
/// # Errors
/// As [`decode_color_message`].
pub fn decode_compressed_color(
    image: &CompressedImage<'_>,
    expected: Option<ImageSize>,
    into: &mut RgbImage,
) -> Result<(), DecodeError> {
    if image.format.contains("compressedDepth") {
        return Err(DecodeError::WrongKind { found: format!("'{}'", image.format), cure: "choose a colour topic" });
    }
    if image.format.starts_with("bayer") && !image.format.contains("bgr8") && !image.format.contains("rgb8") {
        let found = format!("a compressed mosaic of colours ('{}')", image.format);
        return Err(DecodeError::WrongKind { found, cure: "record the topic of colour images" });
    }
    decode_color(image.data, expected, into)
}

/// Decodes the depth image of an `Image` or `CompressedImage` into `into`, whose buffer is reused. Integers have `depth_factor` units per
/// metre, and 65535 is no measurement. Depth in metres is rounded to such units, or to [`METRES_UNITS`] where they would be coarse; what
/// is not in their range is not measured.
///
/// # Errors
/// [`DecodeError`], as for an image file; also an encoding that is not understood.
pub fn decode_depth_message(
    kind: MessageType,
    wire: Wire,
    bytes: &[u8],
    depth_factor: f64,
    expected: Option<ImageSize>,
    into: &mut DepthImage,
) -> Result<(), DecodeError> {
    let mut from = Reader::new(wire, bytes).map_err(damaged)?;
    if kind == MessageType::CompressedImage {
        let image = CompressedImage::read(&mut from).map_err(damaged)?;
        return decode_compressed_depth(&image, depth_factor, expected, into);
    }
    decode_depth_image(&Image::read(&mut from).map_err(damaged)?, depth_factor, expected, into)
}

/// Decodes the depth image of a message that was read already; as [`decode_depth_message`].
///
/// # Errors
/// As [`decode_depth_message`].
pub fn decode_depth_image(
    image: &Image<'_>,
    depth_factor: f64,
    expected: Option<ImageSize>,
    into: &mut DepthImage,
) -> Result<(), DecodeError> {
    depth::decode(image, depth_factor, expected, into)
}

/// Decodes the compressed depth image of a message that was read already; as [`decode_depth_message`].
///
/// # Errors
/// As [`decode_depth_message`].
pub fn decode_compressed_depth(
    image: &CompressedImage<'_>,
    depth_factor: f64,
    expected: Option<ImageSize>,
    into: &mut DepthImage,
) -> Result<(), DecodeError> {
    compressed_depth::decode(image, depth_factor, expected, into)
}

fn damaged(error: WireError) -> DecodeError {
    DecodeError::Damaged(error.to_string())
}

/// Checks the size and returns the rows of an image with `bytes` per pixel.
fn rows<'a>(
    image: &Image<'a>,
    bytes: usize,
    expected: Option<ImageSize>,
    cure: &'static str,
) -> Result<(ImageSize, impl Iterator<Item = &'a [u8]> + use<'a>), DecodeError> {
    let size = ImageSize { width: image.width as usize, height: image.height as usize };
    check_size(size, expected, cure)?;
    let (needed, step) = (size.width * bytes, image.step as usize);
    let has_all = step.checked_mul(size.height.saturating_sub(1)).and_then(|rest| rest.checked_add(needed));
    if size.width == 0 || size.height == 0 || step < needed || has_all.is_none_or(|all| image.data.len() < all) {
        let (step, length) = (image.step, image.data.len());
        let encoding = image.encoding;
        return Err(DecodeError::Damaged(format!(
            "{size} pixels of {encoding} do not fit {length} bytes in steps of {step}"
        )));
    }
    Ok((size, image.data.chunks(step).take(size.height).map(move |row| row.get(..needed).unwrap_or(&[]))))
}

#[cfg(test)]
mod tests;
