//! Grey images with padding at the end of each row.
//!
//! In: a grey image. Out: a copy whose rows end in padding, so that kernels process whole vectors only.

use super::GrayImage;

/// Width of the widest vector of all instruction sets, bytes; also the granularity of the stride.
pub(crate) const LANES: usize = 64;

/// Bytes that a kernel may access behind the last pixel of a row: one vector, shifted by the radius of a neighbourhood.
const PADDING: usize = LANES + 8;

/// An 8-bit image with padded rows; pixels in the padding are unspecified.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plane {
    width: usize,
    height: usize,
    stride: usize,
    data: Vec<u8>,
}

impl Plane {
    /// Changes the size and keeps the allocation if it is large enough; pixel values are unspecified afterwards.
    pub(crate) fn resize(&mut self, width: usize, height: usize) {
        self.width = width;
        self.height = height;
        self.stride = (width + PADDING).next_multiple_of(LANES);
        self.data.resize(self.stride * height, 0);
    }

    /// Copies `image` and takes over its size.
    pub(crate) fn copy_from(&mut self, image: &GrayImage) {
        self.resize(image.width(), image.height());
        for (row, source) in
            self.data.chunks_exact_mut(self.stride).zip(image.data().chunks_exact(image.width().max(1)))
        {
            row[..source.len()].copy_from_slice(source);
        }
    }

    /// Returns the number of pixels in a row without its padding.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// Returns the distance between rows in `data`, px.
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// Returns all rows with their padding.
    pub(crate) fn data(&self) -> &[u8] {
        &self.data
    }

    /// Returns row `y` with its padding.
    pub(crate) fn row(&self, y: usize) -> &[u8] {
        &self.data[y * self.stride..(y + 1) * self.stride]
    }

    /// Returns row `y` with its padding, for writing.
    pub(crate) fn row_mut(&mut self, y: usize) -> &mut [u8] {
        &mut self.data[y * self.stride..(y + 1) * self.stride]
    }
}

#[cfg(test)]
impl From<&GrayImage> for Plane {
    fn from(image: &GrayImage) -> Self {
        let mut plane = Self::default();
        plane.copy_from(image);
        plane
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Generates images with sides in `sides`, from uniform to noisy.
    pub(crate) fn images(sides: std::ops::Range<usize>) -> impl Strategy<Value = GrayImage> {
        (sides.clone(), sides, 0u8..=255, 0u8..=255).prop_flat_map(|(width, height, a, b)| {
            proptest::collection::vec(a.min(b)..=a.max(b), width * height)
                .prop_map(move |data| GrayImage::from_vec(width, height, data).unwrap())
        })
    }

    proptest! {
        #[test]
        fn a_copy_has_the_same_rows(image in images(0..90)) {
            let plane = Plane::from(&image);
            for y in 0..image.height() {
                prop_assert_eq!(&plane.row(y)[..image.width()], image.row(y));
            }
        }
    }
}
