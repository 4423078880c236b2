//! Converts an image to the network input: bilinear stretch (no letterbox) with half-pixel centres, planes blue, green, red in [0,
//! 1].
//!
//! Definition: output column x samples the input at (x + ½) · width_in / width_out − ½, clamped to the outermost pixel centres, and
//! rows likewise; all in f32 without rounding to 8 bits. This is the result of OpenCV's `resize` with `INTER_LINEAR` on a float
//! image.

use fearless_simd::{Level, dispatch};
use yfslam::RgbImage;

/// The sampling positions of the last image size.
#[derive(Debug, Default)]
pub(crate) struct Stretch {
    sizes: (usize, usize),
    columns: Vec<Sample>,
    /// A row of the input, interpolated between two rows, with its last pixel repeated.
    line: Vec<[f32; 3]>,
}

/// Between pixel `index` and the next one, at `fraction` of the way.
#[derive(Clone, Copy, Debug)]
struct Sample {
    index: usize,
    fraction: f32,
}

fn sample(position: usize, from: usize, to: usize) -> Sample {
    let source = (position as f64 + 0.5) * from as f64 / to as f64 - 0.5;
    let clamped = source.clamp(0.0, (from - 1) as f64);
    Sample { index: clamped as usize, fraction: clamped.fract() as f32 }
}

impl Stretch {
    /// Fills `planes` (blue, green, red; each `height × width`) from a non-empty image.
    pub(crate) fn run(
        &mut self,
        level: Level,
        image: &RgbImage,
        (height, width): (usize, usize),
        [blue, green, red]: [&mut [f32]; 3],
    ) {
        if self.sizes != (image.width(), width) {
            self.sizes = (image.width(), width);
            self.columns = (0..width).map(|x| sample(x, image.width(), width)).collect();
            self.line = vec![[0.0; 3]; image.width() + 1];
        }
        let rows = blue.chunks_exact_mut(width).zip(green.chunks_exact_mut(width)).zip(red.chunks_exact_mut(width));
        for (y, ((blue, green), red)) in rows.enumerate() {
            let Sample { index, fraction } = sample(y, image.height(), height);
            let (upper, lower) = (image.row(index), image.row((index + 1).min(image.height() - 1)));
            let line = self.line[..image.width()].as_flattened_mut();
            dispatch!(level, _simd => blend(upper.as_flattened(), lower.as_flattened(), fraction, line));
            self.line[image.width()] = self.line[image.width() - 1];
            for (((blue, green), red), Sample { index, fraction }) in
                blue.iter_mut().zip(green).zip(red).zip(&self.columns)
            {
                let [left, right] = [self.line[*index], self.line[index + 1]];
                let mix = |channel: usize| left[channel] + (right[channel] - left[channel]) * fraction;
                (*red, *green, *blue) = (mix(0), mix(1), mix(2));
            }
        }
    }
}

/// Computes `line` = (upper · (1 − fraction) + lower · fraction) / 255.
#[inline(always)]
fn blend(upper: &[u8], lower: &[u8], fraction: f32, line: &mut [f32]) {
    for ((value, upper), lower) in line.iter_mut().zip(upper).zip(lower) {
        let (upper, lower) = (f32::from(*upper), f32::from(*lower));
        *value = (upper + (lower - upper) * fraction) * (1.0 / 255.0);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn stretch(image: &RgbImage, size: (usize, usize)) -> [Vec<f32>; 3] {
        stretch_at(Level::new(), image, size)
    }

    fn stretch_at(level: Level, image: &RgbImage, size: (usize, usize)) -> [Vec<f32>; 3] {
        let mut planes = [0; 3].map(|_| vec![0.0; size.0 * size.1]);
        Stretch::default().run(level, image, size, planes.each_mut().map(|plane| &mut plane[..]));
        planes
    }

    #[test]
    fn an_image_of_the_right_size_is_only_scaled_and_reordered() {
        let image = RgbImage::from_vec(2, 1, vec![[255, 51, 0], [0, 102, 255]]).unwrap();
        for (plane, expected) in stretch(&image, (1, 2)).iter().zip([[0.0, 1.0], [0.2, 0.4], [1.0, 0.0]]) {
            assert!(plane.iter().zip(expected).all(|(value, expected)| (value - expected).abs() < 1e-6), "{plane:?}");
        }
    }

    #[test]
    fn pixels_are_sampled_at_half_pixel_centres_and_clamped_at_the_border() {
        let image = RgbImage::from_vec(2, 1, vec![[0; 3], [200; 3]]).unwrap();
        let [plane, ..] = stretch(&image, (2, 4));
        let expected = [0.0, 50.0, 150.0, 200.0, 0.0, 50.0, 150.0, 200.0].map(|value| value / 255.0);
        for (value, expected) in plane.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-6, "{plane:?}");
        }
    }

    proptest! {
        #[test]
        fn equals_its_definition((height, width, rows, columns) in (1..50_usize, 1..50_usize, 1..40_usize, 1..40_usize)) {
            let pixel = |x: usize, y: usize, channel: usize| (x * 91 + y * 57 + x * y * 13 + channel * 101) as u8;
            let pixels = (0..height * width).map(|i| [0, 1, 2].map(|channel| pixel(i % width, i / width, channel)));
            let image = RgbImage::from_vec(width, height, pixels.collect()).unwrap();
            let planes = stretch(&image, (rows, columns));
            let position = |at: usize, from: usize, to: usize| {
                let source = ((at as f64 + 0.5) * from as f64 / to as f64 - 0.5).clamp(0.0, from as f64 - 1.0);
                (source as usize, (source as usize + 1).min(from - 1), source.fract())
            };
            for (channel, plane) in planes.iter().rev().enumerate() {
                for (index, value) in plane.iter().enumerate() {
                    let (left, right, fx) = position(index % columns, width, columns);
                    let (upper, lower, fy) = position(index / columns, height, rows);
                    let mix = |y: usize| {
                        f64::from(pixel(left, y, channel)) * (1.0 - fx) + f64::from(pixel(right, y, channel)) * fx
                    };
                    let expected = (mix(upper) * (1.0 - fy) + mix(lower) * fy) / 255.0;
                    prop_assert!((f64::from(*value) - expected).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn equals_what_opencv_gives_for_float_images() {
        #[derive(serde::Deserialize)]
        struct Golden {
            resize: Vec<Resized>,
        }
        #[derive(serde::Deserialize)]
        struct Resized {
            width: usize,
            height: usize,
            samples: Vec<(usize, f32)>,
        }
        let golden: Golden = serde_json::from_str(include_str!("../../tests/golden.json")).unwrap();
        for Resized { width, height, samples } in golden.resize {
            let pixel = |x: usize, y: usize| [0, 31, 62].map(|c| ((x * 7 + y * 13 + c + x * y % 17 * 5) % 256) as u8);
            let pixels = (0..width * height).map(|index| pixel(index % width, index / width)).collect();
            let planes = stretch(&RgbImage::from_vec(width, height, pixels).unwrap(), (352, 352)).concat();
            for (index, expected) in samples {
                assert!(
                    (planes[index] - expected).abs() < 5e-6,
                    "{width}×{height} at {index}: {} {expected}",
                    planes[index]
                );
            }
        }
    }

    #[test]
    fn every_level_gives_the_same_bits() {
        for (width, height) in [(640, 480), (352, 352), (1, 7), (333, 250)] {
            let pixel = |index: usize| [index * 7, index / 3, index / width].map(|value| value as u8);
            let image = RgbImage::from_vec(width, height, (0..width * height).map(pixel).collect()).unwrap();
            let expected = stretch_at(Level::fallback(), &image, (64, 35));
            assert!(crate::available_levels().into_iter().all(|level| stretch_at(level, &image, (64, 35)) == expected));
        }
    }

    #[test]
    fn one_pixel_fills_the_whole_input() {
        let image = RgbImage::from_vec(1, 1, vec![[0, 0, 255]]).unwrap();
        assert_eq!(stretch(&image, (2, 2))[0], [1.0; 4]);
    }
}
