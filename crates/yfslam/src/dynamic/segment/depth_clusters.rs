//! Depth of the object in a bounding box: Geometric Depth RANSAC (YF-SLAM, section 3.3), with checks for the cases in which it is
//! known to fail.
//!
//! In: a box, the depth image, the features of the frame; or a box and the instance mask. Out: the depth of the object.

use rand_pcg::Pcg32;

use crate::config::DynamicConfig;
use crate::config::Grouping;
use crate::detect::{BoundingBox, Detection};
use crate::dynamic::depth_group::{DepthGroup, largest_exact, largest_ransac};
use crate::dynamic::segment::mask::InstanceMask;
use crate::dynamic::track::Track;
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// Step between the sampled pixels of a box, px.
const SAMPLE_STEP: usize = 4;

/// Estimates the depth group of the object in each box. Buffers are reused.
#[derive(Clone, Debug)]
pub(crate) struct DepthClusters {
    rng: Pcg32,
    feature_depths: Vec<f32>,
    pixel_depths: Vec<f32>,
    depths_m: Vec<Option<f32>>,
}

impl Default for DepthClusters {
    fn default() -> Self {
        Self::new(0)
    }
}

impl DepthClusters {
    /// Returns an estimator whose random draws start from `seed`.
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            rng: Pcg32::new(seed, 0x5eed),
            feature_depths: Vec::new(),
            pixel_depths: Vec::new(),
            depths_m: Vec::new(),
        }
    }

    /// Returns the depth of the object in each box, m; `None` where nothing was measured.
    pub(crate) fn depths_in_boxes(
        &mut self,
        config: &DynamicConfig,
        boxes: &[Detection],
        depth: &DepthImage,
        features: &FrameFeatures,
    ) -> &[Option<f32>] {
        self.depths_m.clear();
        for detection in boxes {
            self.sample(&detection.bbox, depth, features);
            let center_m = self.foremost_group(config).map(|group| self.center(&group));
            self.depths_m.push(center_m);
        }
        &self.depths_m
    }

    /// Returns the depth of a track's object in its box, m.
    pub(crate) fn track_depth(
        &mut self,
        config: &DynamicConfig,
        track: &Track,
        depth: &DepthImage,
        features: &FrameFeatures,
    ) -> Option<f32> {
        self.sample(&track.bbox, depth, features);
        let group = self.track_group(config, track)?;
        Some(self.center(&group))
    }

    /// Returns the depth of a track's object among the cells of its box that have no label yet, m, and the number of cells in its
    /// depth group.
    pub(crate) fn unlabelled_track_depth(
        &mut self,
        config: &DynamicConfig,
        track: &Track,
        instances: &InstanceMask,
    ) -> Option<(f32, usize)> {
        self.feature_depths.clear();
        self.pixel_depths.clear();
        instances.unlabelled_depths(&track.bbox, &mut self.pixel_depths);
        self.pixel_depths.sort_unstable_by(f32::total_cmp);
        let group = self.track_group(config, track)?;
        Some((self.center(&group), group.members))
    }

    /// Returns the depth of the object in a box among the cells that have no label yet, m.
    pub(crate) fn unlabelled_object_depth(
        &mut self,
        config: &DynamicConfig,
        bbox: &BoundingBox,
        instances: &InstanceMask,
    ) -> Option<f32> {
        self.feature_depths.clear();
        self.pixel_depths.clear();
        instances.unlabelled_depths(bbox, &mut self.pixel_depths);
        self.pixel_depths.sort_unstable_by(f32::total_cmp);
        let group = self.foremost_group(config)?;
        Some(self.center(&group))
    }

    /// Samples the sorted depths of the features and of a grid of pixels inside a box.
    fn sample(&mut self, bbox: &BoundingBox, depth: &DepthImage, features: &FrameFeatures) {
        self.feature_depths.clear();
        self.feature_depths
            .extend(features.features.iter().filter(|f| bbox.contains(f.raw[0], f.raw[1])).filter_map(|f| f.depth_m));
        self.feature_depths.sort_unstable_by(f32::total_cmp);
        self.pixel_depths.clear();
        let (x0, y0) = (bbox.x_min.max(0.0) as usize, bbox.y_min.max(0.0) as usize);
        let (x1, y1) = (bbox.x_max.max(0.0) as usize, bbox.y_max.max(0.0) as usize);
        for y in (y0..y1.min(depth.raw.height())).step_by(SAMPLE_STEP) {
            let row = (x0..x1.min(depth.raw.width())).step_by(SAMPLE_STEP);
            self.pixel_depths.extend(row.filter_map(|x| depth.metres(x, y)));
        }
        self.pixel_depths.sort_unstable_by(f32::total_cmp);
    }

    /// Returns the depth group of a track's object. It is searched first around the depth that the track had.
    fn track_group(&mut self, config: &DynamicConfig, track: &Track) -> Option<DepthGroup> {
        if let Some(z) = track.depth_m {
            let reach = config.group_half_width_m + config.max_depth_step_m * track.depth_age.max(1) as f32;
            let near = within(&self.pixel_depths, z - reach, z + reach);
            let group = largest_exact(near, 2.0 * config.group_half_width_m);
            if group.is_some_and(|g| self.is_large_enough(config, &g)) {
                return group;
            }
            if track.misses > 0 {
                return None;
            }
        }
        self.foremost_group(config)
    }

    /// Returns the largest group of feature depths, as in the paper, unless a large enough share of the box's pixels is in front of
    /// it: in a box that shows mostly wall the largest group is the wall behind the person. Then the group is searched among the
    /// nearer pixels only.
    fn foremost_group(&mut self, config: &DynamicConfig) -> Option<DepthGroup> {
        let width = 2.0 * config.group_half_width_m;
        let mut group = match config.grouping {
            Grouping::Ransac => largest_ransac(&self.feature_depths, width, &mut self.rng),
            Grouping::Exact => largest_exact(&self.feature_depths, width),
        }
        .or_else(|| largest_exact(&self.pixel_depths, width))?;
        loop {
            let in_front = within(&self.pixel_depths, 0.0, group.near_m - config.group_gap_m);
            match largest_exact(in_front, width) {
                Some(nearer) if self.is_large_enough(config, &nearer) => group = nearer,
                _ => return Some(group),
            }
        }
    }

    /// Returns whether a group of pixel depths is a large enough share of the box.
    fn is_large_enough(&self, config: &DynamicConfig, group: &DepthGroup) -> bool {
        group.members as f32 >= config.group_min_share * self.pixel_depths.len() as f32
    }

    /// Returns the median depth of the pixels of a group, m.
    fn center(&self, group: &DepthGroup) -> f32 {
        let inside = within(&self.pixel_depths, group.near_m, group.far_m);
        inside.get(inside.len() / 2).copied().unwrap_or(0.5 * (group.near_m + group.far_m))
    }
}

/// Returns the part of `sorted` in [from, to].
fn within(sorted: &[f32], from: f32, to: f32) -> &[f32] {
    let start = sorted.partition_point(|z| *z < from);
    let end = sorted.partition_point(|z| *z <= to).max(start);
    &sorted[start..end]
}
