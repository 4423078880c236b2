//! Keys of place recognition and loop closing.

use super::MAX_SEED;
use super::section::config_section;

config_section! {
    /// Place recognition and relocalisation (ORB-SLAM, IEEE T-RO 2015, sections III-E and V-C).
    PlaceConfig {
        /// The largest Hamming distance between a feature and a landmark that it may match.
        /// Source: ORB-SLAM2.
        max_distance: u32 = 50, in 0..=256, "bits";
        /// The number of nearest landmarks for which each feature votes.
        /// Source: chosen: the same pattern can be present at several places.
        landmarks_per_feature: usize = 5, in 1..=1000, "landmarks";
        /// The largest number of places that are verified.
        /// Source: chosen: it bounds the time of a search.
        candidates: usize = 5, in 1..=1000, "places";
        /// The number of covisible keyframes that form a place together with the best keyframe.
        /// Source: ORB-SLAM.
        group_keyframes: usize = 10, in 0..=1000, "keyframes";
        /// The number of matches that a place needs to be verified.
        /// Source: ORB-SLAM2.
        min_matches: usize = 15, in 3..=100_000, "matches";
        /// The largest number of RANSAC iterations for a pose.
        /// Source: ORB-SLAM2.
        ransac_iterations: u32 = 300, in 1..=100_000, "iterations";
        /// The probability of having found the best pose at which RANSAC ends.
        /// Source: ORB-SLAM2.
        ransac_confidence: f64 = 0.99, in 0.0..=0.999_999;
        /// The number of inliers that a pose from three matches needs.
        /// Source: ORB-SLAM2.
        min_ransac_inliers: usize = 10, in 3..=100_000, "inliers";
        /// The number of inliers that the optimised pose needs before further matches are searched with it.
        /// Source: ORB-SLAM2.
        min_refined_inliers: usize = 10, in 3..=100_000, "inliers";
        /// The number of inliers that relocalisation needs.
        /// Source: ORB-SLAM2.
        relocalise_min_inliers: usize = 50, in 3..=100_000, "inliers";
        /// The largest standard deviation of the camera position at which a place is accepted.
        /// Source: chosen: a few far landmarks fit many poses.
        max_position_sigma_m: f64 = 0.05, in 0.000_1..=1000.0, "m";
        /// The match ratio that relocalisation needs right after the camera was lost, in places that it can have reached since; the ratio
        /// rises to `relocalise_min_match_ratio_far` within `search_region_s`.
        /// Source: chosen: near the last pose, wrong places are unlikely.
        relocalise_min_match_ratio: f64 = 0.15, in 0.0..=1.0;
        /// The match ratio that relocalisation needs in places that the camera cannot have reached since it was lost.
        /// Source: chosen: in corridors that repeat themselves, wrong places had up to 0.34 and correct ones 0.36 to 1.2.
        relocalise_min_match_ratio_far: f64 = 0.4, in 0.0..=1.0;
        /// The largest speed that is assumed for a lost camera.
        /// Source: chosen: walking speed.
        max_speed_m_per_s: f64 = 1.5, in 0.0..=1000.0, "m/s";
        /// The time after which a lost camera can be anywhere.
        /// Source: chosen: after it, the reachable region is as large as a room.
        search_region_s: f64 = 3.0, in 0.001..=100_000.0, "s";
        /// The distance from a dynamic feature within which a landmark may be occluded.
        /// Source: chosen: person masks are exact to some pixels.
        occlusion_radius_px: f32 = 20.0, in 0.0..=1000.0, "px";
        /// The seed of the random draws.
        /// Source: chosen: any number will do.
        seed: u64 = 0, in 0..=MAX_SEED;
    }
}

config_section! {
    /// Loop closing (ORB-SLAM, IEEE T-RO 2015, section VII; ORB-SLAM2, IEEE T-RO 2017, section III-C).
    LoopConfig {
        /// Whether loops are closed, by a rigid motion or, without depth, by a similarity.
        /// Source: ORB-SLAM.
        enabled: bool = true, any, basic;
        /// The number of consecutive keyframes that must agree on the old place.
        /// Source: ORB-SLAM, section VII-A.
        min_consistent: usize = 3, in 1..=1000, "keyframes";
        /// The smallest number of keyframes between two loops.
        /// Source: ORB-SLAM2.
        min_keyframes_between: u64 = 10, in 0..=1_000_000, "keyframes";
        /// The number of inliers with landmarks of the old place that a loop needs.
        /// Source: ORB-SLAM2.
        min_inliers: usize = 40, in 3..=100_000, "inliers";
        /// The match ratio with the old place that a loop needs.
        /// Source: chosen: a wrong loop ruins the map.
        min_match_ratio: f64 = 0.25, in 0.0..=1.0;
        /// The match ratio that a loop needs between submaps, or when it corrects more drift than the `max_drift` keys allow.
        /// Source: chosen: opposite corridors had up to 0.34, correct places up to 0.95.
        min_match_ratio_large_drift: f64 = 0.5, in 0.0..=1.0;
        /// The drift of the position that is plausible over any distance.
        /// Source: chosen: above the noise of the pose at a loop.
        max_drift_m: f64 = 0.3, in 0.0..=1000.0, "m";
        /// The drift of the position that is plausible for each metre of the trajectory.
        /// Source: chosen: feature-based RGB-D odometry drifts by about 0.01.
        max_drift_m_per_m: f64 = 0.05, in 0.0..=10.0, "m/m";
        /// The drift of the orientation that is plausible over any distance.
        /// Source: chosen: above the noise of the pose at a loop.
        max_drift_deg: f64 = 5.0, in 0.0..=180.0, "degrees";
        /// The drift of the orientation that is plausible for each metre of the trajectory.
        /// Source: chosen: well above the drift of RGB-D odometry.
        max_drift_deg_per_m: f64 = 1.0, in 0.0..=180.0, "degrees/m";
        /// The drift of the scale, as a share, that is plausible over any distance of a map without depth.
        /// Source: chosen: above the noise of the scale at a loop.
        max_drift_scale: f64 = 0.1, in 0.0..=100.0;
        /// The drift of the scale, as a share, that is plausible for each unit of the trajectory in a map without depth.
        /// Source: chosen: around an office of 10 m, the scale drifted by up to a fifth.
        max_drift_scale_per_m: f64 = 0.03, in 0.0..=100.0;
        /// The number of shared landmarks from which on a covisible pair is an edge of the pose graph.
        /// Source: ORB-SLAM, section III-D.
        strong_weight: usize = 100, in 1..=100_000, "landmarks";
    }
}
