//! Keys of the depth of features.

use serde::{Deserialize, Serialize};

use super::section::config_section;

/// The source of the depth of features.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DepthSource {
    /// The depth image of an RGB-D camera.
    #[default]
    Image,
    /// The right image of a rectified stereo pair.
    Stereo,
    /// The motion of a single camera, whose scale is arbitrary.
    Motion,
}

config_section! {
    /// Depth of features, and its noise.
    DepthConfig {
        /// The source of depth: the depth image of an RGB-D camera (image), a rectified stereo pair (stereo), or the motion of a single
        /// camera (motion).
        /// Source: chosen: RGB-D cameras are the main use.
        source: DepthSource = DepthSource::Image, any, "image, stereo, motion", basic;
        /// The standard deviation of a feature's position at the finest level, which grows with the scale of the level.
        /// Source: ORB-SLAM2.
        corner_sigma_px: f64 = 1.0, in 0.001..=100.0, "px";
        /// The noise coefficient n of the depth, whose standard deviation at the depth z is n·z².
        /// Source: one pixel of disparity in the ORB-SLAM2 settings file for TUM, where 1 / bf is 0.025.
        noise_per_m: f64 = 0.025, in 0.000_001..=10.0, "1/m", basic;
        /// The depth, in baselines of the sensor (bf / fx), up to which every feature becomes a landmark at once.
        /// Source: ThDepth in the ORB-SLAM2 settings file for TUM.
        close_limit_baselines: f64 = 40.0, in 0.001..=1_000_000.0, "baselines";
        /// The depth from which on readings of the depth image are ignored.
        /// Source: chosen: farther readings of structured-light cameras are noise.
        max_m: f64 = 20.0, in 0.01..=10_000.0, "m", basic;
    }
}

config_section! {
    /// Depth from a rectified stereo pair (ORB-SLAM2, IEEE T-RO 2017, section III-A).
    StereoConfig {
        /// The number of features in the right image as a multiple of that in the left image.
        /// Source: chosen: with 2, seven of ten features instead of six have a depth.
        right_feature_factor: f64 = 2.0, in 1.0..=10.0;
        /// The smallest depth that is searched, in baselines.
        /// Source: chosen: nearer objects are outside the other image.
        min_depth_baselines: f64 = 2.0, in 0.001..=10_000.0, "baselines";
        /// The smallest disparity that gives a depth.
        /// Source: chosen: smaller disparities give very uncertain depths.
        min_disparity_px: f32 = 1.0, in 0.001..=1000.0, "px";
        /// The distance from the row of a left feature within which right features are searched, in pixels of the finest level.
        /// Source: chosen: corners are exact to a pixel of their level.
        row_band_px: f32 = 2.0, in 0.0..=100.0, "px";
        /// The largest Hamming distance of a match.
        /// Source: chosen: between the two limits of ORB-SLAM2, 50 and 100.
        max_distance: u32 = 75, in 0..=256, "bits";
        /// Half the side of the patches that are compared, in pixels of the pyramid level.
        /// Source: ORB-SLAM2.
        window_px: usize = 5, in 1..=15, "px";
        /// The distance that the patch is moved to either side, in pixels of the pyramid level.
        /// Source: ORB-SLAM2.
        slide_px: usize = 5, in 1..=30, "px";
        /// The largest difference of two matching patches as a multiple of the median difference.
        /// Source: chosen: matches that differ far more than most are wrong.
        max_sad_medians: f32 = 3.0, in 0.0..=1000.0;
        /// The standard deviation of a disparity at the finest level, which grows with the scale of the level.
        /// Source: chosen: on rendered pairs it gave smaller errors than 0.5 or than ORB-SLAM2's 1.
        disparity_sigma_px: f64 = 0.25, in 0.001..=100.0, "px";
    }
}
