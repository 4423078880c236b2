//! Method `boxes`: whatever is inside a box moves.

use crate::config::DynamicConfig;
use crate::dynamic::region::{Region, apply};
use crate::dynamic::{DynamicFilter, Evidence};
use crate::features::FrameFeatures;

/// Takes the boxes that are certain enough as they are.
#[derive(Clone, Debug, Default)]
pub struct Boxes {
    regions: Vec<Region>,
}

impl DynamicFilter for Boxes {
    fn before_pose(&mut self, config: &DynamicConfig, evidence: &Evidence<'_>, features: &mut FrameFeatures) {
        self.regions.clear();
        let certain = evidence.movable.iter().filter(|d| d.score >= config.open_score);
        self.regions.extend(certain.map(|d| Region { bbox: d.bbox, score: d.score, misses: 0, depth_m: None }));
        apply(config, &mut self.regions, evidence.depth, features, evidence.sensor);
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }
}
