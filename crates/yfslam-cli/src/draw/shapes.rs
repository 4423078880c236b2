//! Rectangles, discs and tints on a colour image; what lies outside is clipped.

use yfslam::{Image, RgbImage};

/// Red, green, blue.
pub type Color = [u8; 3];

/// Sets the pixel at column `x`, row `y`.
pub fn point(image: &mut RgbImage, x: i64, y: i64, color: Color) {
    let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
    if x < image.width()
        && y < image.height()
        && let Some(pixel) = image.row_mut(y).get_mut(x)
    {
        *pixel = color;
    }
}

/// Mixes `color` into the pixel at column `x`, row `y`; `share` 0 leaves it, 1 replaces it.
pub fn tint(image: &mut RgbImage, x: usize, y: usize, color: Color, share: f32) {
    if let Some(&old) = image.get(x, y) {
        let mix = |old: u8, new: u8| (f32::from(old) * (1.0 - share) + f32::from(new) * share) as u8;
        point(image, x as i64, y as i64, std::array::from_fn(|channel| mix(old[channel], color[channel])));
    }
}

/// Mixes `color` into the pixels where `mask` is not 0, as [`tint`]; pixels on its edge get the colour itself.
pub fn stain(image: &mut RgbImage, mask: &Image<u8>, color: Color, share: f32) {
    for y in 0..mask.height() {
        for x in 0..mask.width() {
            // Positions before the first column or row wrap to values outside of every image.
            let neighbours = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
            if mask.get(x, y).is_some_and(|value| *value != 0) {
                let is_edge = neighbours.iter().any(|&(x, y)| mask.get(x, y) == Some(&0));
                tint(image, x, y, color, if is_edge { 1.0 } else { share });
            }
        }
    }
}

/// Draws the outline of the box between two corners, `thickness` px wide, inside the box.
pub fn rectangle(image: &mut RgbImage, [x0, y0]: [i64; 2], [x1, y1]: [i64; 2], thickness: i64, color: Color) {
    // Clipped first, because the box of a detector may be far outside.
    let (width, height) = (image.width() as i64, image.height() as i64);
    for inset in 0..thickness {
        for x in x0.max(0)..=x1.min(width) {
            point(image, x, y0 + inset, color);
            point(image, x, y1 - inset, color);
        }
        for y in y0.max(0)..=y1.min(height) {
            point(image, x0 + inset, y, color);
            point(image, x1 - inset, y, color);
        }
    }
}

/// Fills the box between two corners.
pub fn bar(image: &mut RgbImage, [x0, y0]: [i64; 2], [x1, y1]: [i64; 2], color: Color) {
    let (width, height) = (image.width() as i64, image.height() as i64);
    for y in y0.max(0)..=y1.min(height) {
        for x in x0.max(0)..=x1.min(width) {
            point(image, x, y, color);
        }
    }
}

/// Draws a filled disc.
pub fn disc(image: &mut RgbImage, [x, y]: [f32; 2], radius: f32, color: Color) {
    ring(image, [x, y], 0.0, radius, color);
}

/// Fills the pixels whose distance from a centre lies between two radii.
pub fn ring(image: &mut RgbImage, [x, y]: [f32; 2], inner: f32, outer: f32, color: Color) {
    let (cx, cy, reach) = (x.round() as i64, y.round() as i64, outer.ceil() as i64);
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let distance = ((dx * dx + dy * dy) as f32).sqrt();
            if (inner..=outer).contains(&distance) {
                point(image, cx + dx, cy + dy, color);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: Color = [255; 3];

    fn drawn(image: &RgbImage) -> Vec<(usize, usize)> {
        let all = (0..image.height()).flat_map(|y| (0..image.width()).map(move |x| (x, y)));
        all.filter(|&(x, y)| image.get(x, y) == Some(&WHITE)).collect()
    }

    #[test]
    fn a_rectangle_is_its_outline_and_a_disc_is_round() {
        let mut image = RgbImage::new(6, 5);
        rectangle(&mut image, [1, 1], [4, 3], 1, WHITE);
        assert_eq!(drawn(&image).len(), 10);
        assert_eq!(image.get(2, 2), Some(&[0; 3]));
        let mut image = RgbImage::new(5, 5);
        disc(&mut image, [2.2, 1.9], 1.0, WHITE);
        assert_eq!(drawn(&image), [(2, 1), (1, 2), (2, 2), (3, 2), (2, 3)]);
    }

    #[test]
    fn what_lies_outside_is_clipped() {
        let mut image = RgbImage::new(4, 4);
        rectangle(&mut image, [-1_000_000_000_000, -5], [2, 2], 2, WHITE);
        disc(&mut image, [-3.0, 90.0], 2.0, WHITE);
        point(&mut image, i64::MAX, i64::MIN, WHITE);
        tint(&mut image, 99, 0, WHITE, 1.0);
        assert_eq!(drawn(&image), [(1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2), (2, 2)]);
    }
}
