//! Run-length encoding of masks, in the uncompressed form of the COCO data set (Lin et al., ECCV 2014).

use serde::Serialize;
use yfslam::Image;

/// A mask as lengths of runs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Rle {
    /// Height and width of the image, px.
    pub size: [usize; 2],
    /// Lengths of runs, column by column from the left, each column from the top: first pixels outside the object (0 if the first pixel
    /// belongs to it), then pixels of the object, and so on alternately.
    pub counts: Vec<usize>,
}

impl Rle {
    /// Encodes the pixels of `mask` that have this value.
    pub fn encode(mask: &Image<u8>, value: u8) -> Self {
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

    /// Returns the mask: 1 for pixels of the object, else 0.
    pub fn decode(&self) -> Image<u8> {
        let [height, width] = self.size;
        let runs = self.counts.iter().zip([0, 1].into_iter().cycle());
        let values = runs.flat_map(|(length, value)| std::iter::repeat_n(value, *length));
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
    fn runs_go_down_the_columns_and_begin_outside_the_object() {
        let mask = Image::from_vec(4, 3, vec![0, 7, 0, 7, 0, 7, 2, 7, 0, 0, 0, 7]).unwrap();
        assert_eq!(Rle::encode(&mask, 7), Rle { size: [3, 4], counts: vec![3, 2, 4, 3] });
        assert_eq!(Rle::encode(&Image::from_vec(1, 2, vec![7, 7]).unwrap(), 7).counts, [0, 2]);
        assert_eq!(Rle::encode(&mask, 1).counts, [12]);
        assert_eq!(Rle::encode(&Image::<u8>::default(), 7), Rle { size: [0, 0], counts: vec![0] });
    }

    #[test]
    fn decoding_returns_the_encoded_mask() {
        let values = (0..23 * 17).map(|index: usize| (index * index / 7 % 3) as u8).collect();
        let mask = Image::from_vec(23, 17, values).unwrap();
        for value in 0..4 {
            let back = Rle::encode(&mask, value).decode();
            let expected: Vec<u8> = mask.data().iter().map(|v| u8::from(*v == value)).collect();
            assert_eq!(back.data(), expected);
        }
    }
}
