//! Pixels of colour images as `sensor_msgs/Image` stores them, by the names of `sensor_msgs/image_encodings` and of OpenCV.

use yfslam::RgbImage;

use super::bayer::{Mosaic, demosaic};
use super::rows;
use super::types::Image;
use crate::decode::{DecodeError, ImageSize};

const SIZE_CURE: &str = "use the camera of this topic (its camera_info, or --camera)";
const KIND_CURE: &str = "the colour encodings are rgb8, bgr8, rgba8, bgra8, mono8, mono16, 8UC1, 8UC3, 8UC4, 16UC1, yuv422 (uyvy), \
                         yuv422_yuy2 (yuyv) and bayer_rggb8 and its like";

/// Decodes a colour image into `into`.
pub fn decode(image: &Image<'_>, expected: Option<ImageSize>, into: &mut RgbImage) -> Result<(), DecodeError> {
    match image.encoding {
        "rgb8" => rgb(image, expected, into),
        // OpenCV's names do not say the order of the colours; its images are BGR.
        "bgr8" | "8UC3" => each::<3>(image, expected, into, |[b, g, r]| [r, g, b]),
        "rgba8" => each::<4>(image, expected, into, |[r, g, b, _]| [r, g, b]),
        "bgra8" | "8UC4" => each::<4>(image, expected, into, |[b, g, r, _]| [r, g, b]),
        "mono8" | "8UC1" => each::<1>(image, expected, into, |[grey]| [grey; 3]),
        "mono16" | "16UC1" if image.is_bigendian => each::<2>(image, expected, into, |[high, _]| [high; 3]),
        "mono16" | "16UC1" => each::<2>(image, expected, into, |[_, high]| [high; 3]),
        "yuv422" | "uyvy" | "UYVY" => pairs(image, expected, into, |[u, a, v, b]| [a, b, u, v]),
        "yuv422_yuy2" | "yuyv" | "YUYV" | "yuy2" => pairs(image, expected, into, |[a, u, b, v]| [a, b, u, v]),
        other => match Mosaic::of(other) {
            Some(mosaic) => {
                let (size, rows) = rows(image, 1, expected, SIZE_CURE)?;
                into.resize(size.width, size.height);
                demosaic(mosaic, &rows.collect::<Vec<_>>(), into);
                Ok(())
            }
            None => Err(DecodeError::WrongKind { found: format!("an image in encoding '{other}'"), cure: KIND_CURE }),
        },
    }
}

fn rgb(image: &Image<'_>, expected: Option<ImageSize>, into: &mut RgbImage) -> Result<(), DecodeError> {
    let (size, rows) = rows(image, 3, expected, SIZE_CURE)?;
    into.resize(size.width, size.height);
    for (to, from) in into.data_mut().as_flattened_mut().chunks_exact_mut(3 * size.width).zip(rows) {
        to.copy_from_slice(from);
    }
    Ok(())
}

fn each<const N: usize>(
    image: &Image<'_>,
    expected: Option<ImageSize>,
    into: &mut RgbImage,
    convert: impl Fn([u8; N]) -> [u8; 3],
) -> Result<(), DecodeError> {
    let (size, rows) = rows(image, N, expected, SIZE_CURE)?;
    into.resize(size.width, size.height);
    for (to, from) in into.data_mut().chunks_exact_mut(size.width).zip(rows) {
        let (pixels, _) = from.as_chunks::<N>();
        to.iter_mut().zip(pixels).for_each(|(to, &from)| *to = convert(from));
    }
    Ok(())
}

/// Converts pairs of pixels that share their two colour differences; `order` gives the two brightnesses, then U and V.
fn pairs(
    image: &Image<'_>,
    expected: Option<ImageSize>,
    into: &mut RgbImage,
    order: impl Fn([u8; 4]) -> [u8; 4],
) -> Result<(), DecodeError> {
    if image.width % 2 == 1 {
        return Err(DecodeError::Damaged(format!("{} has an odd width of {} pixels", image.encoding, image.width)));
    }
    let (size, rows) = rows(image, 2, expected, SIZE_CURE)?;
    into.resize(size.width, size.height);
    for (to, from) in into.data_mut().chunks_exact_mut(size.width).zip(rows) {
        let ((to, _), (from, _)) = (to.as_chunks_mut::<2>(), from.as_chunks::<4>());
        for (to, &from) in to.iter_mut().zip(from) {
            let [a, b, u, v] = order(from);
            *to = [yuv_to_rgb(a, u, v), yuv_to_rgb(b, u, v)];
        }
    }
    Ok(())
}

/// Converts from the limited range of ITU-R BT.601, which cameras deliver, with 20 bits of fraction.
fn yuv_to_rgb(y: u8, u: u8, v: u8) -> [u8; 3] {
    let y = (i32::from(y) - 16).max(0) * 1_220_542;
    let (u, v) = (i32::from(u) - 128, i32::from(v) - 128);
    [1_673_527 * v, -409_993 * u - 852_492 * v, 2_116_026 * u]
        .map(|difference| ((y + difference + (1 << 19)) >> 20).clamp(0, 255) as u8)
}
