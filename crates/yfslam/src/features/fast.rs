//! FAST-9 corners.
//!
//! In: a grey image. Out: local maxima of the corner score (Rosten & Drummond, ECCV 2006; score as in Rosten et al., PAMI 2010).

use crate::image::GrayImage;

/// The Bresenham circle of radius 3, px, clockwise from twelve o'clock.
const CIRCLE: [(isize, isize); 16] = [
    (0, -3),
    (1, -3),
    (2, -2),
    (3, -1),
    (3, 0),
    (3, 1),
    (2, 2),
    (1, 3),
    (0, 3),
    (-1, 3),
    (-2, 2),
    (-3, 1),
    (-3, 0),
    (-3, -1),
    (-2, -2),
    (-1, -3),
];

/// A corner in a pyramid level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Corner {
    /// Column in the level, px.
    pub x: u16,
    /// Row in the level, px.
    pub y: u16,
    /// The largest threshold below which the pixel is still a corner, grey levels.
    pub score: u8,
}

/// The corner score of a pixel: over all arcs of nine circle pixels, the largest of the smallest differences to the centre.
fn score(image: &GrayImage, x: usize, y: usize) -> u8 {
    let centre = i16::from(image.row(y)[x]);
    let diff =
        CIRCLE.map(|(dx, dy)| i16::from(image.row(y.wrapping_add_signed(dy))[x.wrapping_add_signed(dx)]) - centre);
    let mut best = 0;
    for start in 0..16 {
        let arc = || (start..start + 9).map(|i| diff[i % 16]);
        let bright = arc().min().unwrap_or(0);
        let dark = -arc().max().unwrap_or(0);
        best = best.max(bright).max(dark);
    }
    best as u8
}

/// Replaces `corners` by the pixels at least `border` (≥ 4) px inside the image whose score exceeds `threshold` and all
/// eight neighbours (of equal ones the first stays), row by row.
pub(crate) fn detect(image: &GrayImage, threshold: u8, border: usize, corners: &mut Vec<Corner>) {
    corners.clear();
    let (width, height) = (image.width(), image.height());
    if width <= 2 * border || height <= 2 * border {
        return;
    }
    let mut scores = GrayImage::new(width, height);
    for y in border - 1..=height - border {
        for x in border - 1..=width - border {
            let score = score(image, x, y);
            scores.row_mut(y)[x] = if score > threshold { score } else { 0 };
        }
    }
    for y in border..height - border {
        for x in border..width - border {
            let score = scores.row(y)[x];
            let before = scores.row(y - 1)[x - 1..=x + 1].iter().chain(&scores.row(y)[x - 1..x]);
            let after = scores.row(y + 1)[x - 1..=x + 1].iter().chain(&scores.row(y)[x + 1..=x + 1]);
            if score > 0 && before.into_iter().all(|&s| score > s) && after.into_iter().all(|&s| score >= s) {
                corners.push(Corner { x: x as u16, y: y as u16, score });
            }
        }
    }
}
