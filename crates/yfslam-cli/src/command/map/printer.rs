//! Lines of the summary that describe the map as a whole.

use nalgebra::UnitQuaternion;
use yfslam::dense::{DenseConfig, DenseMap, Volume};

/// Describes the occupancy; `each_ms` is the processor time for a keyframe.
pub fn occupancy(volume: &Volume, each_ms: f64) -> String {
    let occupied = volume.voxels().filter(|v| v.occupied).count();
    let free = volume.voxels().count() - occupied;
    format!(
        "occupancy: {occupied} voxels of {} m occupied, {free} free; {each_ms:.1} ms a keyframe, {:.0} MB\n",
        volume.config().resolution_m,
        volume.bytes() as f64 / 1e6
    )
}

/// Describes where the floor is.
pub fn floor(map: &DenseMap, turn: &UnitQuaternion<f64>, floor_m: f32) -> String {
    let first_m = map.patches.first().map_or(0.0, |patch| (turn * patch.t_world_cam).translation.z) as f32;
    format!("floor: {:.2} m below the first camera\n", first_m - floor_m)
}

/// Describes the map and the largest amount of memory that it can take, from extent, resolution and number of keyframes.
pub fn memory_bound(config: &DenseConfig, map: &DenseMap) -> String {
    let bound_mb = Volume::bytes_at_most(config, map).div_ceil(1_000_000);
    let allowed_mb = config.max_memory_mb;
    format!(
        "{} keyframes of {:.0} MB; at {} m the map takes {} MB at most (dense.max_memory_mb allows {allowed_mb} for the map, and as \
         much for a product)",
        map.patches.len(),
        map.bytes() as f64 / 1e6,
        config.resolution_m,
        bound_mb.min(allowed_mb)
    )
}
