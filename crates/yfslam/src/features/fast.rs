//! FAST-9 corners.
//!
//! In: a grey image. Out: the local maxima of the corner score (Rosten & Drummond, ECCV 2006; score as in Rosten et al., PAMI 2010).

use fearless_simd::{Level, dispatch, prelude::*};

use crate::image::kernels::{load, store};
use crate::image::{LANES, Plane};

/// A corner in a pyramid level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Corner {
    /// Column in the level, px.
    pub x: u16,
    /// Row in the level, px.
    pub y: u16,
    /// Corner score: the pixel is a corner for all thresholds below it, grey levels.
    pub score: u8,
}

/// Corners of one image, ordered by row and column.
#[derive(Clone, Debug, Default)]
pub(crate) struct Corners {
    /// Corners whose score exceeds the higher threshold.
    pub strong: Vec<Corner>,
    /// Corners whose score exceeds only the lower threshold.
    pub weak: Vec<Corner>,
}

/// Parameters of the corner search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    /// Threshold of strong corners, grey levels.
    pub strong: u8,
    /// Threshold of weak corners, grey levels, at most `strong`.
    pub weak: u8,
    /// Width of the image border without corners, at least 4 px.
    pub border: usize,
}

/// Replaces `corners` by the pixels whose score exceeds a threshold and the scores of all eight neighbours; of neighbours with the same
/// score the first is a corner.
///
/// `scores` is a buffer for three rows.
pub(crate) fn detect(level: Level, image: &Plane, search: Search, scores: &mut [Vec<u8>; 3], corners: &mut Corners) {
    corners.strong.clear();
    corners.weak.clear();
    // Coordinates have 16 bits: pixels of larger images beyond them are ignored.
    let (width, height) = (image.width().min(u16::MAX.into()), image.height().min(u16::MAX.into()));
    if width <= 2 * search.border || height <= 2 * search.border {
        return;
    }
    for row in scores.iter_mut() {
        row.resize(image.stride() + LANES, 0);
    }
    let size = [width - 2 * search.border, height - 2 * search.border];
    dispatch!(level, simd => detect_rows(simd, image, search, size, scores, corners));
}

/// Computes the scores row by row, with one more pixel on each side, and appends the maxima of the last three rows.
#[inline(always)]
fn detect_rows<S: Simd>(
    simd: S,
    image: &Plane,
    search: Search,
    [width, height]: [usize; 2],
    scores: &mut [Vec<u8>; 3],
    corners: &mut Corners,
) {
    for i in 0..height + 2 {
        let start = (search.border + i - 1) * image.stride() + search.border - 1;
        score_row(simd, image, start, width + 2, search.weak, &mut scores[i % 3]);
        if i >= 2 {
            let rows = [&scores[(i - 2) % 3][..], &scores[(i - 1) % 3][..], &scores[i % 3][..]];
            emit_maxima(simd, rows, width, search, search.border + i - 2, corners);
        }
    }
}

/// Computes the scores of `len` pixels that begin at `image.data()[start]`; 0 where the score does not exceed `threshold`.
#[inline(always)]
fn score_row<S: Simd>(simd: S, image: &Plane, start: usize, len: usize, threshold: u8, scores: &mut [u8]) {
    let lanes = S::u8s::LEN;
    let len = len.next_multiple_of(lanes);
    let mut rows = [&[][..]; 7];
    for (i, row) in rows.iter_mut().enumerate() {
        let start = start + i * image.stride() - 3 * image.stride() - 3;
        *row = &image.data()[start..start + len + 6];
    }
    let scores = &mut scores[..len];
    let zero = S::u8s::splat(simd, 0);
    let none = S::u8s::splat(simd, threshold);
    for x in (0..len).step_by(lanes) {
        // Windows of known length make the bounds checks below unnecessary.
        let mut window = rows;
        for i in 0..7 {
            window[i] = &rows[i][x..x + lanes + 6];
        }
        let centre = load(simd, window[3], 3);
        // Nine adjacent pixels of the circle always contain two neighbouring compass points.
        let [n, e] = [load(simd, window[0], 3), load(simd, window[3], 6)];
        let [s, w] = [load(simd, window[6], 3), load(simd, window[3], 0)];
        let bright = n.max(s).min(e.max(w)).saturating_sub(centre).simd_gt(none).any_true();
        let dark = centre.saturating_sub(n.min(s).max(e.min(w))).simd_gt(none).any_true();
        let mut score = zero;
        if bright {
            let mut differences = circle(simd, &window);
            for pixel in &mut differences {
                *pixel = pixel.saturating_sub(centre);
            }
            score = best_arc::<S>(differences);
        }
        if dark {
            let mut differences = circle(simd, &window);
            for pixel in &mut differences {
                *pixel = centre.saturating_sub(*pixel);
            }
            score = score.max(best_arc::<S>(differences));
        }
        store::<S>(scores, x, score.simd_gt(none).select(score, zero));
    }
}

/// Loads the pixels on the circles around the centres that begin at `window[3][3]`, clockwise from the top.
#[inline(always)]
fn circle<S: Simd>(simd: S, window: &[&[u8]; 7]) -> [S::u8s; 16] {
    [
        load(simd, window[0], 3),
        load(simd, window[0], 4),
        load(simd, window[1], 5),
        load(simd, window[2], 6),
        load(simd, window[3], 6),
        load(simd, window[4], 6),
        load(simd, window[5], 5),
        load(simd, window[6], 4),
        load(simd, window[6], 3),
        load(simd, window[6], 2),
        load(simd, window[5], 1),
        load(simd, window[4], 0),
        load(simd, window[3], 0),
        load(simd, window[2], 0),
        load(simd, window[1], 1),
        load(simd, window[0], 2),
    ]
}

/// Returns the largest of the minima over all arcs of nine pixels of a circle of 16.
///
/// The arcs that start at i − 1 and at i share the eight values that start at i, so that only every second group of eight is needed.
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
    let mut nine = four;
    for i in 0..8 {
        nine[i] = four[i].min(four[(i + 2) % 8]).min(v[2 * i].max(v[(2 * i + 9) % 16]));
    }
    let [a, b, c, d, e, f, g, h] = nine;
    a.max(b).max(c.max(d)).max(e.max(f).max(g.max(h)))
}

/// Appends the local maxima among the inner `width` scores of the middle of three rows, which is row `y` of the image.
#[inline(always)]
fn emit_maxima<S: Simd>(simd: S, rows: [&[u8]; 3], width: usize, search: Search, y: usize, corners: &mut Corners) {
    let [above, row, below] = rows;
    let row_maximum = |row: &[u8], x: usize| load(simd, row, x).max(load(simd, row, x + 1)).max(load(simd, row, x + 2));
    for x in (0..width).step_by(S::u8s::LEN) {
        let score = load(simd, row, x + 1);
        if score.simd_gt(S::u8s::splat(simd, 0)).all_false() {
            continue;
        }
        let before = row_maximum(above, x).max(load(simd, row, x));
        let after = row_maximum(below, x).max(load(simd, row, x + 2));
        let mut maxima = (score.simd_gt(before) & score.simd_ge(after)).to_bitmask();
        if width - x < S::u8s::LEN {
            maxima &= (1 << (width - x)) - 1;
        }
        let strong = score.simd_gt(S::u8s::splat(simd, search.strong)).to_bitmask();
        for (mut maxima, list) in [(maxima & strong, &mut corners.strong), (maxima & !strong, &mut corners.weak)] {
            while maxima != 0 {
                let x = x + maxima.trailing_zeros() as usize;
                list.push(Corner { x: (search.border + x) as u16, y: y as u16, score: row[x + 1] });
                maxima &= maxima - 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::kernels::tests::levels;
    use crate::image::plane::tests::images;

    /// The Bresenham circle of radius 3 px: columns and rows, clockwise from the top.
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

    /// Computes the corner score by its definition.
    fn score(image: &Plane, x: usize, y: usize) -> u8 {
        let pixel = |(dx, dy): (isize, isize)| {
            i16::from(image.row(y.checked_add_signed(dy).unwrap())[x.checked_add_signed(dx).unwrap()])
        };
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
        fn every_level_agrees_with_the_scalar_twin(image in images(0..120), weak in 0u8..60, more in 0u8..60, border in 4usize..20) {
            let image = Plane::from(&image);
            let search = Search { weak, strong: weak + more, border };
            let (expected_strong, expected_weak): (Vec<_>, Vec<_>) =
                corners(&image, weak, border).into_iter().partition(|corner| corner.score > search.strong);
            for level in levels() {
                let mut found = Corners::default();
                detect(level, &image, search, &mut Default::default(), &mut found);
                prop_assert_eq!(&found.strong, &expected_strong, "{:?}", level);
                prop_assert_eq!(&found.weak, &expected_weak, "{:?}", level);
            }
        }
    }
}
