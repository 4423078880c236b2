//! Keys of tracking.

use serde::{Deserialize, Serialize};

use super::section::config_section;

/// When the readout time of a rolling shutter is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReadoutEstimation {
    /// Never: a camera that does not tell its readout time has a global shutter.
    Never,
    /// If the camera does not tell it.
    #[default]
    Unknown,
    /// Always; if the camera tells it, the estimate is only reported.
    Always,
}

config_section! {
    /// Tracking (ORB-SLAM2, IEEE T-RO 2017, section III; ORB-SLAM, IEEE T-RO 2015, section V).
    TrackingConfig {
        /// The number of features that a frame needs to start a map.
        /// Source: ORB-SLAM2.
        init_min_features: usize = 500, in 0..=100_000, "features";
        /// The number of landmarks with depth that a frame needs to start a map.
        /// Source: chosen: the next frames are matched with these landmarks.
        init_min_landmarks: usize = 100, in 3..=100_000, "landmarks";
        /// The largest Hamming distance of a match in a search around projections.
        /// Source: ORB-SLAM2.
        hamming_high: u32 = 100, in 0..=256, "bits";
        /// The largest Hamming distance of a match that is found by descriptors alone.
        /// Source: ORB-SLAM2.
        hamming_low: u32 = 50, in 0..=256, "bits";
        /// The search radius around the position that the constant-velocity model predicts, in pixels of the finest level.
        /// Source: ORB-SLAM2.
        motion_radius_px: f32 = 15.0, in 0.1..=1000.0, "px";
        /// The number of matches below which the search with the constant-velocity model is repeated with twice the radius.
        /// Source: ORB-SLAM2.
        motion_min_matches: usize = 20, in 0..=100_000, "matches";
        /// The number of inliers with landmarks that the first pose of a frame needs.
        /// Source: ORB-SLAM2.
        motion_min_inliers: usize = 10, in 3..=100_000, "inliers";
        /// The largest ratio of the best to the second-best Hamming distance of a match with the reference keyframe.
        /// Source: ORB-SLAM2.
        reference_ratio: f32 = 0.7, in 0.0..=1.0;
        /// The number of matches with the reference keyframe that tracking by the reference keyframe needs.
        /// Source: ORB-SLAM2.
        reference_min_matches: usize = 15, in 3..=100_000, "matches";
        /// The number of visual odometry points that a frame takes from the depth of the last frame.
        /// Source: ORB-SLAM2.
        odometry_points: usize = 100, in 0..=100_000, "points";
        /// The largest number of keyframes in the local map.
        /// Source: ORB-SLAM2.
        local_keyframes: usize = 80, in 1..=10_000, "keyframes";
        /// The number of covisible keyframes among which each keyframe of the local map looks for one to add.
        /// Source: ORB-SLAM2.
        local_neighbours: usize = 10, in 0..=10_000, "keyframes";
        /// The search radius for local landmarks that are viewed within 3.6° of their mean direction, in pixels of the finest level.
        /// Source: ORB-SLAM2.
        local_radius_narrow_px: f32 = 2.5, in 0.1..=1000.0, "px";
        /// The search radius for local landmarks that are viewed from more than 3.6° off their mean direction, in pixels of the finest level.
        /// Source: ORB-SLAM2.
        local_radius_px: f32 = 4.0, in 0.1..=1000.0, "px";
        /// The factor on both search radii for local landmarks when features have depth.
        /// Source: ORB-SLAM2.
        local_radius_factor: f32 = 3.0, in 0.1..=100.0;
        /// The largest ratio of the best to the second-best Hamming distance when both features are on the same pyramid level.
        /// Source: ORB-SLAM2.
        local_ratio: f32 = 0.8, in 0.0..=1.0;
        /// The smallest cosine of the angle between the viewing direction and the mean direction from which a landmark was observed.
        /// Source: ORB-SLAM2.
        min_view_cosine: f64 = 0.5, in -1.0..=1.0;
        /// The number of keyframes up to which a submap is deleted when tracking stays lost.
        /// Source: ORB-SLAM2.
        reset_max_keyframes: usize = 5, in 0..=10_000, "keyframes";
        /// The time for which frames must have enough features without being recognised before a new submap begins.
        /// Source: chosen: it leaves time for relocalisation.
        reset_after_s: f64 = 3.0, in 0.0..=1_000_000.0, "s";
        /// The time between two frames above which the constant-velocity model is not used.
        /// Source: chosen: after it, the camera may move differently.
        max_gap_s: f64 = 0.5, in 0.000_1..=1000.0, "s";
        /// The number of inliers in the local map that a tracked frame needs.
        /// Source: ORB-SLAM2.
        local_min_inliers: usize = 30, in 3..=100_000, "inliers";
        /// When the readout time of a rolling shutter is estimated: never, if the camera does not tell it (unknown), or always, where an
        /// estimate beside the value of the camera is only reported.
        /// Source: chosen: few camera files tell it.
        estimate_readout: ReadoutEstimation = ReadoutEstimation::Unknown, any, "never, unknown, always";
        /// The number of keyframes with which frames must have been compared before the estimated readout time is final.
        /// Source: chosen: with fewer, their scatter does not tell the standard deviation.
        readout_min_keyframes: usize = 6, in 3..=10_000, "keyframes";
        /// The standard deviation of the estimated readout time up to which it is final; above it, a first estimate of more than four
        /// standard deviations is used for the time being.
        /// Source: chosen: as much as the fits of one sensor to several recordings differ.
        readout_max_sigma_ms: f64 = 2.0, in 0.0..=100.0, "ms";
        /// The estimated readout time below which the shutter is taken for global.
        /// Source: chosen: about the standard deviation of an estimate from a few seconds.
        readout_min_ms: f64 = 3.0, in 0.0..=100.0, "ms";
    }
}
