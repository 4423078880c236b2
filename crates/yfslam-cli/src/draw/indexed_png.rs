//! PNG images in few colours, about a third of the size.

use anyhow::Result;
use color_quant::NeuQuant;
use png::{BitDepth, ColorType, Compression, Encoder, Filter};
use yfslam::RgbImage;

use super::colors::MARKS;

/// Colours besides those of the marks.
const COLORS: usize = 256 - MARKS.len();
/// One of so many pixels is sampled to choose the colours.
const COLOR_SAMPLE: i32 = 7;

/// Encodes the image as PNG in 256 colours.
///
/// # Errors
/// It is too large for PNG.
pub fn to_png(image: &RgbImage) -> Result<Vec<u8>> {
    let rgba: Vec<u8> = image.data().iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
    let colors = NeuQuant::new(COLOR_SAMPLE, COLORS, &rgba);
    // Marks are too small to influence the choice, and they are what matters in these images.
    let palette: Vec<u8> = colors.color_map_rgb().into_iter().chain(MARKS.into_iter().flatten()).collect();
    let difference = |index: usize, pixel: &[u8]| -> u32 {
        let color = palette.iter().skip(3 * index);
        color.zip(pixel).take(3).map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2)).sum()
    };
    let index_of = |pixel: &[u8]| {
        let candidates = [colors.index_of(pixel)].into_iter().chain(COLORS..COLORS + MARKS.len());
        candidates.min_by_key(|index| difference(*index, pixel)).unwrap_or(0) as u8
    };
    let indices: Vec<u8> = rgba.chunks_exact(4).map(index_of).collect();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, image.width().try_into()?, image.height().try_into()?);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_palette(palette.as_slice());
    encoder.set_compression(Compression::High);
    // Numbers of colours are not related to each other, so a filter would not help.
    encoder.set_filter(Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&indices)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use yfslam_io::decode::decode_color;

    use super::*;
    use crate::draw::shapes::disc;

    const GREEN: [u8; 3] = MARKS[0];
    const RED: [u8; 3] = MARKS[2];

    #[test]
    fn few_colours_change_the_image_little_and_its_marks_not_at_all() {
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
}
