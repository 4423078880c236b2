//! Where depth comes from, and how good it is.

use serde::{Deserialize, Serialize};

use super::{FieldDocs, config_section};

/// Where a feature's depth comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DepthSource {
    /// The depth image of an RGB-D camera.
    #[default]
    Image,
    /// The right picture of a rectified stereo pair.
    Stereo,
    /// The motion of the camera alone, whose scale then is arbitrary: monocular.
    Motion,
}

config_section! {
    /// What the sensor measures, and how well.
    DepthConfig {
        /// Where a feature's depth comes from: `image` (the depth image), `stereo` (the right picture) or `motion` (the camera's way
        /// alone, monocular).
        source: DepthSource = DepthSource::Image,
        /// Standard deviation of a corner's position at the finest level, px; grows with the scale of the level. Source: ORB-SLAM2.
        corner_sigma_px: f64 = 1.0,
        /// n in sigma_z = n z^2, 1/m. ORB-SLAM2's one pixel of disparity amounts to 1/bf = 0.025 at the finest level.
        noise_per_m: f64 = 0.025,
        /// Depth up to which a feature becomes a landmark at once, in baselines (bf / fx). Source: ORB-SLAM2's ThDepth.
        close_limit_baselines: f64 = 40.0,
        /// Readings beyond are ignored, m. Structured-light cameras see noise there.
        max_m: f64 = 20.0,
    }
}

config_section! {
    /// Depth from a rectified stereo pair (ORB-SLAM2, IEEE T-RO 2017, section III-A).
    StereoConfig {
        /// Features asked for in the right picture, as a multiple of those in the left: more of them, and more are found again. With 2,
        /// seven of ten instead of six have a depth.
        right_features: f64 = 2.0,
        /// Least depth that is sought, in baselines: nearer static_objects lie where the other picture does not reach.
        min_depth_baselines: f64 = 2.0,
        /// Least disparity that counts as a depth, px.
        min_disparity_px: f32 = 1.0,
        /// Distance from its row in which a feature is sought, px at the finest level: corners are found to a pixel of their level.
        row_band_px: f32 = 2.0,
        /// Largest Hamming distance of a match. Between ORB-SLAM2's TH_LOW and TH_HIGH.
        max_distance: u32 = 75,
        /// Half the side of the patches that are laid upon each other, px of the level.
        window_px: usize = 5,
        /// Distance over which the patch slides each way, px of the level.
        slide_px: usize = 5,
        /// Patches that differ by more than this times the median difference are no match.
        max_sad_medians: f32 = 3.0,
        /// Standard deviation of a disparity at the finest level, px; grows with the scale of the level. On rendered pairs it is 0.1 for two
        /// of three features, 0.2 for nine of ten, and 0.25 gave smaller errors of the trajectory than 0.5 or 1. ORB-SLAM2 has 1.
        disparity_sigma_px: f64 = 0.25,
    }
}
