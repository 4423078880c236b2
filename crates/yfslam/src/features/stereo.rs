//! Depth from a rectified stereo pair (ORB-SLAM2, IEEE T-RO 2017, section III-A).
//!
//! In: features and pyramids of both images. Out: a depth for each left feature that was matched, along its row by descriptor, then to a
//! fraction of a pixel by the sum of absolute differences (SAD) of image patches.

use fearless_simd::{Level, Simd, dispatch};

use super::{KeyPoint, OrbExtractor};
use crate::config::{FeatureConfig, StereoConfig};
use crate::features::{Descriptor, Features};
use crate::image::{GrayImage, Plane, RgbImage, gray_from_rgb};

/// The right image with its features.
#[derive(Debug)]
pub(crate) struct StereoView {
    gray: GrayImage,
    extractor: OrbExtractor,
    features: Features,
    /// Indices of the features ordered by row; row `y` has `order[start[y]..start[y + 1]]`.
    order: Vec<u32>,
    start: Vec<u32>,
}

/// Matcher of left features in the right image. Buffers are reused from frame to frame.
#[derive(Clone, Debug)]
pub(crate) struct StereoMatcher {
    config: StereoConfig,
    /// Baseline times focal length, px·m.
    bf: f32,
    max_disparity_px: f32,
    matches: Vec<StereoMatch>,
    sads: Vec<u32>,
    patch: Patch,
}

/// A left feature that was matched in the right image.
#[derive(Clone, Copy, Debug)]
struct StereoMatch {
    feature: u32,
    disparity_px: f32,
    sad: u32,
}

impl StereoView {
    /// Makes a view without features; `config` configures the extractor.
    pub(crate) fn new(config: &FeatureConfig) -> Self {
        Self {
            gray: GrayImage::default(),
            extractor: OrbExtractor::new(config),
            features: Features::default(),
            order: Vec::new(),
            start: Vec::new(),
        }
    }

    /// Extracts about `count` features of `image`.
    pub(crate) fn extract(&mut self, image: &RgbImage, count: usize) {
        gray_from_rgb(image, &mut self.gray);
        self.extractor.set_count(count);
        self.extractor.extract(&self.gray, &mut self.features);
        self.sort_by_row();
    }

    /// Sorts the features by row, by counting sort.
    fn sort_by_row(&mut self) {
        let points = &self.features.key_points;
        self.start.clear();
        self.start.resize(self.gray.height() + 1, 0);
        self.order.clear();
        self.order.resize(points.len(), 0);
        let row = |point: &KeyPoint| point.y as usize;
        points.iter().for_each(|point| self.start[row(point) + 1] += 1);
        for y in 1..self.start.len() {
            self.start[y] += self.start[y - 1];
        }
        for (i, point) in points.iter().enumerate().rev() {
            // Each row is filled from its end: the entry decreases to the beginning of the row; the rotation below corrects this.
            self.start[row(point) + 1] -= 1;
            self.order[self.start[row(point) + 1] as usize] = i as u32;
        }
        self.start.rotate_left(1);
        if let Some(end) = self.start.last_mut() {
            *end = points.len() as u32;
        }
    }

    /// Returns the indices of the features in the rows from `low` to `high`, px.
    fn in_rows(&self, low: f32, high: f32) -> &[u32] {
        let Some(last) = self.start.len().checked_sub(2) else { return &[] };
        let (low, high) = ((low as usize).min(last), (high as usize).min(last));
        &self.order[self.start[low] as usize..self.start[high + 1] as usize]
    }
}

impl StereoMatcher {
    /// Makes a matcher for a stereo pair with focal length `fx`, px, and baseline times focal length `bf`, px·m.
    pub(crate) fn new(config: &StereoConfig, bf: f64, fx: f64) -> Self {
        Self {
            config: config.clone(),
            bf: bf as f32,
            max_disparity_px: (fx / config.min_depth_baselines) as f32,
            matches: Vec::new(),
            sads: Vec::new(),
            patch: Patch::default(),
        }
    }

    /// Calls `visit` with the index and the depth, m, of each feature of `left` that was matched in `right`. `extractor` must hold the
    /// pyramid of the left image.
    pub(crate) fn match_rows(
        &mut self,
        extractor: &OrbExtractor,
        left: &Features,
        right: &StereoView,
        mut visit: impl FnMut(usize, f32),
    ) {
        // Compiled for each instruction set: baseline x86-64 has no population count and sums only few differences at a time.
        dispatch!(Level::new(), simd => self.match_all(simd, extractor, left, right));
        // A mean difference below one grey level is within the noise, whatever the median.
        let pixels = (2 * self.config.window_px + 1).pow(2) as f32;
        let limit = self.config.max_sad_medians * self.median_sad().max(pixels);
        for m in self.matches.iter().filter(|m| m.sad as f32 <= limit) {
            visit(m.feature as usize, self.bf / m.disparity_px);
        }
    }

    #[inline(always)]
    fn match_all<S: Simd>(&mut self, _: S, extractor: &OrbExtractor, left: &Features, right: &StereoView) {
        self.matches.clear();
        for (i, (point, descriptor)) in left.key_points.iter().zip(&left.descriptors).enumerate() {
            let Some(guess) = self.nearest_by_descriptor(extractor, point, descriptor, right) else { continue };
            if let Some((disparity_px, sad)) = self.refine(extractor, point, guess, right)
                && disparity_px >= self.config.min_disparity_px
                && disparity_px <= self.max_disparity_px
            {
                self.matches.push(StereoMatch { feature: i as u32, disparity_px, sad });
            }
        }
    }

    /// Returns the column of the right feature with the descriptor nearest to that of a left feature, among those with a possible row,
    /// octave and disparity.
    #[inline(always)]
    fn nearest_by_descriptor(
        &self,
        extractor: &OrbExtractor,
        point: &KeyPoint,
        descriptor: &Descriptor,
        right: &StereoView,
    ) -> Option<f32> {
        let band = self.config.row_band_px * extractor.scale_factors()[usize::from(point.octave)];
        // No feature lies above row −0.5, so that a negative bound may saturate at 0.
        let candidates = right.in_rows(point.y - band, point.y + band);
        let mut best = (self.config.max_distance + 1, None);
        for &j in candidates {
            let other = &right.features.key_points[j as usize];
            let disparity_px = point.x - other.x;
            if (other.y - point.y).abs() <= band
                && other.octave.abs_diff(point.octave) <= 1
                // The position of a corner may be wrong by a pixel of its level.
                && disparity_px >= -band
                && disparity_px <= self.max_disparity_px + band
            {
                let distance = descriptor.distance(&right.features.descriptors[j as usize]);
                if distance < best.0 {
                    best = (distance, Some(other.x));
                }
            }
        }
        best.1
    }

    /// Refines the disparity to a fraction of a pixel: the left patch slides along the right image around column `guess`, both at the
    /// level of the feature. Returns the disparity, px, and the least SAD.
    #[inline(always)]
    fn refine(
        &mut self,
        extractor: &OrbExtractor,
        point: &KeyPoint,
        guess: f32,
        right: &StereoView,
    ) -> Option<(f32, u32)> {
        let octave = usize::from(point.octave);
        let scale = extractor.scale_factors()[octave];
        let at_level = |position: f32| ((position + 0.5) / scale - 0.5).round() as isize;
        let (x, y, guess) = (at_level(point.x), at_level(point.y), at_level(guess));
        let (left, right) = (&extractor.pyramid().planes()[octave], &right.extractor.pyramid().planes()[octave]);
        let (half, slide) = (self.config.window_px, self.config.slide_px);
        self.sads.clear();
        self.patch.copy_from(left, x, y, half)?;
        self.patch.slide(right, guess - slide as isize, y, 2 * slide + 1, &mut self.sads)?;
        let (best, &sad) = self.sads.iter().enumerate().min_by_key(|(_, sad)| **sad)?;
        // A minimum needs a neighbour on each side.
        let (before, after) = (*self.sads.get(best.checked_sub(1)?)?, *self.sads.get(best + 1)?);
        let (before, middle, after) = (before as f32, sad as f32, after as f32);
        let curvature = before - 2.0 * middle + after;
        let fraction = if curvature > 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
        let column = (guess - slide as isize) as f32 + best as f32 + fraction;
        Some(((x as f32 - column) * scale, sad))
    }

    /// Returns the median SAD of all matches, 0 if there are none.
    fn median_sad(&mut self) -> f32 {
        self.sads.clear();
        self.sads.extend(self.matches.iter().map(|m| m.sad));
        let middle = self.sads.len() / 2;
        if self.sads.is_empty() { 0.0 } else { *self.sads.select_nth_unstable(middle).1 as f32 }
    }
}

/// A square patch minus its mean, so that the brightness of the two images may differ.
#[derive(Clone, Debug, Default)]
struct Patch {
    half: usize,
    pixels: Vec<i16>,
    /// Column sums of the strip along which the patch slides.
    columns: Vec<u32>,
}

impl Patch {
    /// Copies the patch around (x, y) of `plane`; `None` if it exceeds the image.
    #[inline(always)]
    fn copy_from(&mut self, plane: &Plane, x: isize, y: isize, half: usize) -> Option<()> {
        self.half = half;
        self.pixels.clear();
        let rows = rows_around(plane, x, y, half, 2 * half + 1)?;
        rows.for_each(|row| self.pixels.extend(row.iter().map(|&v| i16::from(v))));
        let sum: i32 = self.pixels.iter().map(|&v| i32::from(v)).sum();
        let mean = rounded_mean(sum as u32, self.pixels.len());
        self.pixels.iter_mut().for_each(|v| *v -= mean);
        Some(())
    }

    /// Appends the SAD of the patch and `plane` at `count` positions (x, y), (x + 1, y), …; `None` if any exceeds the image.
    #[inline(always)]
    fn slide(&mut self, plane: &Plane, x: isize, y: isize, count: usize, sads: &mut Vec<u32>) -> Option<()> {
        let side = 2 * self.half + 1;
        let width = side + count - 1;
        self.columns.clear();
        self.columns.resize(width, 0);
        for row in rows_around(plane, x, y, self.half, width)? {
            self.columns.iter_mut().zip(row).for_each(|(sum, &v)| *sum += u32::from(v));
        }
        for shift in 0..count {
            let sum: u32 = self.columns[shift..shift + side].iter().sum();
            let mean = rounded_mean(sum, side * side);
            let rows = rows_around(plane, x + shift as isize, y, self.half, side)?;
            let sad = rows.zip(self.pixels.chunks_exact(side)).map(|(row, patch)| {
                let differences = row.iter().zip(patch).map(|(&v, &p)| (i16::from(v) - mean - p).unsigned_abs());
                u32::from(differences.sum::<u16>())
            });
            sads.push(sad.sum());
        }
        Some(())
    }
}

#[inline(always)]
fn rounded_mean(sum: u32, count: usize) -> i16 {
    ((2 * sum + count as u32) / (2 * count as u32).max(1)) as i16
}

/// Returns `width` pixels from column `x - half`, for each row from `y - half` to `y + half`; `None` if any lies outside the image.
#[inline(always)]
fn rows_around(plane: &Plane, x: isize, y: isize, half: usize, width: usize) -> Option<impl Iterator<Item = &[u8]>> {
    let first = usize::try_from(x).ok()?.checked_sub(half)?;
    let top = usize::try_from(y).ok()?.checked_sub(half)?;
    let inside = first + width <= plane.width() && top + 2 * half < plane.height();
    inside.then(|| (top..=top + 2 * half).map(move |row| &plane.row(row)[first..first + width]))
}
