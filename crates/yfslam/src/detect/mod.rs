//! The door to object detection: the core knows boxes, not networks.

pub(crate) mod detector_worker;
pub(crate) mod roll_compensation;

use crate::image::{Image, RgbImage};
pub(crate) use detector_worker::DetectorOutput;
pub use roll_compensation::RollCompensation;

/// An axis-aligned box in pixels of the full image; pixel `(x, y)` is inside if `x_min <= x < x_max`, y alike.
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
    /// Whether the pixel position lies inside.
    pub fn contains(&self, x: f32, y: f32) -> bool {
        x >= self.x_min && x < self.x_max && y >= self.y_min && y < self.y_max
    }

    /// Area in square pixels, 0 for an inverted box.
    pub fn area(&self) -> f32 {
        (self.x_max - self.x_min).max(0.0) * (self.y_max - self.y_min).max(0.0)
    }

    /// Intersection over union with another box, in [0, 1].
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

/// One object found in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Index into [`Detector::class_names`].
    pub class: usize,
    /// Confidence in [0, 1].
    pub score: f32,
    /// Where it is.
    pub bbox: BoundingBox,
}

/// Why a detector could not do its work.
#[derive(Debug, thiserror::Error)]
#[error("object detection failed: {0}")]
pub struct DetectorError(pub String);

/// Finds objects in a colour image.
pub trait Detector: Send {
    /// Names of the classes, in the order of [`Detection::class`].
    fn class_names(&self) -> &[String];

    /// Replaces the contents of `out` by the objects found in `image`, best score first.
    ///
    /// # Errors
    /// If the image cannot be processed, for example because it is empty.
    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError>;

    /// What each pixel of the image seen last shows: 0 where nothing was found, else 1 + its class (of the first 255). `None` from
    /// networks that find boxes alone.
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

/// The pixels of a [`Detector::mask`] that show one of these classes; the others become 0.
pub fn mask_of_classes(mask: &Image<u8>, classes: &[usize]) -> Image<u8> {
    let keeps: [bool; 256] = std::array::from_fn(|value| value > 0 && classes.contains(&(value - 1)));
    let mut kept = mask.clone();
    kept.data_mut().iter_mut().filter(|value| !keeps[usize::from(**value)]).for_each(|value| *value = 0);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_keeps_the_classes_that_are_asked_for() {
        let mask = Image::from_vec(3, 2, vec![0, 1, 2, 3, 2, 255]).unwrap();
        assert_eq!(mask_of_classes(&mask, &[1, 254, 700]).data(), [0, 0, 2, 0, 2, 255]);
    }
}
