//! The ORB extractor.
//!
//! In: a grey image. Out: about [`FeatureConfig::count`] keypoints with orientation and descriptor, finest level first (ORB-SLAM2, IEEE
//! T-RO 2017, section III; Rublee et al., ICCV 2011).

use fearless_simd::Level;

use super::brief::{Describer, PATTERN_RADIUS};
use super::cells::Cells;
use super::distribute::Distributor;
use super::fast::{self, Corners, Search};
use super::orientation::orientations;
use super::{Descriptor, KeyPoint};
use crate::config::FeatureConfig;
use crate::image::{BLUR_RADIUS, GrayImage, Plane, Pyramid, blur};

/// Width of the image border without keypoints, px of the level: the patch of each descriptor lies inside the blurred image.
const EDGE: usize = PATTERN_RADIUS + BLUR_RADIUS;

/// The features of one image; descriptor `i` belongs to keypoint `i`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// Keypoints.
    pub key_points: Vec<KeyPoint>,
    /// Descriptors of the keypoints.
    pub descriptors: Vec<Descriptor>,
}

/// Extractor of ORB features. Buffers are reused from image to image.
#[derive(Clone, Debug)]
pub struct OrbExtractor {
    config: FeatureConfig,
    level: Level,
    scale_factors: Vec<f32>,
    pyramid: Pyramid,
    corners: Vec<Corners>,
    distributor: Distributor,
    describer: Describer,
    buffers: Buffers,
}

/// Buffers for one pyramid level.
#[derive(Clone, Debug, Default)]
struct Buffers {
    scores: [Vec<u8>; 3],
    cells: Cells,
    angles: Vec<f32>,
    blurred: Plane,
    line: Vec<u8>,
}

impl OrbExtractor {
    /// Makes an extractor for images of any size.
    pub fn new(config: &FeatureConfig) -> Self {
        let level = Level::new();
        let pyramid = Pyramid::new(level, config.levels, config.scale_factor);
        let levels = pyramid.planes().len();
        Self {
            config: config.clone(),
            level,
            scale_factors: (0..levels).map(|octave| pyramid.scale_factor().powi(octave as i32)).collect(),
            pyramid,
            corners: vec![Corners::default(); levels],
            distributor: Distributor::default(),
            describer: Describer::new(),
            buffers: Buffers::default(),
        }
    }

    /// Returns the scale of each pyramid level relative to the full image, finest (1) first.
    pub(crate) fn scale_factors(&self) -> &[f32] {
        &self.scale_factors
    }

    /// Returns the pyramid of the last image.
    pub(crate) fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// Sets the number of features to extract from the next images.
    pub(crate) fn set_count(&mut self, count: usize) {
        self.config.count = count;
    }

    /// Replaces `out` by the features of `gray`; an image smaller than a patch has none.
    pub fn extract(&mut self, gray: &GrayImage, out: &mut Features) {
        out.key_points.clear();
        out.descriptors.clear();
        self.pyramid.build(gray);
        self.detect();
        self.distribute();
        self.describe(out);
    }

    /// Detects the corners of all levels; weak corners are used only in cells without strong ones.
    fn detect(&mut self) {
        let strong = self.config.fast_threshold;
        let search = Search { strong, weak: self.config.fast_threshold_low.min(strong), border: EDGE };
        for (image, corners) in self.pyramid.planes().iter().zip(&mut self.corners) {
            fast::detect(self.level, image, search, &mut self.buffers.scores, corners);
            self.buffers.cells.fill_empty(self.config.cell_px.max(1), [image.width(), image.height()], corners);
        }
    }

    /// Reduces the corners of each level to a quota. Quotas are proportional to the inverse scale; what a coarse level does not fill is added
    /// to the finer ones.
    fn distribute(&mut self) {
        let mut remaining = self.config.count;
        let mut share_left: f32 = self.scale_factors.iter().map(|scale| 1.0 / scale).sum();
        for (corners, scale) in self.corners.iter_mut().zip(&self.scale_factors).rev() {
            let share = 1.0 / scale;
            let quota = (remaining as f32 * share / share_left).round() as usize;
            self.distributor.select(&mut corners.strong, quota.min(remaining));
            remaining -= corners.strong.len();
            share_left -= share;
        }
    }

    /// Computes orientations and descriptors of the selected corners.
    fn describe(&mut self, out: &mut Features) {
        let Buffers { angles, blurred, line, .. } = &mut self.buffers;
        for (octave, (image, corners)) in self.pyramid.planes().iter().zip(&self.corners).enumerate() {
            let (corners, scale) = (&corners.strong, self.scale_factors[octave]);
            orientations(self.level, image, corners, angles);
            blur(self.level, image, blurred, line);
            self.describer.describe(self.level, blurred, corners, angles, &mut out.descriptors);
            out.key_points.extend(corners.iter().zip(angles.iter()).map(|(corner, &angle_rad)| KeyPoint {
                x: (f32::from(corner.x) + 0.5) * scale - 0.5,
                y: (f32::from(corner.y) + 0.5) * scale - 0.5,
                octave: octave as u8,
                angle_rad,
                response: f32::from(corner.score),
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a checkerboard of random greys with fields of 8 px.
    fn texture(width: usize, height: usize) -> GrayImage {
        let data = (0..width * height).map(|i| {
            let (x, y) = ((i % width / 8) as u32, (i / width / 8) as u32);
            (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77)).wrapping_mul(0xc2b2_ae3d).to_be_bytes()[0]
        });
        GrayImage::from_vec(width, height, data.collect()).unwrap()
    }

    #[test]
    fn any_size_is_accepted() {
        let mut extractor = OrbExtractor::new(&FeatureConfig::default());
        let mut features = Features::default();
        for (width, height) in [(0, 0), (0, 9), (1, 1), (2, 300), (38, 38), (39, 39), (40, 41), (9, 641), (641, 67)] {
            extractor.extract(&texture(width, height), &mut features);
            assert_eq!(features.key_points.len(), features.descriptors.len());
            if width.min(height) < 2 * EDGE + 1 {
                assert!(features.key_points.is_empty(), "{width}×{height}");
            }
        }
    }

    #[test]
    fn a_textured_image_yields_the_configured_number_of_features() {
        let mut extractor = OrbExtractor::new(&FeatureConfig::default());
        let mut features = Features::default();
        extractor.extract(&texture(640, 480), &mut features);
        assert_eq!(features.key_points.len(), 1000);
        let octaves: std::collections::BTreeSet<u8> = features.key_points.iter().map(|k| k.octave).collect();
        assert_eq!(octaves.len(), 8);
    }
}
