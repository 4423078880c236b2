//! Objects of a network told apart, whatever their classes.
//!
//! In: a network. Out: a detector whose mask shows objects.

use yfslam::image::{Image, RgbImage};
use yfslam::{Detection, Detector, DetectorError};
use yfslam_detect::Network;

/// A network each of whose objects is a class of its own, called as the object's class is: the mask shows one object from another.
/// The first 255 are told apart, and in one image alone.
pub struct Apart {
    network: Box<dyn Network>,
    names: Vec<String>,
    mask: Option<Image<u8>>,
}

impl Apart {
    pub fn new(network: Box<dyn Network>) -> Self {
        Self { network, names: Vec::new(), mask: None }
    }

    /// Names of the classes that the network knows.
    pub fn known(&self) -> &[String] {
        self.network.class_names()
    }
}

impl Detector for Apart {
    /// Those of the objects in the image seen last.
    fn class_names(&self) -> &[String] {
        &self.names
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        self.network.detect(image, out)?;
        let known = self.network.class_names();
        self.names.clear();
        for (index, found) in out.iter_mut().enumerate() {
            self.names.push(known.get(found.class).cloned().unwrap_or_default());
            found.class = index;
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
    use yfslam::{BoundingBox, Upright};

    use super::*;

    /// Finds two dogs, one above the other.
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
    fn objects_of_one_class_are_told_apart_even_in_a_picture_that_is_turned_for_them() {
        for (roll, above) in [(0, 1), (180, 2)] {
            let mut apart = Apart::new(Box::new(Dogs(vec!["cat".into(), "dog".into()], Image::default())));
            let (mut upright, mut found) = (Upright::default(), Vec::new());
            upright.detect(&mut apart, &RgbImage::new(40, 30), roll, &mut found).unwrap();
            assert_eq!(apart.class_names(), ["dog", "dog"]);
            assert_eq!(found.iter().map(|found| found.class).collect::<Vec<_>>(), [0, 1]);
            let mask = upright.mask(&apart).unwrap();
            assert_eq!([mask.get(20, 5), mask.get(20, 25)], [Some(&above), Some(&(3 - above))], "{roll}");
        }
    }
}
