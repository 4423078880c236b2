//! Every constant of place recognition and loop closing.

use serde::{Deserialize, Serialize};

use super::{FieldDocs, config_section};

config_section! {
    /// Recognising places (ORB-SLAM, IEEE T-RO 2015, sections III-E and V-C).
    PlaceConfig {
        /// Largest Hamming distance of a feature to a landmark that it may show. Source: ORB-SLAM2's TH_LOW.
        max_distance: u32 = 50,
        /// Landmarks that a feature may vote for, the nearest first: the same pattern may be seen at several places.
        landmarks_per_feature: usize = 5,
        /// Places that are examined at most.
        candidates: usize = 5,
        /// Covisible keyframes that make up a place together with the best one. Source: ORB-SLAM.
        group_keyframes: usize = 10,
        /// Matches that a place needs to be examined. Source: ORB-SLAM2.
        min_matches: usize = 15,
        /// Random samples drawn at most. Source: ORB-SLAM2.
        max_draws: u32 = 300,
        /// Draws end when a better pose is less likely than one minus this. Source: ORB-SLAM2.
        confidence: f64 = 0.99,
        /// Matches that must fit a pose from three of them. Source: ORB-SLAM2.
        min_ransac_inliers: usize = 10,
        /// Matches that must fit the refined pose before more are sought with it. Source: ORB-SLAM2.
        min_refined_inliers: usize = 10,
        /// Landmarks that must fit a frame that was lost. Source: ORB-SLAM2.
        relocalise_min_inliers: usize = 50,
        /// Standard deviation of the camera's position up to which a place is believed, m: a few far landmarks fit many poses.
        max_position_sigma_m: f64 = 0.05,
        /// Of the landmarks that tracking would find from there, the share that must fit and look the same, if the camera was lost
        /// just now and can have come there since; the limit rises to `relocalise_min_match_ratio_beyond` within `max_reach_s`.
        relocalise_min_match_ratio: f64 = 0.15,
        /// The same for any other place. In corridors whose doors and lamps repeat, places that the map does not have were taken for
        /// others with up to 0.34; right ones had 0.36 to 1.2.
        relocalise_min_match_ratio_beyond: f64 = 0.4,
        /// Speed up to which a camera that is lost is thought to move on, m/s.
        max_speed_m_per_s: f64 = 1.5,
        /// Time after which it may be anywhere, s.
        max_reach_s: f64 = 3.0,
        /// Distance from a feature on something that moves within which a landmark may be hidden, px.
        hidden_radius_px: f32 = 20.0,
        /// Seed of the random draws.
        seed: u64 = 0,
    }
}

config_section! {
    /// Closing loops (ORB-SLAM, IEEE T-RO 2015, section VII; ORB-SLAM2, IEEE T-RO 2017, section III-C).
    LoopConfig {
        /// Whether loops are closed: by a rigid motion, without depth by a similarity.
        enabled: bool = true,
        /// Keyframes in a row that must agree on the old place. Source: ORB-SLAM.
        min_consistent: usize = 3,
        /// Keyframes between two loops at least. Source: ORB-SLAM2.
        min_keyframes_between: u64 = 10,
        /// Landmarks of the old place that must fit the keyframe. Source: ORB-SLAM2.
        min_inliers: usize = 40,
        /// As `relocalise_min_match_ratio`, for a keyframe in an old place: a wrong loop ruins the map.
        min_match_ratio: f64 = 0.25,
        /// The same where the loop would take away more drift than the four limits below allow, and between submaps. Opposite corridors
        /// looked alike up to 0.34, right places up to 0.95.
        min_match_ratio_of_jump: f64 = 0.5,
        /// Drift that needs no way, m.
        max_drift_m: f64 = 0.3,
        /// Drift for each metre of way, m. Feature-based RGB-D odometry drifts by a hundredth or so.
        max_drift_m_per_m: f64 = 0.05,
        /// Drift that needs no way, degrees.
        max_drift_deg: f64 = 5.0,
        /// Drift for each metre of way, degrees.
        max_drift_deg_per_m: f64 = 1.0,
        /// Drift of the scale that needs no way, as a share; without depth, when the four above are in the map's own unit.
        max_drift_scale: f64 = 0.1,
        /// Drift of the scale for each unit of way. Around an office of 10 m lengths grew or shrank by up to a fifth.
        max_drift_scale_per_m: f64 = 0.03,
        /// Shared landmarks that make an edge of the pose graph. Source: ORB-SLAM.
        strong_weight: usize = 100,
    }
}

config_section! {
    /// Pose-graph optimisation (ORB-SLAM, IEEE T-RO 2015, section VII-D).
    PoseGraphConfig {
        /// Steps at most. Source: ORB-SLAM2.
        iterations: usize = 20,
        /// It ends when a step gains less than this share of the cost.
        relative_tolerance: f64 = 1e-4,
        /// First damping, relative to the diagonal.
        initial_damping: f64 = 1e-8,
    }
}
