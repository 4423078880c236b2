//! Object detection: the interface between the core, which uses bounding boxes and masks, and a detector.
//!
//! In: colour images. Out: detections, and a segmentation if the detector makes one.

pub(crate) mod detector_worker;
pub(crate) mod roll_compensation;

use crate::image::{Image, RgbImage};
pub(crate) use detector_worker::DetectorOutput;
pub use roll_compensation::RollCompensation;

/// An axis-aligned bounding box in px of the full image. Pixel `(x, y)` is inside if `x_min <= x < x_max` and `y_min <= y < y_max`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoundingBox {
    /// Left edge, px.
    pub x_min: f32,
    /// Top edge, px.
    pub y_min: f32,
    /// Right edge, px.
    pub x_max: f32,
    /// Bottom edge, px.
    pub y_max: f32,
}

impl BoundingBox {
    /// Returns whether a position, px, lies inside.
    pub fn contains(&self, x: f32, y: f32) -> bool {
        x >= self.x_min && x < self.x_max && y >= self.y_min && y < self.y_max
    }

    /// Returns the area, px²; 0 for an inverted box.
    pub fn area(&self) -> f32 {
        (self.x_max - self.x_min).max(0.0) * (self.y_max - self.y_min).max(0.0)
    }

    /// Returns the intersection over union with another box, in [0, 1].
    pub fn iou(&self, other: &Self) -> f32 {
        let inter = BoundingBox {
            x_min: self.x_min.max(other.x_min),
            y_min: self.y_min.max(other.y_min),
            x_max: self.x_max.min(other.x_max),
            y_max: self.y_max.min(other.y_max),
        }
        .area();
        let union = self.area() + other.area() - inter;
        if union > 0.0 { inter / union } else { 0.0 }
    }
}

/// One object in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Index into [`Detector::class_names`].
    pub class: usize,
    /// Confidence in [0, 1].
    pub score: f32,
    /// Bounding box, px.
    pub bbox: BoundingBox,
}

/// The reason why a detector has failed.
#[derive(Debug, thiserror::Error)]
#[error("object detection failed: {0}")]
pub struct DetectorError(pub String);

/// A detector of objects in colour images.
pub trait Detector: Send {
    /// Returns the names of the classes, in the order of [`Detection::class`].
    fn class_names(&self) -> &[String];

    /// Replaces the contents of `out` by the detections in `image`, best score first.
    ///
    /// # Errors
    /// If the image cannot be processed, for example because it is empty.
    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError>;

    /// Returns the segmentation of the last image, as large as the image: 0 where there is no object, else 1 + the class (of the
    /// first 255). `None` from detectors that give bounding boxes only.
    fn mask(&self) -> Option<&Image<u8>> {
        None
    }
}

impl<D: Detector + ?Sized> Detector for Box<D> {
    fn class_names(&self) -> &[String] {
        (**self).class_names()
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        (**self).detect(image, out)
    }

    fn mask(&self) -> Option<&Image<u8>> {
        (**self).mask()
    }
}

/// Returns the mask of a [`Detector`] with only these classes; all other pixels are 0.
pub fn mask_of_classes(mask: &Image<u8>, classes: &[usize]) -> Image<u8> {
    let is_kept: [bool; 256] = std::array::from_fn(|value| value > 0 && classes.contains(&(value - 1)));
    let mut kept = mask.clone();
    kept.data_mut().iter_mut().filter(|value| !is_kept[usize::from(**value)]).for_each(|value| *value = 0);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_keeps_the_requested_classes() {
        let mask = Image::from_vec(3, 2, vec![0, 1, 2, 3, 2, 255]).unwrap();
        assert_eq!(mask_of_classes(&mask, &[1, 254, 700]).data(), [0, 0, 2, 0, 2, 255]);
    }
}
