//! Rotated BRIEF descriptors.
//!
//! In: a blurred grey image, corners and their orientations. Out: a descriptor of 256 bits for each corner, one bit for each test pair
//! (Rublee et al., ICCV 2011, section 4).

use std::f32::consts::TAU;

use fearless_simd::{Level, dispatch, prelude::*, u8x64};

use super::Descriptor;
use super::fast::Corner;
use super::pattern::TEST_PAIRS;
use crate::image::Plane;

/// Number of orientations for which the rotated pattern is stored (30 in the paper).
const BINS: usize = 128;

/// Largest distance of a test point from the keypoint, px of the level.
pub(crate) const PATTERN_RADIUS: usize = 17;

/// Rows of the patch.
const ROWS: usize = 2 * PATTERN_RADIUS + 1;

/// Bytes of a patch. It holds only the pixels that rotated and rounded test points can reach, row by row; they fit into 16 vectors of
/// 64 bytes.
const PATCH: usize = 1024;

/// Bytes copied for each row; each row overwrites the surplus bytes of the one before.
const COPIED: usize = 36;

/// Number of patches that are copied before the first is read: a read that spans several recent writes would stall the processor.
const BATCH: usize = 8;

/// Half the width of each row of the patch, px: it covers the disc of the pattern enlarged by √½ px, the largest rounding error.
const HALF_WIDTH: [usize; ROWS] = {
    let mut half_width = [0; ROWS];
    let mut row = 0;
    while row < ROWS {
        let v = row.abs_diff(PATTERN_RADIUS);
        // (r + √½)² = r² + √2·r + ½, rounded up.
        let reach = PATTERN_RADIUS * PATTERN_RADIUS + PATTERN_RADIUS * 17 / 12 + 1;
        while half_width[row] < PATTERN_RADIUS && (half_width[row] + 1) * (half_width[row] + 1) + v * v <= reach {
            half_width[row] += 1;
        }
        row += 1;
    }
    half_width
};

/// Offset of each row in the patch.
const START: [usize; ROWS] = {
    let mut start = [0; ROWS];
    let mut row = 1;
    while row < ROWS {
        start[row] = start[row - 1] + 2 * HALF_WIDTH[row - 1] + 1;
        row += 1;
    }
    assert!(start[ROWS - 1] + 2 * HALF_WIDTH[ROWS - 1] < PATCH);
    start
};

/// Positions of 64 test points in the patch.
#[derive(Clone, Debug)]
struct Points {
    position: [u16; 64],
    /// The same positions as the index of a block of 128 bytes and the offset in that block.
    block: [u8; 64],
    in_block: [u8; 64],
}

/// First and second points of the test pairs, with 64 pairs for each word of the descriptor.
type Pattern = [[Points; 2]; 4];

/// Pattern in all orientations, from which descriptors are computed.
#[derive(Clone, Debug)]
pub(crate) struct Describer {
    patterns: Vec<Pattern>,
}

impl Describer {
    /// Rotates the pattern to all orientations.
    pub(super) fn new() -> Self {
        Self { patterns: (0..BINS).map(|bin| rotated(bin as f32 * TAU / BINS as f32)).collect() }
    }

    /// Appends the descriptor of each corner; bit `i` is set if the first point of pair `i` is darker than the second.
    pub(super) fn describe(
        &self,
        level: Level,
        blurred: &Plane,
        corners: &[Corner],
        angles: &[f32],
        out: &mut Vec<Descriptor>,
    ) {
        dispatch!(level, simd => self.describe_all(simd, blurred, corners, angles, out));
    }

    #[inline(always)]
    fn describe_all<S: Simd>(
        &self,
        simd: S,
        blurred: &Plane,
        corners: &[Corner],
        angles: &[f32],
        out: &mut Vec<Descriptor>,
    ) {
        let mut patches = [[0u8; PATCH + COPIED]; BATCH];
        for (corners, angles) in corners.chunks(BATCH).zip(angles.chunks(BATCH)) {
            for (patch, corner) in patches.iter_mut().zip(corners) {
                let top = (usize::from(corner.y) - PATTERN_RADIUS) * blurred.stride() + usize::from(corner.x);
                for row in 0..ROWS {
                    let source = top + row * blurred.stride() - HALF_WIDTH[row];
                    patch[START[row]..START[row] + COPIED].copy_from_slice(&blurred.data()[source..source + COPIED]);
                }
            }
            for (patch, angle_rad) in patches.iter().zip(angles) {
                let pattern = &self.patterns[(angle_rad * (BINS as f32 / TAU) + 0.5) as usize % BINS];
                // A table look-up in vectors of 64 bytes is faster than loading single bytes.
                let wide = S::u8s::LEN == 64;
                out.push(if wide { compare_wide(simd, patch, pattern) } else { compare(simd, patch, pattern) });
            }
        }
    }
}

/// Loads the points one by one, then compares them in vectors.
#[inline(always)]
fn compare<S: Simd>(simd: S, patch: &[u8; PATCH + COPIED], pattern: &Pattern) -> Descriptor {
    let mut words = [0; 4];
    for (word, [first, second]) in words.iter_mut().zip(pattern) {
        let (mut a, mut b) = ([0; 64], [0; 64]);
        for i in 0..64 {
            a[i] = patch[usize::from(first.position[i]) % PATCH];
            b[i] = patch[usize::from(second.position[i]) % PATCH];
        }
        *word = u8x64::from_slice(simd, &a).simd_lt(u8x64::from_slice(simd, &b)).to_bitmask();
    }
    Descriptor(words)
}

/// Looks up 64 points at a time in a patch held by 16 vectors.
#[inline(always)]
fn compare_wide<S: Simd>(simd: S, patch: &[u8; PATCH + COPIED], pattern: &Pattern) -> Descriptor {
    let mut blocks = [[u8x64::splat(simd, 0); 2]; 8];
    for i in 0..8 {
        blocks[i][0] = u8x64::from_slice(simd, &patch[128 * i..128 * i + 64]);
        blocks[i][1] = u8x64::from_slice(simd, &patch[128 * i + 64..128 * i + 128]);
    }
    let mut words = [0; 4];
    for i in 0..4 {
        let a = look_up(simd, &blocks, &pattern[i][0]);
        let b = look_up(simd, &blocks, &pattern[i][1]);
        words[i] = a.simd_lt(b).to_bitmask();
    }
    Descriptor(words)
}

#[inline(always)]
fn look_up<S: Simd>(simd: S, blocks: &[[u8x64<S>; 2]; 8], points: &Points) -> u8x64<S> {
    let index = u8x64::from_slice(simd, &points.in_block);
    let block = u8x64::from_slice(simd, &points.block);
    let mut pixels = u8x64::splat(simd, 0);
    for (i, [low, high]) in blocks.iter().enumerate() {
        pixels = block.simd_eq(i as u8).select(low.concat_swizzle_dyn(*high, index), pixels);
    }
    pixels
}

/// Rotates the test pairs by `angle_rad` and rounds them to pixels.
fn rotated(angle_rad: f32) -> Pattern {
    let (sin, cos) = libm::sincosf(angle_rad);
    let position = |[u, v]: [i8; 2]| {
        let (u, v) = (f32::from(u), f32::from(v));
        let [column, row] =
            [u * cos - v * sin, u * sin + v * cos].map(|d| (d.round() + PATTERN_RADIUS as f32) as usize);
        START[row] + column + HALF_WIDTH[row] - PATTERN_RADIUS
    };
    std::array::from_fn(|word| {
        [0, 2].map(|first| {
            let mut points = Points { position: [0; 64], block: [0; 64], in_block: [0; 64] };
            for i in 0..64 {
                let pair = TEST_PAIRS[64 * word + i];
                let position = position([pair[first], pair[first + 1]]);
                points.position[i] = position as u16;
                points.block[i] = (position / 128) as u8;
                points.in_block[i] = (position % 128) as u8;
            }
            points
        })
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::GrayImage;
    use crate::image::kernels::tests::levels;

    const SIDE: usize = 2 * PATTERN_RADIUS + 1;

    /// Computes a descriptor by its definition, at the orientation of a bin.
    fn expected(patch: &GrayImage, bin: usize) -> Descriptor {
        let (sin, cos) = (bin as f32 * TAU / BINS as f32).sin_cos();
        let mut words = [0; 4];
        for (i, pair) in TEST_PAIRS.iter().enumerate() {
            let [xa, ya, xb, yb] = pair.map(f32::from);
            let [a, b] = [(xa, ya), (xb, yb)].map(|(x, y)| {
                let (column, row) = ((x * cos - y * sin).round() as isize, (x * sin + y * cos).round() as isize);
                let at = |offset| PATTERN_RADIUS.checked_add_signed(offset).unwrap();
                patch.row(at(row))[at(column)]
            });
            words[i / 64] |= u64::from(a < b) << (i % 64);
        }
        Descriptor(words)
    }

    #[test]
    fn all_points_lie_in_the_pattern_and_pairs_differ() {
        for [xa, ya, xb, yb] in TEST_PAIRS.map(|pair| pair.map(i32::from)) {
            let limit = (PATTERN_RADIUS * PATTERN_RADIUS) as i32;
            assert!(xa * xa + ya * ya <= limit && xb * xb + yb * yb <= limit);
            assert_ne!((xa, ya), (xb, yb));
        }
    }

    proptest! {
        #[test]
        fn every_level_agrees_with_the_scalar_twin(
            patch in proptest::collection::vec(any::<u8>(), SIDE * SIDE), bin in 0..BINS,
        ) {
            let patch = GrayImage::from_vec(SIDE, SIDE, patch).unwrap();
            let corner = Corner { x: PATTERN_RADIUS as u16, y: PATTERN_RADIUS as u16, score: 0 };
            for level in levels() {
                let mut descriptors = Vec::new();
                let angle_rad = bin as f32 * TAU / BINS as f32;
                Describer::new().describe(level, &Plane::from(&patch), &[corner], &[angle_rad], &mut descriptors);
                prop_assert_eq!(&descriptors[..], &[expected(&patch, bin)], "{:?}", level);
            }
        }
    }
}
