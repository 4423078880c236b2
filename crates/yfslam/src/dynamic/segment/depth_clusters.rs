//! How far away the body in a box is: Geometric Depth RANSAC (YF-SLAM section 3.3), guarded where it is known to fail.
//!
//! In: a box, the depth image, the frame's features. Out: the depth of the body.

use rand_pcg::Pcg32;

use crate::config::DynamicConfig;
use crate::config::Grouping;
use crate::detect::{BoundingBox, Detection};
use crate::dynamic::depth_group::{DepthGroup, largest_exact, largest_ransac};
use crate::dynamic::segment::mask::InstanceMask;
use crate::dynamic::tracks::Track;
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// Step between the pixels that stand for the depth of a box, px.
const SAMPLE_STEP: usize = 4;

/// Finds the depth group of the body in each box. Buffers are reused.
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
    /// Draws start from `seed`.
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            rng: Pcg32::new(seed, 0x5eed),
            feature_depths: Vec::new(),
            pixel_depths: Vec::new(),
            depths_m: Vec::new(),
        }
    }

    /// The depth of the body in each box, m; `None` where nothing was measured.
    pub(crate) fn depths_of(
        &mut self,
        config: &DynamicConfig,
        boxes: &[Detection],
        depth: &DepthImage,
        features: &FrameFeatures,
    ) -> &[Option<f32>] {
        self.depths_m.clear();
        for detection in boxes {
            self.collect(&detection.bbox, depth, features);
            let body = self.body_in_front(config).map(|group| self.center(&group));
            self.depths_m.push(body);
        }
        &self.depths_m
    }

    /// Depth of the body of a track in its box, m.
    pub(crate) fn body_of(
        &mut self,
        config: &DynamicConfig,
        track: &Track,
        depth: &DepthImage,
        features: &FrameFeatures,
    ) -> Option<f32> {
        self.collect(&track.bbox, depth, features);
        let group = self.body(config, track)?;
        Some(self.center(&group))
    }

    /// Depth of the body of a track in what other bodies leave free of its box, m, and how many of its cells that is.
    pub(crate) fn body_in(
        &mut self,
        config: &DynamicConfig,
        track: &Track,
        bodies: &InstanceMask,
    ) -> Option<(f32, usize)> {
        self.feature_depths.clear();
        self.pixel_depths.clear();
        bodies.free_depths(&track.bbox, &mut self.pixel_depths);
        self.pixel_depths.sort_unstable_by(f32::total_cmp);
        let group = self.body(config, track)?;
        Some((self.center(&group), group.members))
    }

    /// Depth of the body in a box, m, in what others leave free of it.
    pub(crate) fn thing_in(
        &mut self,
        config: &DynamicConfig,
        bbox: &BoundingBox,
        bodies: &InstanceMask,
    ) -> Option<f32> {
        self.feature_depths.clear();
        self.pixel_depths.clear();
        bodies.free_depths(bbox, &mut self.pixel_depths);
        self.pixel_depths.sort_unstable_by(f32::total_cmp);
        let group = self.body_in_front(config)?;
        Some(self.center(&group))
    }

    /// Sorted depths of the features and of a grid of pixels inside a box.
    fn collect(&mut self, bbox: &BoundingBox, depth: &DepthImage, features: &FrameFeatures) {
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

    /// The depth group of a track's body. A track that knows its depth is looked for there first.
    fn body(&mut self, config: &DynamicConfig, track: &Track) -> Option<DepthGroup> {
        if let Some(z) = track.depth_m {
            let reach = config.group_half_width_m + config.max_depth_step_m * track.depth_age.max(1) as f32;
            let near = within(&self.pixel_depths, z - reach, z + reach);
            let group = largest_exact(near, 2.0 * config.group_half_width_m);
            if group.is_some_and(|g| self.is_body(config, &g)) {
                return group;
            }
            if track.misses > 0 {
                return None;
            }
        }
        self.body_in_front(config)
    }

    /// The largest group of feature depths, as the paper has it, unless enough of the box's pixels lie in front of it: a box that is
    /// mostly wall has its largest group behind the person. Then only what is in front is asked.
    fn body_in_front(&mut self, config: &DynamicConfig) -> Option<DepthGroup> {
        let width = 2.0 * config.group_half_width_m;
        let mut group = match config.grouping {
            Grouping::Ransac => largest_ransac(&self.feature_depths, width, &mut self.rng),
            Grouping::Exact => largest_exact(&self.feature_depths, width),
        }
        .or_else(|| largest_exact(&self.pixel_depths, width))?;
        loop {
            let in_front = within(&self.pixel_depths, 0.0, group.near_m - config.group_gap_m);
            match largest_exact(in_front, width) {
                Some(nearer) if self.is_body(config, &nearer) => group = nearer,
                _ => return Some(group),
            }
        }
    }

    /// Whether a group of pixel depths is a large enough part of the box.
    fn is_body(&self, config: &DynamicConfig, group: &DepthGroup) -> bool {
        group.members as f32 >= config.group_min_share * self.pixel_depths.len() as f32
    }

    /// Median depth of the pixels of a group, m.
    fn center(&self, group: &DepthGroup) -> f32 {
        let inside = within(&self.pixel_depths, group.near_m, group.far_m);
        inside.get(inside.len() / 2).copied().unwrap_or(0.5 * (group.near_m + group.far_m))
    }
}

/// The part of `sorted` in [from, to].
fn within(sorted: &[f32], from: f32, to: f32) -> &[f32] {
    let start = sorted.partition_point(|z| *z < from);
    let end = sorted.partition_point(|z| *z <= to).max(start);
    &sorted[start..end]
}
