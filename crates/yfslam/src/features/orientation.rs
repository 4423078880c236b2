//! Orientation by intensity centroid.
//!
//! In: a grey image and a corner. Out: the direction from the corner to the centroid of its circular patch (Rublee et al., ICCV 2011,
//! section 3.2).

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use fearless_simd::{Level, dispatch, i16x16, prelude::*, u8x32, u16x16};

use super::PATCH_RADIUS;
use super::fast::Corner;
use crate::image::Plane;

/// Columns of the patch, rounded up to whole vectors.
const COLUMNS: usize = 32;

/// `MASK[v]`: columns of the circular patch in the rows ±`v`, with all bits set.
const MASK: [[u8; COLUMNS]; PATCH_RADIUS + 1] = {
    let mut mask = [[0; COLUMNS]; PATCH_RADIUS + 1];
    let mut v = 0;
    while v <= PATCH_RADIUS {
        let mut i = 0;
        while i <= 2 * PATCH_RADIUS {
            let u = i.abs_diff(PATCH_RADIUS);
            if u * u + v * v <= PATCH_RADIUS * PATCH_RADIUS {
                mask[v][i] = 0xff;
            }
            i += 1;
        }
        v += 1;
    }
    mask
};

/// Replaces `angles` by the orientation of each corner, rad in [0, 2π); the patches must lie inside the image.
pub(crate) fn orientations(level: Level, image: &Plane, corners: &[Corner], angles: &mut Vec<f32>) {
    angles.clear();
    dispatch!(level, simd => orient(simd, image, corners, angles));
}

#[inline(always)]
fn orient<S: Simd>(simd: S, image: &Plane, corners: &[Corner], angles: &mut Vec<f32>) {
    for corner in corners {
        let start = (usize::from(corner.y) - PATCH_RADIUS) * image.stride() + usize::from(corner.x) - PATCH_RADIUS;
        let patch = &image.data()[start..start + 2 * PATCH_RADIUS * image.stride() + COLUMNS];
        let [m10, m01] = moments(simd, patch, image.stride());
        angles.push(angle(m10 as f32, m01 as f32));
    }
}

/// Coefficients of atan(t)/t in t² for t in 0–1, error below 2e-8 (Abramowitz & Stegun 1964, 4.4.49).
const ATAN: [f32; 9] = [
    1.0,
    -0.333_331_45,
    0.199_935_51,
    -0.142_089,
    0.106_562_64,
    -0.075_289_64,
    0.042_909_615,
    -0.016_165_737,
    0.002_866_225_7,
];

/// Returns the direction of `(x, y)`, rad in [0, 2π), with the same bits on every platform, unlike the `atan2` of the system.
#[inline(always)]
fn angle(x: f32, y: f32) -> f32 {
    let (small, large) = if x.abs() < y.abs() { (x.abs(), y.abs()) } else { (y.abs(), x.abs()) };
    let t = if large > 0.0 { small / large } else { 0.0 };
    let mut angle = t * ATAN.iter().rev().fold(0.0, |sum, coefficient| sum * (t * t) + coefficient);
    if x.abs() < y.abs() {
        angle = FRAC_PI_2 - angle;
    }
    if x < 0.0 {
        angle = PI - angle;
    }
    if y < 0.0 {
        angle = TAU - angle;
    }
    if angle < TAU { angle } else { 0.0 }
}

/// Returns the first moments in x and y of a patch given by its upper left pixel.
///
/// Rows +v and −v are combined: their sum is added to the column sums; their difference, times v, is added to the moment in y. Even and
/// odd columns are separate as in [`crate::image::kernels`]. No sum overflows: 31 · 255 < 2^15 and 255 · (1 + … + 15) < 2^15.
#[inline(always)]
fn moments<S: Simd>(simd: S, patch: &[u8], stride: usize) -> [i32; 2] {
    let row = |i: usize, v: usize| {
        let mask = u8x32::from_slice(simd, &MASK[v]);
        let bytes = (u8x32::from_slice(simd, &patch[i * stride..i * stride + COLUMNS]) & mask).bitcast::<u16x16<S>>();
        [(bytes & 0x00ff).bitcast::<i16x16<S>>(), (bytes >> 8).bitcast::<i16x16<S>>()]
    };
    let mut column_sums = row(PATCH_RADIUS, 0);
    let mut vertical = [i16x16::splat(simd, 0); 2];
    for v in 1..=PATCH_RADIUS {
        let (above, below) = (row(PATCH_RADIUS - v, v), row(PATCH_RADIUS + v, v));
        for half in 0..2 {
            column_sums[half] += above[half] + below[half];
            vertical[half] += (below[half] - above[half]) * v as i16;
        }
    }
    let column = |half: i16| i16x16::from_fn(simd, |i| 2 * i as i16 + half - PATCH_RADIUS as i16);
    let m10 = column_sums[0].pairwise_dot_product(column(0)) + column_sums[1].pairwise_dot_product(column(1));
    let m01 = vertical[0].pairwise_widening_add() + vertical[1].pairwise_widening_add();
    [m10.reduce_sum(), m01.reduce_sum()]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::GrayImage;
    use crate::image::kernels::tests::levels;

    const SIDE: usize = 2 * PATCH_RADIUS + 2;

    /// Computes the first moments by their definition.
    fn expected(image: &GrayImage) -> [i32; 2] {
        let radius = PATCH_RADIUS as i32;
        let mut sums = [0; 2];
        for v in -radius..=radius {
            for u in (-radius..=radius).filter(|u| u * u + v * v <= radius * radius) {
                let value = i32::from(image.row((v + radius) as usize)[(u + radius) as usize]);
                sums = [sums[0] + u * value, sums[1] + v * value];
            }
        }
        sums
    }

    fn patch() -> impl Strategy<Value = GrayImage> {
        proptest::collection::vec(any::<u8>(), SIDE * SIDE)
            .prop_map(|data| GrayImage::from_vec(SIDE, SIDE, data).unwrap())
    }

    /// Returns a patch that is white where `lit` is true and black elsewhere.
    fn patch_where(lit: impl Fn(usize, usize) -> bool) -> GrayImage {
        let data = (0..SIDE * SIDE).map(|i| if lit(i % SIDE, i / SIDE) { 255 } else { 0 });
        GrayImage::from_vec(SIDE, SIDE, data.collect()).unwrap()
    }

    fn check(image: &GrayImage) {
        for level in levels() {
            let found = dispatch!(level, simd => moments(simd, Plane::from(image).data(), Plane::from(image).stride()));
            assert_eq!(found, expected(image), "{level:?}");
        }
    }

    proptest! {
        #[test]
        fn every_level_agrees_with_the_scalar_twin(image in patch()) {
            check(&image);
        }

        #[test]
        fn the_angle_agrees_with_the_system_atan2(x in -600_000i32..600_000, y in -600_000i32..600_000) {
            let found = angle(x as f32, y as f32);
            let expected = f64::from(y).atan2(f64::from(x));
            prop_assert!((0.0..TAU).contains(&found));
            prop_assert!((f64::from(found) - expected).sin().abs() < 1e-6, "{} {}", found, expected);
        }
    }

    #[test]
    fn the_largest_moments_do_not_overflow() {
        let middle = PATCH_RADIUS;
        check(&patch_where(|x, _| x > middle));
        check(&patch_where(|x, _| x < middle));
        check(&patch_where(|_, y| y > middle));
        check(&patch_where(|_, y| y < middle));
        check(&patch_where(|_, _| true));
    }

    #[test]
    fn a_full_turn_is_zero() {
        assert_eq!(angle(600_000.0, -0.01), 0.0);
        assert_eq!(angle(0.0, 0.0), 0.0);
    }

    #[test]
    fn the_angle_points_to_the_white_half_clockwise_from_the_right() {
        let middle = PATCH_RADIUS;
        let angle = |lit: fn(usize, usize) -> bool| {
            let mut angles = Vec::new();
            let corner = Corner { x: middle as u16, y: middle as u16, score: 0 };
            orientations(Level::new(), &Plane::from(&patch_where(lit)), &[corner], &mut angles);
            angles[0].to_degrees()
        };
        assert!((angle(|x, _| x > PATCH_RADIUS) - 0.0).abs() < 0.1);
        assert!((angle(|_, y| y > PATCH_RADIUS) - 90.0).abs() < 0.1);
        assert!((angle(|x, _| x < PATCH_RADIUS) - 180.0).abs() < 0.1);
        assert!((angle(|_, y| y < PATCH_RADIUS) - 270.0).abs() < 0.1);
    }
}
