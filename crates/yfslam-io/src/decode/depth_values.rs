//! Depth as floating-point numbers, before they become units of a depth image.

use yfslam::{DepthImage, Image};

use super::{DEPTH_KIND_CURE, DecodeError, ImageSize};

/// The numbers of an image, row by row.
pub struct DepthValues {
    pub size: ImageSize,
    pub values: Vec<f32>,
}

impl DepthValues {
    /// Converts values with `depth_factor` units per metre.
    pub fn into_metres(mut self, depth_factor: f64) -> Result<DepthImage, DecodeError> {
        for value in &mut self.values {
            *value = (f64::from(*value) / depth_factor) as f32;
        }
        let ImageSize { width, height } = self.size;
        DepthImage::from_f32(&self.values, width, height, width)
            .map_err(|error| DecodeError::Damaged(error.to_string()))
    }
}

/// Stores integers as the units of a depth image; those that do not fit 16 bits are an error.
pub fn store_integers(
    values: impl Iterator<Item = Option<u16>>,
    size: ImageSize,
    into: &mut Image<u16>,
) -> Result<(), DecodeError> {
    into.resize(size.width, size.height);
    for (pixel, value) in into.data_mut().iter_mut().zip(values) {
        *pixel = value.ok_or_else(|| DecodeError::WrongKind {
            found: "an array of integers that exceed 16 bits".into(),
            cure: DEPTH_KIND_CURE,
        })?;
    }
    Ok(())
}
