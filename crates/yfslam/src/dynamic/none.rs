//! Method `none`: every feature is trusted, as in ORB-SLAM2.

use crate::config::DynamicConfig;
use crate::dynamic::{DynamicFilter, Evidence, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// Leaves the features as they come: trusted.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFilter;

impl DynamicFilter for NoFilter {
    fn before_pose(&mut self, _config: &DynamicConfig, _evidence: &Evidence<'_>, _features: &mut FrameFeatures) {}

    fn regions(&self) -> &[Region] {
        &[]
    }

    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        MovingMask::default()
    }
}
