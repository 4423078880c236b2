//! Method `none`: every feature is trusted, as in ORB-SLAM2. In and out: the features, unchanged.

use crate::config::DynamicConfig;
use crate::dynamic::{DynamicFilter, FilterInput};
use crate::features::FrameFeatures;

/// The filter that leaves every feature trusted.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NoFilter;

impl DynamicFilter for NoFilter {
    fn before_pose(&mut self, _config: &DynamicConfig, _input: &FilterInput<'_>, _features: &mut FrameFeatures) {}

    fn needs_boxes(&self) -> bool {
        false
    }
}
