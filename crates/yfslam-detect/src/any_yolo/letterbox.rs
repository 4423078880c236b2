//! Converts an image to the network input: as large as possible without distortion, in the middle of a grey input.

use fearless_simd::Level;
use yfslam::{BoundingBox, RgbImage};

use crate::yolo::preprocess::Stretch;

/// Grey level of the margins, as in the training of these networks.
const GREY: f32 = 114.0 / 255.0;

/// The network input, and the place of the image in it.
#[derive(Debug)]
pub(super) struct Letterbox {
    /// Height and width, px.
    pub(super) size: (usize, usize),
    /// Planes red, green, blue, row-major, in [0, 1].
    pub(super) input: Vec<f32>,
    stretch: Stretch,
    /// The image alone, as three planes.
    inner: Vec<f32>,
    /// Left and top edge of the image in the input, px.
    offset: [usize; 2],
    /// Pixels of the input per pixel of the image.
    scale: [f32; 2],
}

impl Letterbox {
    pub(super) fn new(height: usize, width: usize) -> Self {
        let input = vec![GREY; 3 * height * width];
        let (inner, stretch) = (Vec::new(), Stretch::default());
        Self { size: (height, width), input, stretch, inner, offset: [0; 2], scale: [1.0; 2] }
    }

    /// Puts a non-empty image into the input.
    pub(super) fn put(&mut self, level: Level, image: &RgbImage) {
        let (height, width) = self.size;
        let fit = (width as f64 / image.width() as f64).min(height as f64 / image.height() as f64);
        let side = |length: usize, most: usize| ((length as f64 * fit).round() as usize).clamp(1, most);
        let (inner_width, inner_height) = (side(image.width(), width), side(image.height(), height));
        self.scale = [inner_width as f32 / image.width() as f32, inner_height as f32 / image.height() as f32];
        self.offset = [(width - inner_width) / 2, (height - inner_height) / 2];
        self.inner.resize(3 * inner_width * inner_height, 0.0);
        let (red, rest) = self.inner.split_at_mut(inner_width * inner_height);
        let (green, blue) = rest.split_at_mut(inner_width * inner_height);
        self.stretch.run(level, image, (inner_height, inner_width), [blue, green, red]);
        self.input.fill(GREY);
        let [left, top] = self.offset;
        let planes =
            self.input.chunks_exact_mut(width * height).zip(self.inner.chunks_exact(inner_width * inner_height));
        for (plane, inner) in planes {
            for (row, inner) in plane.chunks_exact_mut(width).skip(top).zip(inner.chunks_exact(inner_width)) {
                row[left..left + inner_width].copy_from_slice(inner);
            }
        }
    }

    /// Converts a position in the last image to one in the input, px.
    pub(super) fn to_input(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [x * self.scale[0] + self.offset[0] as f32, y * self.scale[1] + self.offset[1] as f32]
    }

    /// Converts a box in the input to one in the last image, whose sides are given, and clips it at the edges.
    pub(super) fn to_image(&self, bbox: BoundingBox, [width, height]: [usize; 2]) -> BoundingBox {
        let x = |x: f32| ((x - self.offset[0] as f32) / self.scale[0]).clamp(0.0, width as f32);
        let y = |y: f32| ((y - self.offset[1] as f32) / self.scale[1]).clamp(0.0, height as f32);
        BoundingBox { x_min: x(bbox.x_min), y_min: y(bbox.y_min), x_max: x(bbox.x_max), y_max: y(bbox.y_max) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_is_centred_without_distortion_on_grey_and_boxes_are_converted_back() {
        for (width, height, offset, inside) in
            [(80, 40, [0, 16], 64 * 32), (40, 80, [16, 0], 32 * 64), (10, 10, [0, 0], 64 * 64)]
        {
            let mut letterbox = Letterbox::new(64, 64);
            letterbox
                .put(Level::new(), &RgbImage::from_vec(width, height, vec![[255, 0, 51]; width * height]).unwrap());
            assert_eq!(letterbox.offset, offset);
            for (plane, value) in letterbox.input.chunks_exact(64 * 64).zip([1.0, 0.0, 0.2]) {
                assert_eq!(
                    plane.iter().filter(|found| (**found - value).abs() < 1e-6).count(),
                    inside,
                    "{width}×{height}"
                );
                assert_eq!(plane.iter().filter(|found| **found == GREY).count(), 64 * 64 - inside);
            }
            let [left, top] = offset.map(|offset| offset as f32);
            let whole = BoundingBox { x_min: left - 3.0, y_min: top, x_max: 64.0 - left, y_max: 64.0 - top };
            let expected = BoundingBox { x_min: 0.0, y_min: 0.0, x_max: width as f32, y_max: height as f32 };
            assert_eq!(letterbox.to_image(whole, [width, height]), expected);
        }
    }
}
