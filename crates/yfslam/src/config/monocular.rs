//! Every constant of a single camera, with its meaning, unit and source.

use serde::{Deserialize, Serialize};

use super::{FieldDocs, config_section};

config_section! {
    /// A single camera without depth (`--sensor mono`). Its unit of length is arbitrary: the median depth of the first landmarks is 1.
    /// (ORB-SLAM, IEEE T-RO 2015, section IV for the start, V and VI for the rest.)
    MonocularConfig {
        /// Features asked for until there is a map, as a multiple of `features.count`. Source: ORB-SLAM.
        start_features: f64 = 2.0,
        /// Matches between two frames below which the start begins anew with the later one. Source: ORB-SLAM.
        start_min_matches: usize = 100,
        /// Distance within which a feature of the first frame is sought around where it was seen last, px. Source: ORB-SLAM.
        start_radius_px: f32 = 100.0,
        /// Ratio of best to second-best distance of a match between the two. Source: ORB-SLAM.
        start_ratio: f32 = 0.9,
        /// Samples of eight matches that are drawn. Source: ORB-SLAM.
        start_draws: usize = 200,
        /// Share of the homography in the sum of both scores above which the scene counts as a plane. Source: ORB-SLAM.
        plane_share: f64 = 0.45,
        /// Angle between two rays to a point that fixes its depth, degrees. Source: ORB-SLAM.
        start_min_parallax_deg: f64 = 1.0,
        /// Points with such parallax, before both cameras and where they were seen, that a start needs. Source: ORB-SLAM.
        start_min_points: usize = 50,
        /// Share of all matches with such parallax that these must be. Source: ORB-SLAM.
        start_min_share: f64 = 0.9,
        /// Share of the winner's points that any other motion may explain: a plane often leaves two. Source: ORB-SLAM.
        start_max_rival: f64 = 0.7,
        /// Seed of the random draws.
        seed: u64 = 0,
    }
}
