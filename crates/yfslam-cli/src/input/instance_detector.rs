//! Instance segmentation: objects of the same class are kept apart.
//!
//! In: a network. Out: a detector whose mask shows instances.

use yfslam::{Detection, Detector, DetectorError, Image, RgbImage};
use yfslam_detect::Network;

/// A network whose detections have a class number for each object, under the name of the object's class. Its mask holds these numbers,
/// so it shows instances; it is limited to 255 objects in an image, and the numbers change from image to image.
pub struct InstanceDetector {
    network: Box<dyn Network>,
    names: Vec<String>,
    mask: Option<Image<u8>>,
}

impl InstanceDetector {
    pub fn new(network: Box<dyn Network>) -> Self {
        Self { network, names: Vec::new(), mask: None }
    }

    /// Returns the names of the network's classes.
    pub fn network_classes(&self) -> &[String] {
        self.network.class_names()
    }
}

impl Detector for InstanceDetector {
    /// Returns the class name of each object in the last image.
    fn class_names(&self) -> &[String] {
        &self.names
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        self.network.detect(image, out)?;
        let known = self.network.class_names();
        self.names.clear();
        for (index, detection) in out.iter_mut().enumerate() {
            self.names.push(known.get(detection.class).cloned().unwrap_or_default());
            detection.class = index;
        }
        self.mask = self.network.objects().map(|objects| {
            let mut mask = Image::new(objects.width(), objects.height());
            for (pixel, object) in mask.data_mut().iter_mut().zip(objects.data()) {
                *pixel = u8::try_from(*object).unwrap_or_default();
            }
            mask
        });
        Ok(())
    }

    fn mask(&self) -> Option<&Image<u8>> {
        self.mask.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use yfslam::{BoundingBox, RollCompensation};

    use super::*;

    /// Detects two dogs, one above the other.
    struct Dogs(Vec<String>, Image<u16>);

    impl Detector for Dogs {
        fn class_names(&self) -> &[String] {
            &self.0
        }

        fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
            let (width, height) = (image.width() as f32, image.height() as f32);
            let dog = |y_min, y_max| Detection {
                class: 1,
                score: 0.5,
                bbox: BoundingBox { x_min: 0.0, y_min, x_max: width, y_max },
            };
            *out = vec![dog(0.0, height / 2.0), dog(height / 2.0, height)];
            let number = |index| 1 + u16::from(index >= image.data().len() / 2);
            self.1 = Image::from_vec(image.width(), image.height(), (0..image.data().len()).map(number).collect())
                .unwrap_or_default();
            Ok(())
        }
    }

    impl Network for Dogs {
        fn objects(&self) -> Option<&Image<u16>> {
            Some(&self.1)
        }
    }

    #[test]
    fn objects_of_one_class_are_separate_instances_also_in_an_image_with_roll_compensation() {
        for (roll, above) in [(0, 1), (180, 2)] {
            let mut instances =
                InstanceDetector::new(Box::new(Dogs(vec!["cat".into(), "dog".into()], Image::default())));
            let (mut upright, mut found) = (RollCompensation::default(), Vec::new());
            upright.detect(&mut instances, &RgbImage::new(40, 30), roll, &mut found).unwrap();
            assert_eq!(instances.class_names(), ["dog", "dog"]);
            assert_eq!(found.iter().map(|detection| detection.class).collect::<Vec<_>>(), [0, 1]);
            let mask = upright.mask(&instances).unwrap();
            assert_eq!([mask.get(20, 5), mask.get(20, 25)], [Some(&above), Some(&(3 - above))], "{roll}");
        }
    }
}
