//! Pictures of a few moments for the report: some evenly spread, and the most crowded.
//!
//! In: every frame, as SLAM left it. Out: PNG pictures with features and boxes, in few colours, which makes them a third as large. Which
//! moments depends on the frames and their boxes alone, so that methods on the same frames show the same moments.

use anyhow::Result;
use color_quant::NeuQuant;
use png::{BitDepth, ColorType, Compression, Encoder, Filter};
use yfslam::image::RgbImage;
use yfslam::{RgbdFrame, Slam};
use yfslam_eval::report::Picture;

use crate::output::overlay::{MARKS, picture};

/// Wider pictures are made smaller; a page shows none of them larger.
const WIDEST_PX: usize = 480;
/// Colours of a picture besides those of the marks.
const COLORS: usize = 256 - MARKS.len();
/// Every so many pixels one is looked at to choose the colours.
const COLOR_SAMPLE: i32 = 7;

/// Collects pictures while frames go by.
pub struct Moments {
    /// Numbers of the frames that are still to come, the next one last.
    ahead: Vec<usize>,
    /// Score from which a box counts.
    open_score: f32,
    taken: Vec<Moment>,
    crowded: Option<(f32, Moment)>,
}

struct Moment {
    frame: usize,
    image: RgbImage,
    features: [usize; 2],
}

impl Moments {
    /// `count` moments of `total` frames, and the most crowded.
    pub fn new(total: usize, count: usize, open_score: f32) -> Self {
        let mut ahead: Vec<usize> = (0..count).map(|k| total * (2 * k + 1) / (2 * count)).collect();
        ahead.dedup();
        ahead.reverse();
        Self { ahead, open_score, taken: Vec::new(), crowded: None }
    }

    /// Takes a picture of the frame that `slam` saw last, if this is the moment.
    pub fn see(&mut self, frame: usize, image: &RgbdFrame, slam: &Slam) {
        let boxes = slam.last_boxes().iter().filter(|d| d.score >= self.open_score);
        let covered: f32 = boxes.map(|d| d.bbox.area()).sum();
        if covered > self.crowded.as_ref().map_or(0.0, |(most, _)| *most) {
            self.crowded = Some((covered, Moment::new(frame, image, slam, self.open_score)));
        }
        if self.ahead.last().is_some_and(|next| frame >= *next) {
            self.ahead.pop();
            self.taken.push(Moment::new(frame, image, slam, self.open_score));
        }
    }

    /// The pictures, in order of time.
    ///
    /// # Errors
    /// A picture is too large for PNG.
    pub fn to_pictures(&self) -> Result<Vec<Picture>> {
        let crowded = self.crowded.as_ref().map(|(_, moment)| moment);
        let mut moments: Vec<&Moment> = self.taken.iter().collect();
        moments.extend(crowded.filter(|crowded| self.taken.iter().all(|taken| taken.frame != crowded.frame)));
        moments.sort_by_key(|moment| moment.frame);
        let is_crowded = |moment: &Moment| crowded.is_some_and(|crowded| crowded.frame == moment.frame);
        let note = |moment: &Moment| if is_crowded(moment) { "the most crowded" } else { "" };
        moments.into_iter().map(|moment| moment.to_picture(note(moment))).collect()
    }
}

impl Moment {
    fn new(frame: usize, image: &RgbdFrame, slam: &Slam, open_score: f32) -> Self {
        let features = &slam.last_frame().features.features;
        let dynamic = features.iter().filter(|f| f.trust <= 0.0).count();
        let image = shrink(picture(image, slam, open_score));
        Self { frame, image, features: [features.len() - dynamic, dynamic] }
    }

    fn to_picture(&self, note: &'static str) -> Result<Picture> {
        let Self { frame, image, features } = self;
        let size = [image.width(), image.height()];
        Ok(Picture { frame: *frame, note, png: to_png(image)?, size, features: *features })
    }
}

/// The picture as PNG in few colours.
///
/// # Errors
/// It is too large for PNG.
pub fn to_png(image: &RgbImage) -> Result<Vec<u8>> {
    let rgba: Vec<u8> = image.data().iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
    let colors = NeuQuant::new(COLOR_SAMPLE, COLORS, &rgba);
    // Marks are small, and so have no say in the choice; they are what the picture is for.
    let palette: Vec<u8> = colors.color_map_rgb().into_iter().chain(MARKS.into_iter().flatten()).collect();
    let off = |index: usize, pixel: &[u8]| -> u32 {
        let color = palette.iter().skip(3 * index);
        color.zip(pixel).take(3).map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2)).sum()
    };
    let index_of = |pixel: &[u8]| {
        let candidates = [colors.index_of(pixel)].into_iter().chain(COLORS..COLORS + MARKS.len());
        candidates.min_by_key(|index| off(*index, pixel)).unwrap_or(0) as u8
    };
    let indices: Vec<u8> = rgba.chunks_exact(4).map(index_of).collect();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, image.width().try_into()?, image.height().try_into()?);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_palette(palette.as_slice());
    encoder.set_compression(Compression::High);
    // Neighbouring numbers of colours have nothing in common that a filter could use.
    encoder.set_filter(Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&indices)?;
    writer.finish()?;
    Ok(bytes)
}

/// The picture at the width of the page: each pixel is the mean of the area that it stands for.
fn shrink(image: RgbImage) -> RgbImage {
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

/// The pixels that a pixel of the smaller picture covers along one side, each with how much of it.
fn cover(index: usize, scale: f64) -> impl Iterator<Item = (usize, f64)> {
    let (from, to) = (index as f64 * scale, (index + 1) as f64 * scale);
    (from as usize..to.ceil() as usize).map(move |i| (i, (to.min(i as f64 + 1.0) - from.max(i as f64)).max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::shapes::disc;
    use yfslam_io::decode::decode_color;

    const GREEN: [u8; 3] = MARKS[0];
    const RED: [u8; 3] = MARKS[2];

    #[test]
    fn few_colours_change_the_picture_little_and_its_marks_hardly() {
        let mut image = RgbImage::new(160, 120);
        for y in 0..120 {
            for (x, pixel) in image.row_mut(y).iter_mut().enumerate() {
                *pixel = [x as u8, 40 + y as u8, 200 - x as u8 / 2 - y as u8 / 2];
            }
        }
        for k in 0..12 {
            disc(&mut image, [12.0 * k as f32, 9.0 * k as f32], 2.0, GREEN);
            disc(&mut image, [12.0 * k as f32, 110.0 - 9.0 * k as f32], 2.0, RED);
        }
        let mut again = RgbImage::default();
        decode_color(&to_png(&image).unwrap(), None, &mut again).unwrap();
        assert_eq!((again.width(), again.height()), (160, 120));
        let off = |a: &[u8; 3], b: &[u8; 3]| a.iter().zip(b).map(|(a, b)| i32::from(a.abs_diff(*b))).max().unwrap();
        let pairs = || image.data().iter().zip(again.data());
        let mean = pairs().map(|(a, b)| off(a, b)).sum::<i32>() as f64 / image.data().len() as f64;
        let marks = pairs().filter(|(a, _)| [GREEN, RED].contains(a)).map(|(a, b)| off(a, b)).max().unwrap();
        assert!(mean < 8.0 && marks == 0, "{mean} {marks}");
    }

    #[test]
    fn a_wide_picture_becomes_the_mean_of_what_each_pixel_stands_for() {
        let mut image = RgbImage::new(1200, 6);
        image.data_mut().iter_mut().step_by(2).for_each(|pixel| *pixel = [90; 3]);
        let small = shrink(image);
        assert_eq!((small.width(), small.height()), (480, 2));
        // 2.5 pixels each, 1.5 or 1 of them light.
        assert_eq!(small.row(0)[..4], [[54; 3], [54; 3], [36; 3], [36; 3]]);
        assert_eq!(shrink(RgbImage::new(480, 7)).height(), 7);
    }

    #[test]
    fn moments_are_spread_over_the_frames_there_are() {
        assert_eq!(Moments::new(100, 4, 0.5).ahead, [87, 62, 37, 12]);
        assert_eq!(Moments::new(2, 4, 0.5).ahead, [1, 0]);
    }
}
