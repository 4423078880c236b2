//! Every constant of a single camera, with its meaning, unit and source.

use serde::{Deserialize, Serialize};

use super::{Config, DepthSource, FieldDocs, config_section};

config_section! {
    /// A single camera without depth (`--sensor mono`). Its unit of length is arbitrary: the median depth of the first landmarks is 1.
    /// (ORB-SLAM, IEEE T-RO 2015, section IV for the start, V to VII for the rest.)
    MonocularConfig {
        /// Features asked for until the map has more than `tracking.reset_max_keyframes` keyframes, as a multiple of `features.count`: it
        /// begins with those of the finest level alone. ORB-SLAM has 2.
        start_features: f64 = 3.0,
        /// Matches between two frames below which the start begins anew with the later one. Source: ORB-SLAM.
        start_min_matches: usize = 100,
        /// Distance within which a feature of the first frame is sought around where it was seen last, px. Source: ORB-SLAM.
        start_radius_px: f32 = 100.0,
        /// Ratio of best to second-best distance of a match between the two.
        start_ratio: f32 = 0.9,
        /// Samples of eight matches that are drawn: with three of ten matches wrong, eleven of them hold right ones alone.
        start_draws: usize = 200,
        /// Share of the homography in the sum of both scores above which the scene counts as a plane. Source: ORB-SLAM.
        plane_share: f64 = 0.45,
        /// Angle between two rays to a point that fixes its depth, degrees: nine times the noise of a corner.
        start_min_parallax_deg: f64 = 1.0,
        /// Points with such parallax for which it is worth to adjust two frames; a map begins with `tracking.init_min_landmarks`.
        start_min_points: usize = 50,
        /// Of the matches that fit a homography or a fundamental matrix the share that must fit its best motion, too: before both cameras
        /// and where they were seen.
        start_min_share: f64 = 0.9,
        /// Share of these points that any other motion may explain: a plane often leaves two.
        start_max_rival: f64 = 0.7,
        /// Standard deviation of the direction of the motion between the two frames, degrees, above which a start waits for a wider baseline.
        start_max_sigma_deg: f64 = 3.0,
        /// Steps of the adjustment of the two frames. Source: ORB-SLAM2.
        start_iterations: usize = 20,
        /// Stands in the place of `keyframes.reference_ratio`. Source: ORB-SLAM.
        reference_ratio: f64 = 0.9,
        /// Stands in the place of `keyframes.min_observation_weight`: a new landmark is seen from two keyframes, each of which weighs 1.
        reference_observation_weight: usize = 2,
        /// Stands in the place of `keyframes.min_frames`: points that two views fix badly want more of them soon.
        min_frames: u64 = 3,
        /// Stands in the place of `tracking.local_radius_factor`. Source: ORB-SLAM.
        local_radius_factor: f32 = 1.0,
        /// Stands in the place of `mapping.triangulation_neighbours`. Source: ORB-SLAM2.
        triangulation_neighbours: usize = 20,
        /// Stands in the place of `mapping.min_observation_weight`: a matched without depth weighs 1. Source: ORB-SLAM2.
        min_observation_weight: usize = 3,
        /// Distance between two keyframes, as a share of the median depth in the older one, below which nothing is triangulated between
        /// them. Source: ORB-SLAM.
        min_baseline_share: f64 = 0.01,
        /// Stands in the place of `tracking.reset_after_s` for a submap of at most `tracking.reset_max_keyframes`, s.
        reset_after_s: f64 = 0.5,
        /// Landmarks of a keyframe and of an old place that must agree on the similarity between them. Source: ORB-SLAM2.
        loop_min_pairs: usize = 20,
        /// Seed of the random draws.
        seed: u64 = 0,
    }
}

impl Config {
    /// The configuration as the stages use it: without depth, what section `monocular` says in the place of other keys.
    pub fn for_sensor(mut self) -> Self {
        if self.depth.source == DepthSource::Motion {
            let m = &self.monocular;
            self.keyframes.reference_ratio = m.reference_ratio;
            self.keyframes.min_observation_weight = m.reference_observation_weight;
            self.keyframes.min_frames = m.min_frames;
            self.tracking.local_radius_factor = m.local_radius_factor;
            self.mapping.triangulation_neighbours = m.triangulation_neighbours;
            self.mapping.min_observation_weight = m.min_observation_weight;
        }
        self
    }
}
