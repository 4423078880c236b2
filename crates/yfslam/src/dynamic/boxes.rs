//! Method `boxes`: every feature inside the bounding box of a movable object is excluded.
//!
//! In: detections. Out: the trust of each feature.

use crate::config::DynamicConfig;
use crate::dynamic::region::apply_regions;
use crate::dynamic::{DynamicFilter, FilterInput, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// The filter that excludes whole bounding boxes.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes {
    regions: Vec<Region>,
    /// Boxes whose features are trusted all the same, because too few others remained.
    given_up: Vec<Region>,
}

impl DynamicFilter for Boxes {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        self.regions.clear();
        let certain = input.movable.iter().filter(|d| d.score >= config.open_score);
        self.regions.extend(certain.map(|d| Region { bbox: d.bbox, score: d.score, misses: 0, depth_m: None }));
        apply_regions(config, &mut self.regions, &mut self.given_up, input.depth, features, input.sensor);
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        let regions = self.regions.iter().chain(&self.given_up).copied().collect();
        MovingMask { regions, ..MovingMask::default() }
    }
}
