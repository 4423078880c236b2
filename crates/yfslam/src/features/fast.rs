//! FAST-9 corners.
//!
//! In: a grey image. Out: local maxima of the corner score (Rosten & Drummond, ECCV 2006; score as in Rosten et al., PAMI 2010).

use fearless_simd::{Level, dispatch, prelude::*};

use crate::image::kernels::{load, store};
use crate::image::{LANES, Plane};

/// The Bresenham circle of radius 3, px: columns and rows, clockwise from twelve o'clock.
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

/// Replaces `corners` by the pixels at least `border` (≥ 4) px inside the image whose score exceeds `threshold` and all
/// eight neighbours (of equal ones the first stays), row by row.
///
/// `scores` is a buffer for three rows.
pub(crate) fn detect(
    level: Level,
    image: &Plane,
    threshold: u8,
    border: usize,
    scores: &mut [Vec<u8>; 3],
    corners: &mut Vec<Corner>,
) {
    corners.clear();
    // Larger images than coordinates can tell are cut off.
    let (width, height) = (image.width().min(u16::MAX.into()), image.height().min(u16::MAX.into()));
    if width <= 2 * border || height <= 2 * border {
        return;
    }
    for row in scores.iter_mut() {
        row.resize(image.stride() + LANES, 0);
    }
    let area = Area { left: border, top: border, width: width - 2 * border, height: height - 2 * border };
    dispatch!(level, simd => detect_rows(simd, image, threshold, area, scores, corners));
}

/// The rectangle in which corners are sought; scores are needed one pixel around it.
#[derive(Clone, Copy)]
struct Area {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

#[inline(always)]
fn detect_rows<S: Simd>(
    simd: S,
    image: &Plane,
    threshold: u8,
    area: Area,
    scores: &mut [Vec<u8>; 3],
    corners: &mut Vec<Corner>,
) {
    for i in 0..area.height + 2 {
        let start = (area.top + i - 1) * image.stride() + area.left - 1;
        score_row(simd, image, start, area.width + 2, threshold, &mut scores[i % 3]);
        if i >= 2 {
            let rows = [&scores[(i - 2) % 3], &scores[(i - 1) % 3], &scores[i % 3]].map(|row| &row[..]);
            emit_maxima(simd, rows, area, area.top + i - 2, corners);
        }
    }
}

/// Scores of the `len` pixels from `image.data()[start]` on; 0 where the score does not exceed `threshold`.
#[inline(always)]
fn score_row<S: Simd>(simd: S, image: &Plane, start: usize, len: usize, threshold: u8, scores: &mut [u8]) {
    let len = len.next_multiple_of(S::u8s::LEN);
    let centre = &image.data()[start..start + len];
    let circle = CIRCLE.map(|(dx, dy)| {
        let start = start.wrapping_add_signed(dy * image.stride() as isize + dx);
        &image.data()[start..start + len]
    });
    let scores = &mut scores[..len];
    let none = S::u8s::splat(simd, threshold);
    let zero = S::u8s::splat(simd, 0);
    for x in (0..len).step_by(S::u8s::LEN) {
        let c = load(simd, centre, x);
        // Nine circle pixels in a row cover two neighbouring compass points.
        let n = load(simd, circle[0], x);
        let e = load(simd, circle[4], x);
        let s = load(simd, circle[8], x);
        let w = load(simd, circle[12], x);
        let bright = n.max(s).min(e.max(w)).saturating_sub(c).simd_gt(none).any_true();
        let dark = c.saturating_sub(n.min(s).max(e.min(w))).simd_gt(none).any_true();
        let mut score = zero;
        if bright || dark {
            let mut ring = [c; 16];
            for i in 0..16 {
                ring[i] = load(simd, circle[i], x);
            }
            if bright {
                let mut diff = ring;
                for i in 0..16 {
                    diff[i] = ring[i].saturating_sub(c);
                }
                score = best_arc::<S>(diff);
            }
            if dark {
                let mut diff = ring;
                for i in 0..16 {
                    diff[i] = c.saturating_sub(ring[i]);
                }
                score = score.max(best_arc::<S>(diff));
            }
            score = score.simd_gt(none).select(score, zero);
        }
        store::<S>(scores, x, score);
    }
}

/// Over all arcs of nine in a circle of 16, the largest of the smallest values.
///
/// The arcs that start at i − 1 and at i share the eight values from i on, so only every other group of eight is needed.
#[inline(always)]
fn best_arc<S: Simd>(v: [S::u8s; 16]) -> S::u8s {
    let mut two = [v[0]; 8];
    for i in 0..8 {
        two[i] = v[2 * i + 1].min(v[(2 * i + 2) % 16]);
    }
    let mut four = two;
    for i in 0..8 {
        four[i] = two[i].min(two[(i + 1) % 8]);
    }
    let mut best = v[0];
    for i in 0..8 {
        let eight = four[i].min(four[(i + 2) % 8]);
        let nine = eight.min(v[2 * i].max(v[(2 * i + 9) % 16]));
        best = if i == 0 { nine } else { best.max(nine) };
    }
    best
}

/// Appends the local maxima of the middle one of three rows of scores, which is row `y` of the image.
#[inline(always)]
fn emit_maxima<S: Simd>(simd: S, rows: [&[u8]; 3], area: Area, y: usize, corners: &mut Vec<Corner>) {
    let [above, row, below] = rows;
    for x in (0..area.width).step_by(S::u8s::LEN) {
        let score = load(simd, row, x + 1);
        if score.simd_gt(S::u8s::splat(simd, 0)).all_false() {
            continue;
        }
        let before =
            load(simd, above, x).max(load(simd, above, x + 1)).max(load(simd, above, x + 2)).max(load(simd, row, x));
        let after = load(simd, below, x).max(load(simd, below, x + 1)).max(load(simd, below, x + 2)).max(load(
            simd,
            row,
            x + 2,
        ));
        let mut maxima = (score.simd_gt(before) & score.simd_ge(after)).to_bitmask();
        if area.width - x < S::u8s::LEN {
            maxima &= (1 << (area.width - x)) - 1;
        }
        while maxima != 0 {
            let x = x + maxima.trailing_zeros() as usize;
            corners.push(Corner { x: (area.left + x) as u16, y: y as u16, score: row[x + 1] });
            maxima &= maxima - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::kernels::tests::levels;
    use crate::image::plane::tests::images;

    /// The corner score by its definition.
    fn score(image: &Plane, x: usize, y: usize) -> u8 {
        let pixel = |(dx, dy): (isize, isize)| i16::from(image.row(y.strict_add_signed(dy))[x.strict_add_signed(dx)]);
        let diff = CIRCLE.map(|offset| pixel(offset) - pixel((0, 0)));
        let best_arc = |sign: i16| {
            (0..16).map(|start| (start..start + 9).map(|i| sign * diff[i % 16]).min().unwrap()).max().unwrap()
        };
        best_arc(1).max(best_arc(-1)).max(0) as u8
    }

    fn corners(image: &Plane, threshold: u8, border: usize) -> Vec<Corner> {
        let strong = |x: usize, y: usize| Some(score(image, x, y)).filter(|&score| score > threshold).unwrap_or(0);
        let mut corners = Vec::new();
        for y in border..image.height().saturating_sub(border) {
            for x in border..image.width().saturating_sub(border) {
                let centre = strong(x, y);
                let neighbours = (0..9).filter(|&i| i != 4).map(|i| (i < 4, strong(x + i % 3 - 1, y + i / 3 - 1)));
                if centre > 0 && neighbours.into_iter().all(|(before, s)| if before { centre > s } else { centre >= s })
                {
                    corners.push(Corner { x: x as u16, y: y as u16, score: centre });
                }
            }
        }
        corners
    }

    proptest! {
        #[test]
        fn every_level_agrees_with_the_scalar_twin(image in images(0..120), threshold in 0u8..60, border in 4usize..20) {
            let image = Plane::from(&image);
            let expected = corners(&image, threshold, border);
            for level in levels() {
                let mut found = Vec::new();
                detect(level, &image, threshold, border, &mut Default::default(), &mut found);
                prop_assert_eq!(&found, &expected, "{:?}", level);
            }
        }
    }
}
