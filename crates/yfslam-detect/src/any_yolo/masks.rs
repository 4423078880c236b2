//! Masks of a network that segments (Bolya et al., YOLACT, ICCV 2019, section 3.2): the mask of an object is a sum of common
//! prototypes, weighted by the coefficients of the object and clipped at its box.
//!
//! In: prototypes, coefficients, boxes. Out: the object and the class of each pixel.

use yfslam::{BoundingBox, Detection, Image};

use super::letterbox::Letterbox;

/// Prototypes `[count, height, width]`, row-major, over the whole network input.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prototypes<'a> {
    pub(super) values: &'a [f32],
    pub(super) shape: [usize; 3],
}

impl Prototypes<'_> {
    /// Marks the pixels of an object within its box in the image of `letterbox`; pixels of earlier objects are kept.
    pub(super) fn draw(
        self,
        coefficients: &[f32],
        bbox: &BoundingBox,
        letterbox: &Letterbox,
        mark: u16,
        objects: &mut Image<u16>,
    ) {
        let [_, height, width] = self.shape;
        let stride = [letterbox.size.1 as f32 / width as f32, letterbox.size.0 as f32 / height as f32];
        let edges = |low: f32, high: f32, side: usize| low.max(0.0).floor() as usize..(high.ceil() as usize).min(side);
        let (rows, columns) =
            (edges(bbox.y_min, bbox.y_max, objects.height()), edges(bbox.x_min, bbox.x_max, objects.width()));
        for row in rows {
            for column in columns.clone() {
                let at = letterbox.to_input([column as f32 + 0.5, row as f32 + 0.5]);
                let inside = self.sum(coefficients, [at[0] / stride[0] - 0.5, at[1] / stride[1] - 0.5]) > 0.0;
                if let Some(pixel) = objects.row_mut(row).get_mut(column).filter(|pixel| inside && **pixel == 0) {
                    *pixel = mark;
                }
            }
        }
    }

    /// Returns the weighted sum at a position, px of the prototypes, bilinear; above 0 the object is probable.
    fn sum(self, coefficients: &[f32], [x, y]: [f32; 2]) -> f32 {
        let [_, height, width] = self.shape;
        let (x, y) = (x.clamp(0.0, width as f32 - 1.0), y.clamp(0.0, height as f32 - 1.0));
        let (left, top) = (x as usize, y as usize);
        let (fx, fy) = (x - left as f32, y - top as f32);
        let (right, bottom) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
        let planes = self.values.chunks_exact(height * width);
        let weighed = coefficients.iter().zip(planes).map(|(coefficient, plane)| {
            let line = |row: usize| plane[row * width + left] * (1.0 - fx) + plane[row * width + right] * fx;
            coefficient * (line(top) * (1.0 - fy) + line(bottom) * fy)
        });
        weighed.sum()
    }
}

/// Converts marks, 1 + the index in `detections`, to 1 + class; 0 for a class that does not fit a mask.
pub(super) fn classes(objects: &Image<u16>, detections: &[Detection]) -> Image<u8> {
    let values: Vec<u8> = std::iter::once(0)
        .chain(detections.iter().map(|object| u8::try_from(object.class + 1).unwrap_or_default()))
        .collect();
    let mut mask = Image::new(objects.width(), objects.height());
    for (pixel, mark) in mask.data_mut().iter_mut().zip(objects.data()) {
        *pixel = values.get(usize::from(*mark)).copied().unwrap_or_default();
    }
    mask
}
