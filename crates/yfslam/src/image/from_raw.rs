//! Images from the buffers of other libraries.
//!
//! In: rows of pixels with a stride, as cameras, ROS and OpenCV deliver them. Out: packed images, or an error that names the sizes.

use super::{DepthImage, Image, RgbImage};

/// Unit of depth images converted from floating-point depth, m: finer than the noise of any sensor, with a range of 32 m.
const FLOAT_UNIT_M: f32 = 0.0005;

/// Reason why a buffer is not an image of the given size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// A row is longer than the stride.
    #[error(
        "the stride is {stride}, but a row of {width} pixels has {needed} elements: pass the number of elements from one row to the next"
    )]
    Stride {
        /// Elements from one row to the next.
        stride: usize,
        /// Pixels per row.
        width: usize,
        /// Elements that a row has.
        needed: usize,
    },
    /// The buffer is too short.
    #[error(
        "the buffer has {found} elements, but {width}×{height} pixels with this stride need {needed}: check the size and the stride"
    )]
    Length {
        /// Elements of the buffer.
        found: usize,
        /// Elements needed.
        needed: usize,
        /// Pixels per row.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The depth unit is not a positive length; the value is in µm.
    #[error("the depth unit is {0} µm, but it must be positive: pass metres per unit, such as 0.001 for millimetres")]
    Unit(i64),
}

impl RgbImage {
    /// Copies an 8-bit image with channels red, green, blue; `stride` is the number of bytes from one row to the next.
    ///
    /// # Errors
    /// If the stride is shorter than a row, or the buffer is shorter than the image.
    pub fn from_rgb8(data: &[u8], width: usize, height: usize, stride: usize) -> Result<Self, ImageError> {
        packed(data, [width, height, stride], |[r, g, b]: &[u8; 3]| [*r, *g, *b])
    }

    /// Copies an 8-bit image with channels blue, green, red (OpenCV); `stride` is the number of bytes from one row to the next.
    ///
    /// # Errors
    /// If the stride is shorter than a row, or the buffer is shorter than the image.
    pub fn from_bgr8(data: &[u8], width: usize, height: usize, stride: usize) -> Result<Self, ImageError> {
        packed(data, [width, height, stride], |[b, g, r]: &[u8; 3]| [*r, *g, *b])
    }

    /// Copies an 8-bit grey image into all three channels; `stride` is the number of bytes from one row to the next.
    ///
    /// # Errors
    /// If the stride is shorter than a row, or the buffer is shorter than the image.
    pub fn from_gray8(data: &[u8], width: usize, height: usize, stride: usize) -> Result<Self, ImageError> {
        packed(data, [width, height, stride], |[gray]: &[u8; 1]| [*gray; 3])
    }
}

impl DepthImage {
    /// Copies a 16-bit depth image; 0 means that nothing was measured. `stride` is the number of values from one row to the next.
    /// `metres_per_unit` is the unit, such as 0.001 for millimetres and 1/5000 for TUM recordings.
    ///
    /// # Errors
    /// If the stride is shorter than a row, the buffer is shorter than the image, or the unit is not positive and finite.
    pub fn from_u16(
        data: &[u16],
        width: usize,
        height: usize,
        stride: usize,
        metres_per_unit: f32,
    ) -> Result<Self, ImageError> {
        if !(metres_per_unit > 0.0 && metres_per_unit.is_finite()) {
            return Err(ImageError::Unit((f64::from(metres_per_unit) * 1e6) as i64));
        }
        let raw = packed(data, [width, height, stride], |[depth]: &[u16; 1]| *depth)?;
        Ok(Self { raw, metres_per_unit })
    }

    /// Copies a depth image in metres. NaN, infinite, zero and negative values and depths beyond 32 m become "not measured". Depths are
    /// rounded to half a millimetre. `stride` is the number of values from one row to the next.
    ///
    /// # Errors
    /// If the stride is shorter than a row, or the buffer is shorter than the image.
    pub fn from_f32(data: &[f32], width: usize, height: usize, stride: usize) -> Result<Self, ImageError> {
        let to_units = |[depth_m]: &[f32; 1]| {
            let steps = depth_m / FLOAT_UNIT_M + 0.5;
            if steps >= 1.0 && steps <= f32::from(u16::MAX) { steps as u16 } else { 0 }
        };
        Ok(Self { raw: packed(data, [width, height, stride], to_units)?, metres_per_unit: FLOAT_UNIT_M })
    }
}

/// Copies pixels of `N` elements each and leaves out the padding at the ends of the rows.
fn packed<S, T: Copy + Default, const N: usize>(
    data: &[S],
    [width, height, stride]: [usize; 3],
    pixel: impl Fn(&[S; N]) -> T,
) -> Result<Image<T>, ImageError> {
    let needed = width.saturating_mul(N);
    if stride < needed {
        return Err(ImageError::Stride { stride, width, needed });
    }
    // The buffer may end without the padding of the last row.
    let length = height.checked_sub(1).map_or(0, |rows| rows.saturating_mul(stride).saturating_add(needed));
    if data.len() < length {
        return Err(ImageError::Length { found: data.len(), needed: length, width, height });
    }
    let rows = data.chunks(stride.max(1)).take(height);
    let pixels: Vec<T> = rows.flat_map(|row| row[..needed].as_chunks::<N>().0).map(pixel).collect();
    let image = Image::from_vec(width, height, pixels);
    image.ok_or(ImageError::Length { found: data.len(), needed: length, width, height })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn padding_is_skipped_and_channels_are_ordered() {
        let bytes: Vec<u8> = (0..14).collect();
        let rgb = RgbImage::from_rgb8(&bytes, 2, 2, 8).unwrap();
        assert_eq!(rgb.data(), [[0, 1, 2], [3, 4, 5], [8, 9, 10], [11, 12, 13]]);
        let bgr = RgbImage::from_bgr8(&bytes, 2, 2, 8).unwrap();
        assert_eq!(bgr.data()[3], [13, 12, 11]);
        let gray = RgbImage::from_gray8(&bytes, 3, 2, 10).unwrap();
        assert_eq!(gray.data()[3], [10; 3]);
        assert_eq!(RgbImage::from_rgb8(&[], 0, 0, 0).unwrap().data().len(), 0);
    }

    #[test]
    fn depth_is_kept_in_its_unit_or_rounded_from_metres() {
        let depth = DepthImage::from_u16(&[1000, 0, 2, 3], 1, 2, 3, 0.001).unwrap();
        assert_eq!((depth.metres(0, 0), depth.metres(0, 1)), (Some(1.0), Some(0.003)));
        let depth = DepthImage::from_f32(&[1.0, f32::NAN, -1.0, 40.0, f32::INFINITY, 0.0], 3, 2, 3).unwrap();
        assert_eq!(depth.raw.data(), [2000, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn wrong_buffers_are_refused_with_their_sizes() {
        let short = RgbImage::from_rgb8(&[0; 11], 2, 2, 6).unwrap_err();
        assert_eq!(short, ImageError::Length { found: 11, needed: 12, width: 2, height: 2 });
        let stride = RgbImage::from_rgb8(&[0; 12], 2, 2, 5).unwrap_err();
        assert_eq!(stride, ImageError::Stride { stride: 5, width: 2, needed: 6 });
        assert!(RgbImage::from_gray8(&[0; 9], usize::MAX, usize::MAX, usize::MAX).is_err());
        assert!(DepthImage::from_u16(&[0; 4], 2, 2, 2, 0.0).is_err());
        assert!(DepthImage::from_u16(&[0; 4], 2, 2, 2, f32::NAN).is_err());
    }
}
