//! Rotated BRIEF descriptors.
//!
//! In: a blurred grey image, corners and their orientations. Out: 256 bits each, one per test pair (Rublee et al., ICCV 2011,
//! section 4).

use std::f32::consts::TAU;

use super::fast::Corner;
use super::pattern::TEST_PAIRS;
use super::{Descriptor, PATCH_RADIUS};
use crate::image::Plane;

/// Orientations for which the pattern is rotated beforehand (the paper takes 30).
const BINS: usize = 64;

/// Bytes per row of the patch copied out of the image, a power of two above its diameter.
const ROW: usize = 32;

/// Bytes of the copied patch.
const PATCH: usize = (2 * PATCH_RADIUS + 2) * ROW;

/// Positions in the patch of the first and the second point of each test pair.
type Pattern = [[u16; 2]; 256];

/// Computes descriptors; holds the pattern in all orientations.
#[derive(Clone, Debug)]
pub(crate) struct Describer {
    patterns: Vec<Pattern>,
}

impl Describer {
    pub fn new() -> Self {
        Self { patterns: (0..BINS).map(|bin| rotated(bin as f32 * TAU / BINS as f32)).collect() }
    }

    /// Appends the descriptor of each corner; bit `i` says that the first point of pair `i` is darker than the second.
    pub fn describe(&self, blurred: &Plane, corners: &[Corner], angles: &[f32], out: &mut Vec<Descriptor>) {
        let mut patch = [0u8; PATCH];
        for (corner, angle_rad) in corners.iter().zip(angles) {
            let start =
                (usize::from(corner.y) - PATCH_RADIUS) * blurred.stride() + usize::from(corner.x) - PATCH_RADIUS;
            let rows = blurred.data()[start..].chunks(blurred.stride());
            for (row, source) in patch.chunks_exact_mut(ROW).zip(rows) {
                row.copy_from_slice(&source[..ROW]);
            }
            let bin = (angle_rad * (BINS as f32 / TAU) + 0.5) as usize % BINS;
            out.push(compare(&patch, &self.patterns[bin]));
        }
    }
}

fn compare(patch: &[u8; PATCH], pattern: &Pattern) -> Descriptor {
    let mut words = [0u64; 4];
    for (word, pairs) in words.iter_mut().zip(pattern.chunks_exact(64)) {
        for (bit, &[a, b]) in pairs.iter().enumerate() {
            let [a, b] = [a, b].map(|position| patch[usize::from(position) % PATCH]);
            *word |= u64::from(a < b) << bit;
        }
    }
    Descriptor(words)
}

/// The test pairs rotated by `angle_rad`, rounded to pixels.
fn rotated(angle_rad: f32) -> Pattern {
    let (sin, cos) = angle_rad.sin_cos();
    let position = |u: i8, v: i8| {
        let (u, v) = (f32::from(u), f32::from(v));
        let [column, row] = [u * cos - v * sin, u * sin + v * cos].map(|d| (d.round() + PATCH_RADIUS as f32) as usize);
        (row * ROW + column) as u16
    };
    TEST_PAIRS.map(|[xa, ya, xb, yb]| [position(xa, ya), position(xb, yb)])
}
