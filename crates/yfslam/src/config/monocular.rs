//! Keys of a single camera without depth.

use super::MAX_SEED;
use super::section::config_section;

config_section! {
    /// A single camera without depth (`--sensor mono`); the unit of length is the median depth of the first landmarks.
    /// Initialisation follows ORB-SLAM, IEEE T-RO 2015, section IV; the remaining keys follow its sections V to VII.
    MonocularConfig {
        /// The factor on `features.count` until the submap has more than `tracking.reset_max_keyframes` keyframes.
        /// Source: chosen: initialisation uses the finest level alone; ORB-SLAM has 2.
        init_feature_factor: f64 = 3.0, in 1.0..=10.0;
        /// The number of matches between two frames below which initialisation starts again with the later frame.
        /// Source: ORB-SLAM, section IV.
        init_min_matches: usize = 100, in 8..=100_000, "matches";
        /// The search radius around the last position of a feature of the first frame.
        /// Source: ORB-SLAM2.
        init_radius_px: f32 = 100.0, in 0.1..=10_000.0, "px";
        /// The largest ratio of the best to the second-best Hamming distance of a match between the two frames.
        /// Source: ORB-SLAM2.
        init_ratio: f32 = 0.9, in 0.0..=1.0;
        /// The number of RANSAC iterations, each with eight matches.
        /// Source: chosen: with three of ten matches wrong, eleven samples have correct matches only.
        init_ransac_iterations: usize = 200, in 1..=10_000, "iterations";
        /// The share of the homography in the sum of both scores above which the scene counts as a plane.
        /// Source: ORB-SLAM, section IV.
        plane_share: f64 = 0.45, in 0.0..=1.0;
        /// The smallest parallax at which a point counts as triangulated.
        /// Source: chosen: nine times the noise of a feature.
        init_min_parallax_deg: f64 = 1.0, in 0.0..=90.0, "degrees";
        /// The number of points with sufficient parallax from which on two frames are adjusted.
        /// Source: ORB-SLAM2.
        init_min_points: usize = 50, in 3..=100_000, "points";
        /// The share of the inliers of the homography or fundamental matrix that the best motion must explain.
        /// Source: ORB-SLAM2.
        init_min_inlier_share: f64 = 0.9, in 0.0..=1.0;
        /// The largest number of points that any other motion explains, as a share of those that the best motion explains.
        /// Source: chosen: a plane often has two solutions.
        init_max_rival_share: f64 = 0.7, in 0.0..=1.0;
        /// The standard deviation of the direction of motion between the two frames above which initialisation waits for a wider baseline.
        /// Source: chosen: a wider baseline gives a more certain direction.
        init_max_sigma_deg: f64 = 3.0, in 0.0..=180.0, "degrees";
        /// The number of bundle-adjustment steps for the two frames.
        /// Source: ORB-SLAM2.
        init_bundle_iterations: usize = 20, in 0..=1000, "steps";
        /// The value of `keyframes.reference_ratio` for a single camera.
        /// Source: ORB-SLAM, section V-E.
        reference_ratio: f64 = 0.9, in 0.0..=1.0;
        /// The value of `keyframes.min_observation_weight` for a single camera, whose observations weigh 1 each.
        /// Source: chosen: a new landmark is observed by two keyframes.
        reference_observation_weight: usize = 2, in 0..=1000;
        /// The value of `keyframes.min_frames` for a single camera.
        /// Source: chosen: points from two views soon need further views.
        min_frames: u64 = 3, in 0..=100_000, "frames";
        /// The value of `tracking.local_radius_factor` for a single camera.
        /// Source: ORB-SLAM2.
        local_radius_factor: f32 = 1.0, in 0.1..=100.0;
        /// The value of `mapping.triangulation_neighbours` for a single camera.
        /// Source: ORB-SLAM2.
        triangulation_neighbours: usize = 20, in 0..=1000, "keyframes";
        /// The value of `mapping.min_observation_weight` for a single camera, whose observations weigh 1 each.
        /// Source: ORB-SLAM2.
        min_observation_weight: usize = 3, in 0..=1000;
        /// The baseline of two keyframes, as a share of the median depth in the older one, below which they are not triangulated.
        /// Source: ORB-SLAM2.
        min_baseline_share: f64 = 0.01, in 0.0..=10.0;
        /// The value of `tracking.reset_after_s` for a submap of a single camera that has at most `tracking.reset_max_keyframes` keyframes.
        /// Source: chosen: a young submap is soon replaced.
        reset_after_s: f64 = 0.5, in 0.0..=1_000_000.0, "s";
        /// The number of landmarks of a keyframe and of an old place that must agree on the similarity between them.
        /// Source: ORB-SLAM2.
        loop_min_pairs: usize = 20, in 3..=100_000, "landmarks";
        /// The seed of the random draws.
        /// Source: chosen: any number will do.
        seed: u64 = 0, in 0..=MAX_SEED;
    }
}
