//! Method `boxes`: whatever is inside a box moves.

use crate::config::DynamicConfig;
use crate::dynamic::region::apply;
use crate::dynamic::{DynamicFilter, FilterInput, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// Takes the boxes that are certain enough as they are.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes {
    regions: Vec<Region>,
    /// Boxes whose features are needed, though they move.
    given_up: Vec<Region>,
}

impl DynamicFilter for Boxes {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        self.regions.clear();
        let certain = input.movable.iter().filter(|d| d.score >= config.open_score);
        self.regions.extend(certain.map(|d| Region { bbox: d.bbox, score: d.score, misses: 0, depth_m: None }));
        apply(config, &mut self.regions, &mut self.given_up, input.depth, features, input.sensor);
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        let regions = self.regions.iter().chain(&self.given_up).copied().collect();
        MovingMask { regions, ..MovingMask::default() }
    }
}
