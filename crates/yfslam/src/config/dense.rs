//! Keys of dense maps.

use super::section::config_section;

config_section! {
    /// Dense maps (`yfslam run --dense`, `yfslam map`).
    DenseConfig {
        /// The side of a voxel.
        /// Source: DS-SLAM.
        resolution_m: f32 = 0.05, in 0.01..=0.2, "m", basic;
        /// The depth up to which readings are surfaces and make the space before them free; farther readings only free that space.
        /// Source: chosen: DS-SLAM has 5; beyond 4 the depth steps of structured light exceed a voxel (Khoshelham and Elberink, Sensors 2012).
        max_range_m: f32 = 4.0, in 0.25..=15.0, "m", basic;
        /// The side of a cell of a keyframe patch.
        /// Source: chosen: at 2, a keyframe of 640 × 480 px takes 0.4 MB of memory.
        stride_px: usize = 2, in 1..=16, "px";
        /// The distance from the last keyframe patch at which a keyframe becomes a patch.
        /// Source: chosen: nearer views add little.
        min_move_m: f64 = 0.25, in 0.0..=1000.0, "m";
        /// The angle to the last keyframe patch at which a keyframe becomes a patch.
        /// Source: chosen: nearer views add little.
        min_turn_deg: f64 = 10.0, in 0.0..=180.0, "degrees";
        /// The time since the last keyframe patch at which a keyframe becomes a patch.
        /// Source: chosen: objects may have moved since.
        min_gap_s: f64 = 0.5, in 0.0..=1_000_000.0, "s";
        /// The distance from moving objects within which depth is not used.
        /// Source: chosen: edges in structured-light depth are inexact.
        edge_px: f32 = 8.0, in 0.0..=100.0, "px";
        /// The depth difference within 3 × 3 cells that makes an edge, to which `edge_step_share` of the depth is added.
        /// Source: chosen: sensors blur depth edges.
        edge_step_m: f32 = 0.03, in 0.0..=10.0, "m";
        /// The share of the depth that is added to `edge_step_m`.
        /// Source: chosen: noise grows with distance.
        edge_step_share: f32 = 0.05, in 0.0..=1.0;
        /// Half the side of the window over which depth is averaged, for each metre of depth.
        /// Source: chosen: noise grows with distance.
        smooth_px_per_m: f32 = 1.5, in 0.0..=20.0, "px/m";
        /// The coefficient of the square of the depth up to which a depth difference counts as noise and is averaged.
        /// Source: three times the noise of a Kinect (Nguyen et al., 3DIMPVT 2012).
        smooth_noise_per_m: f32 = 0.006, in 0.0..=1.0, "1/m";
        /// The probability that a voxel in which a reading ends is occupied.
        /// Source: OctoMap (Hornung et al., Autonomous Robots 2013).
        p_hit: f32 = 0.7, in 0.51..=0.999;
        /// The probability that a voxel through which a reading passes is occupied.
        /// Source: OctoMap.
        p_miss: f32 = 0.4, in 0.001..=0.49;
        /// The smallest probability that a voxel keeps, so that objects that appear are noticed; it must be below `occupied`.
        /// Source: OctoMap.
        clamp_min: f32 = 0.12, in 0.001..=0.49;
        /// The largest probability that a voxel keeps, so that objects that disappear are noticed; it must be above `occupied`.
        /// Source: OctoMap.
        clamp_max: f32 = 0.97, in 0.51..=0.999;
        /// The probability above which a voxel counts as occupied.
        /// Source: OctoMap.
        occupied: f32 = 0.5, in 0.15..=0.95;
        /// The part of a voxel by which a correction of the map may displace a keyframe patch before it is inserted again.
        /// Source: chosen: smaller displacements hardly change voxels.
        refit_threshold_voxels: f32 = 0.5, in 0.0..=1000.0, "voxels";
        /// The memory, in units of 10⁶ bytes, that the map of `yfslam map` and each of its products may take.
        /// Source: chosen: half of the memory of a board with 8 GB.
        max_memory_mb: usize = 4000, in 1..=1_000_000, "MB", basic;
        /// Whether keyframe patches keep the classes of static objects, which takes a fifth more memory where the detector has such classes.
        /// Source: the semantic octree of DS-SLAM.
        classes: bool = true, any, basic;
        /// The number of occupied neighbours, of 26, below which a voxel counts as an outlier.
        /// Source: chosen: surfaces have more, noise has fewer.
        min_neighbours: usize = 4, in 0..=26, "voxels";
        /// The distance from surfaces up to which the signed distance field of the mesh is kept.
        /// Source: chosen: usual for truncated signed distance fields.
        truncation_voxels: f32 = 3.0, in 1.5..=16.0, "voxels";
    }
}
