//! Every constant of dense maps, with its meaning, unit and source.

use serde::{Deserialize, Serialize};

use super::{ConfigError, FieldDocs, config_section};

config_section! {
    /// Dense maps (`yfslam run --dense`, `yfslam map`).
    DenseConfig {
        /// Side of a voxel, m, from 0.01 to 0.2. Source: DS-SLAM.
        resolution_m: f32 = 0.05,
        /// Depth beyond which the sensor's readings make no surface, m; up to there space is free before them. DS-SLAM has
        /// 5; beyond 4 a structured-light camera's steps are as large as a voxel (Khoshelham and Elberink, Sensors 2012).
        max_range_m: f32 = 4.0,
        /// Pixels along each side of a cell of a patch. At 2 a keyframe takes 0.4 MB of memory.
        stride_px: usize = 2,
        /// A keyframe becomes a patch if since the last one the camera has moved this far, m,
        min_move_m: f64 = 0.25,
        /// or turned this far, degrees,
        min_turn_deg: f64 = 10.0,
        /// or this time has passed, s: views that show the same cost memory and tell little.
        min_gap_s: f64 = 0.5,
        /// Distance from what moves within which depth is not believed, px: edges of structured-light depth are off by some.
        edge_px: f32 = 8.0,
        /// Difference of depth within three by three cells that makes an edge, m: this,
        edge_step_m: f32 = 0.03,
        /// and this share of the depth.
        edge_step_share: f32 = 0.05,
        /// Half the side of the window over which depth is averaged, px for each metre of depth: noise grows with distance.
        smooth_px_per_m: f32 = 1.5,
        /// Difference of depth, as a share of its square, 1/m, up to which it is noise and is averaged: three times that of a Kinect
        /// (Nguyen et al., 3DIMPVT 2012).
        smooth_noise_per_m: f32 = 0.006,
        /// Probability that a voxel in which a reading ends is occupied. Source: OctoMap (Hornung et al., Autonomous Robots 2013).
        hit: f32 = 0.7,
        /// The same for one that a reading passes. Source: OctoMap.
        miss: f32 = 0.4,
        /// Least probability that is kept, so that static_objects that arrive are noticed. Source: OctoMap.
        clamp_min: f32 = 0.12,
        /// Greatest probability that is kept, so that static_objects that leave are noticed. Source: OctoMap.
        clamp_max: f32 = 0.97,
        /// Probability from which a voxel is occupied. Source: OctoMap.
        occupied: f32 = 0.5,
        /// Part of a voxel by which a patch's surfaces may be off, after a correction of the map, before they are entered anew.
        follow_voxels: f32 = 0.5,
        /// Memory that the map of `yfslam map` may take, MB (10⁶ bytes), and each of its products beside it: where it would be more, an error
        /// says which resolution fits.
        max_memory_mb: usize = 4000,
        /// Whether patches keep the classes of static_objects, if a detector finds any that cannot move. Costs a fifth more memory then. Source:
        /// DS-SLAM's semantic octree.
        classes: bool = true,
        /// Neighbours, of 26, that a voxel needs in clouds: those with fewer are outliers.
        min_neighbours: usize = 4,
        /// Distance from the surface over which the mesh's distance field is kept, voxels.
        truncation_voxels: f32 = 3.0,
    }
}

impl DenseConfig {
    /// Checks the values with which nothing can work.
    ///
    /// # Errors
    /// For the first such value.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let probability = |p: f32| p > 0.0 && p < 1.0;
        let checks: [(&'static str, String, bool, &'static str); 12] = [
            (
                "dense.resolution_m",
                self.resolution_m.to_string(),
                (0.01..=0.2).contains(&self.resolution_m),
                "from 0.01 to 0.2 m",
            ),
            (
                "dense.max_range_m",
                self.max_range_m.to_string(),
                self.max_range_m > self.resolution_m && self.max_range_m <= 15.0,
                "longer than a voxel, at most 15 m",
            ),
            ("dense.stride_px", self.stride_px.to_string(), (1..=16).contains(&self.stride_px), "from 1 to 16 px"),
            ("dense.edge_px", self.edge_px.to_string(), (0.0..=100.0).contains(&self.edge_px), "from 0 to 100 px"),
            ("dense.hit", self.hit.to_string(), self.hit > 0.5 && self.hit < 1.0, "above 0.5, below 1"),
            ("dense.miss", self.miss.to_string(), self.miss > 0.0 && self.miss < 0.5, "above 0, below 0.5"),
            (
                "dense.clamp_min",
                self.clamp_min.to_string(),
                self.clamp_min > 0.0 && self.clamp_min < self.occupied,
                "above 0, below `occupied`",
            ),
            (
                "dense.clamp_max",
                self.clamp_max.to_string(),
                self.clamp_max > self.occupied && self.clamp_max < 1.0,
                "above `occupied`, below 1",
            ),
            ("dense.occupied", self.occupied.to_string(), probability(self.occupied), "above 0, below 1"),
            ("dense.max_memory_mb", self.max_memory_mb.to_string(), self.max_memory_mb > 0, "1 MB or more"),
            ("dense.follow_voxels", self.follow_voxels.to_string(), self.follow_voxels >= 0.0, "0 or more voxels"),
            (
                "dense.truncation_voxels",
                self.truncation_voxels.to_string(),
                (1.5..=16.0).contains(&self.truncation_voxels),
                "from 1.5 to 16 voxels",
            ),
        ];
        match checks.into_iter().find(|(.., holds, _)| !holds) {
            Some((key, value, _, must)) => Err(ConfigError { key, value, must }),
            None => Ok(()),
        }
    }
}
