//! Smaller images.

use yfslam::RgbImage;

/// Wider images are made smaller: the report shows none of them larger.
const WIDEST_PX: usize = 480;

/// Returns the image at the width of the report; each pixel is the mean of the area that it covers.
pub fn shrink(image: RgbImage) -> RgbImage {
    if image.width() <= WIDEST_PX {
        return image;
    }
    let scale = image.width() as f64 / WIDEST_PX as f64;
    let height = ((image.height() as f64 / scale).round() as usize).max(1);
    let mut small = RgbImage::new(WIDEST_PX, height);
    for y in 0..height {
        for (x, pixel) in small.row_mut(y).iter_mut().enumerate() {
            let (mut sum, mut area) = ([0.0; 3], 0.0);
            for (row, high) in cover(y, scale) {
                for (column, wide) in cover(x, scale) {
                    let Some(color) = image.get(column, row) else { continue };
                    sum.iter_mut().zip(color).for_each(|(sum, value)| *sum += high * wide * f64::from(*value));
                    area += high * wide;
                }
            }
            *pixel = sum.map(|sum| (sum / f64::max(area, 1e-9)).round() as u8);
        }
    }
    small
}

/// Returns the pixels that a pixel of the smaller image covers along one side, each with the covered share.
fn cover(index: usize, scale: f64) -> impl Iterator<Item = (usize, f64)> {
    let (from, to) = (index as f64 * scale, (index + 1) as f64 * scale);
    (from as usize..to.ceil() as usize).map(move |i| (i, (to.min(i as f64 + 1.0) - from.max(i as f64)).max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_of_a_smaller_image_is_the_mean_of_what_it_covers() {
        let mut image = RgbImage::new(1200, 6);
        image.data_mut().iter_mut().step_by(2).for_each(|pixel| *pixel = [90; 3]);
        let small = shrink(image);
        assert_eq!((small.width(), small.height()), (480, 2));
        // 2.5 pixels each, 1.5 or 1 of them light.
        assert_eq!(small.row(0)[..4], [[54; 3], [54; 3], [36; 3], [36; 3]]);
        assert_eq!(shrink(RgbImage::new(480, 7)).height(), 7);
    }
}
