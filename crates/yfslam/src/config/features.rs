//! Keys of feature extraction.

use super::section::config_section;

config_section! {
    /// ORB features (ORB-SLAM2, IEEE T-RO 2017, section III; Rublee et al., ICCV 2011).
    FeatureConfig {
        /// The number of features that is extracted from each image.
        /// Source: ORB-SLAM2 settings file for TUM.
        count: usize = 1000, in 1..=50_000, "features", basic;
        /// The ratio between the scales of neighbouring pyramid levels.
        /// Source: ORB-SLAM2 settings file for TUM.
        scale_factor: f32 = 1.2, in 1.01..=2.0;
        /// The number of pyramid levels.
        /// Source: ORB-SLAM2 settings file for TUM.
        levels: usize = 8, in 1..=16, "levels";
        /// The FAST threshold that is tried first in each cell.
        /// Source: ORB-SLAM2 settings file for TUM.
        fast_threshold: u8 = 20, in 1..=250, "grey levels";
        /// The FAST threshold for cells in which the first threshold finds no corner.
        /// Source: ORB-SLAM2 settings file for TUM.
        fast_threshold_low: u8 = 7, in 1..=250, "grey levels";
        /// The side of the cells in which the two FAST thresholds are tried, in pixels of the pyramid level.
        /// Source: ORB-SLAM2.
        cell_px: usize = 30, in 4..=10_000, "px";
    }
}
