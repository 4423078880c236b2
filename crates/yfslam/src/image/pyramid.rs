//! Image pyramid by bilinear resampling.
//!
//! In: a grey image. Out: the image at scales 1, 1/s, 1/s², … The areas of the pixels are aligned: the centre of pixel `x` of
//! level `l` lies at `(x + 0.5) · s^l − 0.5` of level 0.

use fearless_simd::{Level, dispatch, prelude::*};

use super::GrayImage;
use super::kernels::{even, lerp, load, odd, store};
use super::plane::{LANES, Plane};

/// A stack of images, each smaller than the one before by a constant factor. Buffers are reused from frame to frame.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    level: Level,
    scale_factor: f32,
    planes: Vec<Plane>,
    /// Interpolation taps of the columns from plane `i` to plane `i + 1`.
    columns: Vec<Taps>,
    line: Vec<u8>,
}

impl Pyramid {
    /// Makes an empty pyramid of `planes` images (at least 1), each smaller than the one before by `scale_factor` (1 to 2).
    pub(crate) fn new(level: Level, planes: usize, scale_factor: f32) -> Self {
        let planes = planes.max(1);
        Self {
            level,
            scale_factor: scale_factor.clamp(1.0, 2.0),
            planes: vec![Plane::default(); planes],
            columns: vec![Taps::default(); planes - 1],
            line: Vec::new(),
        }
    }

    /// Computes all planes from `image`, which becomes the first.
    pub(crate) fn build(&mut self, image: &GrayImage) {
        let Some((base, rest)) = self.planes.split_first_mut() else { return };
        base.copy_from(image);
        let mut finer = &*base;
        for (plane, columns) in rest.iter_mut().zip(&mut self.columns) {
            plane.resize(smaller(finer.width(), self.scale_factor), smaller(finer.height(), self.scale_factor));
            columns.prepare(self.scale_factor, finer.width(), plane.width(), lanes(self.level));
            self.line.resize(finer.stride() + 2 * LANES, 0);
            resample(self.level, finer, self.scale_factor, columns, plane, &mut self.line);
            finer = plane;
        }
    }

    /// Returns the ratio between the scales of neighbouring planes.
    pub(crate) fn scale_factor(&self) -> f32 {
        self.scale_factor
    }

    /// Returns all planes, finest first.
    pub(crate) fn planes(&self) -> &[Plane] {
        &self.planes
    }
}

/// Returns the side of the next smaller plane; 0 if the input has fewer than the two pixels that bilinear resampling needs.
fn smaller(len: usize, scale: f32) -> usize {
    if len < 2 { 0 } else { (len as f32 / scale).round() as usize }
}

/// Positions of the output pixels of a row between the input pixels, in blocks of one vector.
#[derive(Clone, Debug, Default)]
struct Taps {
    input: usize,
    /// First input pixel that each block uses.
    base: Vec<usize>,
    /// Left neighbour of each output pixel, relative to its block's base.
    left: Vec<u8>,
    /// Weight of the right neighbour, in 1/256.
    weight: Vec<u8>,
}

impl Taps {
    /// Computes the taps from `input` to `output` pixels in blocks of `lanes`, unless they are up to date.
    fn prepare(&mut self, scale: f32, input: usize, output: usize, lanes: usize) {
        let padded = output.next_multiple_of(lanes);
        if self.input == input && self.left.len() == padded {
            return;
        }
        self.input = input;
        self.base.clear();
        self.left.clear();
        self.weight.clear();
        for x in 0..padded {
            let (left, weight) = tap(x.min(output - 1), scale, input);
            if x % lanes == 0 {
                self.base.push(left);
            }
            let base = self.base.last().copied().unwrap_or(0);
            self.left.push((left - base) as u8);
            self.weight.push(weight);
        }
    }
}

/// Returns the left neighbour of output pixel `i` among `len` (≥ 2) input pixels, and the weight of the right neighbour in 1/256.
fn tap(i: usize, scale: f32, len: usize) -> (usize, u8) {
    let position = ((i as f32 + 0.5) * scale - 0.5).clamp(0.0, (len - 1) as f32);
    let left = (position as usize).min(len - 2);
    (left, ((position - left as f32) * 256.0).round().min(255.0) as u8)
}

/// Returns the number of bytes in the native vector.
fn lanes(level: Level) -> usize {
    #[inline(always)]
    fn of<S: Simd>(_: S) -> usize {
        S::u8s::LEN
    }
    dispatch!(level, simd => of(simd))
}

fn resample(level: Level, src: &Plane, scale: f32, columns: &Taps, dst: &mut Plane, line: &mut [u8]) {
    dispatch!(level, simd => resample_rows(simd, src, scale, columns, dst, line));
}

/// Interpolates two rows of `src` into `line`, then neighbouring pixels of `line` into a row of `dst`.
#[inline(always)]
fn resample_rows<S: Simd>(simd: S, src: &Plane, scale: f32, columns: &Taps, dst: &mut Plane, line: &mut [u8]) {
    let lanes = S::u8s::LEN;
    for y in 0..dst.height() {
        let (top, weight) = tap(y, scale, src.height());
        let (above, below) = (src.row(top), src.row(top + 1));
        let weight = S::u16s::splat(simd, u16::from(weight));
        for x in (0..src.width()).step_by(lanes) {
            store::<S>(line, x, lerp::<S>(load(simd, above, x), load(simd, below, x), (weight, weight)));
        }
        let out = dst.row_mut(y);
        for (block, &base) in columns.base.iter().enumerate() {
            let x = block * lanes;
            let (low, high) = (load(simd, line, base), load(simd, line, base + lanes));
            let index = load(simd, &columns.left, x);
            let weight = load(simd, &columns.weight, x);
            let left = low.concat_swizzle_dyn(high, index);
            let right = low.concat_swizzle_dyn(high, index + 1);
            store::<S>(out, x, lerp::<S>(left, right, (even::<S>(weight), odd::<S>(weight))));
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::kernels::tests::levels;
    use super::super::plane::tests::images;
    use super::*;

    /// Resamples one pixel with the same arithmetic: rows first, rounded, then columns.
    fn resampled(src: &Plane, scale: f32, x: usize, y: usize) -> u8 {
        let lerp = |a: u8, b: u8, weight: u8| {
            let weight = u32::from(weight);
            ((u32::from(a) * (256 - weight) + u32::from(b) * weight + 128) >> 8) as u8
        };
        let ((left, weight_x), (top, weight_y)) = (tap(x, scale, src.width()), tap(y, scale, src.height()));
        let column = |x: usize| lerp(src.row(top)[x], src.row(top + 1)[x], weight_y);
        lerp(column(left), column(left + 1), weight_x)
    }

    proptest! {
        #[test]
        fn every_level_agrees_with_the_scalar_twin(image in images(0..150), scale in 1f32..=2.0) {
            for level in levels() {
                let mut pyramid = Pyramid::new(level, 3, scale);
                pyramid.build(&image);
                for pair in pyramid.planes().windows(2) {
                    for y in 0..pair[1].height() {
                        for x in 0..pair[1].width() {
                            let expected = resampled(&pair[0], scale, x, y);
                            prop_assert_eq!(pair[1].row(y)[x], expected, "{:?} at {}, {}", level, x, y);
                        }
                    }
                }
            }
        }

        #[test]
        fn a_reused_pyramid_equals_a_fresh_one(first in images(0..90), second in images(0..90)) {
            let fresh = |image: &GrayImage| {
                let mut pyramid = Pyramid::new(Level::new(), 4, 1.2);
                pyramid.build(image);
                pyramid
            };
            let mut reused = fresh(&first);
            reused.build(&second);
            for (a, b) in reused.planes().iter().zip(fresh(&second).planes()) {
                prop_assert_eq!((a.width(), a.height()), (b.width(), b.height()));
                for y in 0..a.height() {
                    prop_assert_eq!(&a.row(y)[..a.width()], &b.row(y)[..b.width()]);
                }
            }
        }
    }

    #[test]
    fn a_ramp_keeps_its_position() {
        let ramp = GrayImage::from_vec(200, 4, (0..800).map(|i| (i % 200) as u8).collect()).unwrap();
        let mut pyramid = Pyramid::new(Level::new(), 8, 1.2);
        pyramid.build(&ramp);
        for (level, plane) in pyramid.planes().iter().enumerate().take(5) {
            let scale = 1.2f32.powi(level as i32);
            for x in 1..plane.width() - 2 {
                let expected = (x as f32 + 0.5) * scale - 0.5;
                assert!(
                    (f32::from(plane.row(0)[x]) - expected).abs() <= 0.5 * (level + 1) as f32,
                    "level {level}, column {x}"
                );
            }
        }
    }
}
