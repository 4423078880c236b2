//! Masks as runs of pixels, the uncompressed form of the COCO data set (Lin et al., ECCV 2014; "RLE" of its annotations).

use serde::Serialize;
use yfslam::image::Image;

/// Which pixels of an image show an object.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Runs {
    /// Height and width of the image, px.
    pub size: [usize; 2],
    /// Lengths of runs, column after column from the left, each from the top: pixels beside the object (0 if it shows the first one),
    /// then pixels of it, and so on in turns.
    pub counts: Vec<usize>,
}

impl Runs {
    /// The pixels of `mask` with this value.
    pub fn of(mask: &Image<u8>, value: u8) -> Self {
        let size = [mask.height(), mask.width()];
        let (mut counts, mut inside) = (vec![0], false);
        for x in 0..mask.width() {
            for y in 0..mask.height() {
                if (mask.get(x, y) == Some(&value)) != inside {
                    inside = !inside;
                    counts.push(0);
                }
                if let Some(length) = counts.last_mut() {
                    *length += 1;
                }
            }
        }
        Self { size, counts }
    }

    /// The image with 1 where it shows the object, else 0.
    pub fn mask(&self) -> Image<u8> {
        let [height, width] = self.size;
        let turns = self.counts.iter().zip([0, 1].into_iter().cycle());
        let values = turns.flat_map(|(length, value)| std::iter::repeat_n(value, *length));
        let mut mask = Image::new(width, height);
        for (index, value) in values.take(width * height).enumerate() {
            mask.row_mut(index % height)[index / height] = value;
        }
        mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_go_down_the_columns_and_begin_beside_the_object() {
        let mask = Image::from_vec(4, 3, vec![0, 7, 0, 7, 0, 7, 2, 7, 0, 0, 0, 7]).unwrap();
        assert_eq!(Runs::of(&mask, 7), Runs { size: [3, 4], counts: vec![3, 2, 4, 3] });
        assert_eq!(Runs::of(&Image::from_vec(1, 2, vec![7, 7]).unwrap(), 7).counts, [0, 2]);
        assert_eq!(Runs::of(&mask, 1).counts, [12]);
        assert_eq!(Runs::of(&Image::<u8>::default(), 7), Runs { size: [0, 0], counts: vec![0] });
    }

    #[test]
    fn runs_give_the_mask_back() {
        let values = (0..23 * 17).map(|index: usize| (index * index / 7 % 3) as u8).collect();
        let mask = Image::from_vec(23, 17, values).unwrap();
        for value in 0..4 {
            let back = Runs::of(&mask, value).mask();
            let expected: Vec<u8> = mask.data().iter().map(|found| u8::from(*found == value)).collect();
            assert_eq!(back.data(), expected);
        }
    }
}
