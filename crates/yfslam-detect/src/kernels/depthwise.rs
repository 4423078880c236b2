//! Depthwise convolution: one square filter per plane, zero padding `kernel / 2`, stride 1 or 2.
//!
//! A plane is copied into scratch with zeros between its rows; then every tap of the filter is a fixed distance in memory, and
//! the convolution is a correlation along one line. For stride 2 the copy parts even from odd columns, so that the taps of
//! neighbouring outputs stay neighbours. Vectors may reach past the end of a row: rows are written in order, so the next one
//! mends it, and the last one reaches into room that every plane has.

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch};

use super::matmul::{WIDEST, load};

/// Sizes that follow from those of the input, the kernel and the stride.
#[derive(Clone, Debug)]
pub(crate) struct Geometry {
    height: usize,
    width: usize,
    stride: usize,
    pad: usize,
    /// Floats from one part of a scratch row (all columns; or the even, then the odd ones) to the next: `pad` zeros, the values.
    part: usize,
    /// Floats from one scratch row to the next; the zeros of the next part stand on the right of each part, too.
    pitch: usize,
    /// Distance of each tap from an output's position in scratch.
    taps: Vec<usize>,
}

impl Geometry {
    /// For planes of `height × width`; `kernel` is 3 or 5, `stride` 1 or 2.
    pub(crate) fn new((height, width): (usize, usize), kernel: usize, stride: usize) -> Self {
        let pad = kernel / 2;
        let part = pad + width.div_ceil(stride);
        let pitch = part * stride;
        let tap = |dy: usize, dx: usize| {
            // Column `stride · x + dx − pad` of the input is column `x + (dx − pad) div stride` of part `(dx − pad) mod stride`.
            let shifted = dx + pad * (stride - 1);
            dy * pitch + shifted % stride * part + shifted / stride
        };
        let taps = (0..kernel * kernel).map(|index| tap(index / kernel, index % kernel)).collect();
        Self { height, width, stride, pad, part, pitch, taps }
    }

    /// Floats of scratch memory.
    pub(crate) fn scratch(&self) -> usize {
        (self.height + 2 * self.pad) * self.pitch + self.pad + 2 * WIDEST
    }
}

/// What to convolve: offsets into memory and the filters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Planes<'a> {
    pub(crate) inputs: &'a [usize],
    pub(crate) outputs: &'a [usize],
    pub(crate) scratch: usize,
    /// `inputs.len() × kernel²`
    pub(crate) weights: &'a [f32],
    pub(crate) bias: &'a [f32],
    pub(crate) relu: bool,
}

/// Convolves each plane with its filter.
pub(crate) fn convolve(level: Level, memory: &mut [f32], geometry: &Geometry, planes: Planes) {
    dispatch!(level, simd => {
        match geometry.taps.len() {
            9 => convolve_simd::<_, 9>(simd, memory, geometry, planes),
            _ => convolve_simd::<_, 25>(simd, memory, geometry, planes),
        }
    });
}

#[inline(always)]
fn convolve_simd<S: Simd, const TAPS: usize>(simd: S, memory: &mut [f32], geometry: &Geometry, planes: Planes) {
    simd.vectorize(
        #[inline(always)]
        || {
            let Some(taps) = geometry.taps.first_chunk::<TAPS>() else { return };
            let scratch = planes.scratch;
            let filters = planes.weights.as_chunks::<TAPS>().0.iter().zip(planes.bias);
            memory[scratch..][..geometry.scratch()].fill(0.0);
            for ((input, output), (weights, bias)) in planes.inputs.iter().zip(planes.outputs).zip(filters) {
                if geometry.stride == 1 {
                    spread(simd, memory, geometry, *input, scratch);
                } else {
                    spread_halves(simd, memory, geometry, *input, scratch);
                }
                let bottom = (geometry.height + geometry.pad) * geometry.pitch;
                for column in (bottom..bottom + 2 * WIDEST).step_by(S::f32s::LEN) {
                    zero(simd, memory, scratch + column);
                }
                correlate(simd, memory, geometry, (scratch, *output), taps, (weights, *bias, planes.relu));
            }
        },
    );
}

#[inline(always)]
fn zero<S: Simd>(simd: S, memory: &mut [f32], offset: usize) {
    S::f32s::splat(simd, 0.0).store_slice(&mut memory[offset..][..S::f32s::LEN]);
}

/// Copies a plane into scratch, for stride 1.
#[inline(always)]
fn spread<S: Simd>(simd: S, memory: &mut [f32], geometry: &Geometry, input: usize, scratch: usize) {
    let Geometry { height, width, pad, pitch, .. } = *geometry;
    for y in 0..height {
        let (from, to) = (input + y * width, scratch + (y + pad) * pitch + pad);
        for x in (0..width).step_by(S::f32s::LEN) {
            load(simd, memory, from + x).store_slice(&mut memory[to + x..][..S::f32s::LEN]);
        }
        zero(simd, memory, to + width);
    }
}

/// Copies a plane into scratch, even columns before odd ones, for stride 2.
#[inline(always)]
fn spread_halves<S: Simd>(simd: S, memory: &mut [f32], geometry: &Geometry, input: usize, scratch: usize) {
    let Geometry { height, width, pad, part, pitch, .. } = *geometry;
    for y in 0..height {
        let (from, even) = (input + y * width, scratch + (y + pad) * pitch + pad);
        let odd = even + part;
        for x in (0..width.div_ceil(2)).step_by(S::f32s::LEN) {
            let (low, high) = (load(simd, memory, from + 2 * x), load(simd, memory, from + 2 * x + S::f32s::LEN));
            low.unzip_low(high).store_slice(&mut memory[even + x..][..S::f32s::LEN]);
        }
        zero(simd, memory, odd - pad);
        for x in (0..width / 2).step_by(S::f32s::LEN) {
            let (low, high) = (load(simd, memory, from + 2 * x), load(simd, memory, from + 2 * x + S::f32s::LEN));
            low.unzip_high(high).store_slice(&mut memory[odd + x..][..S::f32s::LEN]);
        }
        zero(simd, memory, odd + width / 2);
    }
}

/// Correlates scratch at `source` with the filter.
#[inline(always)]
fn correlate<S: Simd, const TAPS: usize>(
    simd: S,
    memory: &mut [f32],
    geometry: &Geometry,
    (source, output): (usize, usize),
    taps: &[usize; TAPS],
    (weights, bias, relu): (&[f32; TAPS], f32, bool),
) {
    let floor = S::f32s::splat(simd, if relu { 0.0 } else { f32::NEG_INFINITY });
    let weights = weights.map(|weight| S::f32s::splat(simd, weight));
    let out_width = geometry.width.div_ceil(geometry.stride);
    for y in 0..geometry.height.div_ceil(geometry.stride) {
        for x in (0..out_width).step_by(S::f32s::LEN) {
            let from = source + y * geometry.stride * geometry.pitch + x;
            let mut sum = S::f32s::splat(simd, bias);
            for (tap, weight) in taps.iter().zip(weights) {
                sum = weight.mul_add(load(simd, memory, from + tap), sum);
            }
            sum.max(floor).store_slice(&mut memory[output + y * out_width + x..][..S::f32s::LEN]);
        }
    }
}
