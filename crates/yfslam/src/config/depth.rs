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
