//! Image pyramid by bilinear resampling.
//!
//! In: a grey image. Out: the same image at scales 1, 1/s, 1/s², … Pixel areas are aligned: the centre of pixel `x` of
//! level `l` lies at `(x + 0.5) · s^l − 0.5` of level 0.

use super::GrayImage;

/// A stack of images, each `scale_factor` times smaller than the one before; buffers are reused from frame to frame.
#[derive(Clone, Debug)]
pub struct Pyramid {
    scale_factor: f32,
    levels: Vec<GrayImage>,
}

impl Pyramid {
    /// An empty pyramid of `levels` levels (at least 1), each `scale_factor` (at least 1) times smaller than the one before.
    pub fn new(levels: usize, scale_factor: f32) -> Self {
        Self { scale_factor: scale_factor.max(1.0), levels: vec![GrayImage::default(); levels.max(1)] }
    }

    /// Fills all levels from `image`, which becomes level 0.
    pub fn build(&mut self, image: &GrayImage) {
        let Some((base, rest)) = self.levels.split_first_mut() else { return };
        base.resize(image.width(), image.height());
        base.data_mut().copy_from_slice(image.data());
        let mut finer = &*base;
        for level in rest {
            let size = |finer: usize| (finer as f32 / self.scale_factor).round() as usize;
            level.resize(size(finer.width()), size(finer.height()));
            resample(finer, self.scale_factor, level);
            finer = level;
        }
    }

    /// All levels, finest first.
    pub fn levels(&self) -> &[GrayImage] {
        &self.levels
    }
}

/// Index of the left neighbour and weight of the right one in 1/256 for the output pixel `i`.
fn tap(i: usize, scale: f32, len: usize) -> (usize, u16) {
    let position = ((i as f32 + 0.5) * scale - 0.5).clamp(0.0, (len - 1) as f32);
    let fixed = (position * 256.0).round() as usize;
    let left = (fixed >> 8).min(len.saturating_sub(2));
    (left, (fixed - (left << 8)) as u16)
}

/// Weighted mean of `a` and `b`, rounded; `weight` of `b` in 1/256.
#[inline(always)]
fn lerp(a: u8, b: u8, weight: u16) -> u8 {
    ((u16::from(a) * (256 - weight) + u16::from(b) * weight + 128) >> 8) as u8
}

fn resample(src: &GrayImage, scale: f32, dst: &mut GrayImage) {
    if src.width() < 2 || src.height() < 2 {
        dst.resize(0, 0);
        return;
    }
    for y in 0..dst.height() {
        let (top, weight_y) = tap(y, scale, src.height());
        let (above, below) = (src.row(top), src.row(top + 1));
        for (x, out) in dst.row_mut(y).iter_mut().enumerate() {
            let (left, weight_x) = tap(x, scale, src.width());
            let a = lerp(above[left], below[left], weight_y);
            let b = lerp(above[left + 1], below[left + 1], weight_y);
            *out = lerp(a, b, weight_x);
        }
    }
}
