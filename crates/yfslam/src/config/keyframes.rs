//! Keys of keyframe insertion.

use super::section::config_section;

config_section! {
    /// Keyframe insertion (ORB-SLAM2, IEEE T-RO 2017, section III-E).
    KeyframeConfig {
        /// A frame becomes a keyframe when it has fewer inliers than this share of the landmarks of the reference keyframe.
        /// Source: chosen: ORB-SLAM2 has 0.75, with matching that accepts more.
        reference_ratio: f64 = 0.85, in 0.0..=1.0;
        /// The value of `reference_ratio` while the submap has fewer than two keyframes.
        /// Source: ORB-SLAM2.
        first_reference_ratio: f64 = 0.4, in 0.0..=1.0;
        /// The number of tracked close features below which a frame can become a keyframe for its untracked close features.
        /// Source: ORB-SLAM2, section III-E.
        close_tracked: usize = 100, in 0..=100_000, "features";
        /// The number of untracked close features above which a frame with few tracked close features becomes a keyframe.
        /// Source: ORB-SLAM2, section III-E.
        close_untracked: usize = 70, in 0..=100_000, "features";
        /// The number of inliers that a keyframe needs.
        /// Source: ORB-SLAM2.
        min_inliers: usize = 15, in 3..=100_000, "inliers";
        /// The observation weight from which a landmark of the reference keyframe is counted, where an observation with depth weighs 2
        /// and any other weighs 1.
        /// Source: ORB-SLAM2.
        min_observation_weight: usize = 3, in 0..=1000;
        /// The smallest number of frames between two keyframes, unless the second is urgent by `urgent_ratio` or its close features.
        /// Source: chosen: the time that local mapping takes for a keyframe in ORB-SLAM2.
        min_frames: u64 = 5, in 0..=100_000, "frames";
        /// A keyframe is urgent when the frame has fewer inliers than this share of the landmarks of the reference keyframe.
        /// Source: ORB-SLAM2.
        urgent_ratio: f64 = 0.25, in 0.0..=1.0;
    }
}
