//! Memory of the dense map of a corridor of 100 m at 5 cm: below 300 MB.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::camera::Camera;
use crate::dense::voxels::voxel_at;
use crate::dense::{CellGrid, DenseConfig, DenseMap, KeyframePatch, Volume};

/// Half the width of the corridor, m.
const WALL_M: f32 = 1.2;
/// Distance of floor and ceiling from the camera, m.
const FLOOR_M: f32 = 1.35;
/// Distance between patches, m: a robot at 0.4 m/s makes one each half second.
const STEP_M: f32 = 0.2;

/// Returns the depth of a cell of a camera in the corridor, turned by `angle` about its vertical axis; the range of the sensor is 8
/// m.
fn depth_m([x, y]: [f32; 2], angle: f32) -> f32 {
    let (sin, cos) = angle.sin_cos();
    let lateral = (cos * x + sin).abs();
    let z = (WALL_M / lateral.max(1e-3)).min(FLOOR_M / y.abs().max(1e-3));
    if z < 8.0 { z } else { 0.0 }
}

#[test]
fn a_corridor_of_100_m_fits_into_300_mb() {
    let camera = Camera::pinhole(640, 480, 535.4, 539.2, 320.1, 247.6);
    let config = DenseConfig::default();
    let grid = CellGrid::new(&camera, config.stride_px);
    // The camera is directed ahead, a little to the left, ahead, a little to the right, in turn.
    let angle = |k: usize| [0.0, 0.35, 0.0, -0.35][k % 4];
    let patch = |k: usize| {
        let position = Vector3::new(0.0, 0.0, f64::from(STEP_M) * k as f64);
        let depths_m = grid.rays().iter().map(|ray| depth_m(*ray, angle(k)));
        (Isometry3::new(position, Vector3::y() * f64::from(angle(k))), KeyframePatch::of_depths(depths_m, [128; 3]))
    };
    let dense_map = DenseMap::of_poses(grid.clone(), (0..(100.0 / STEP_M) as usize).map(patch));
    let volume = dense_map.volume(&config, &UnitQuaternion::identity(), |_| {}).unwrap();
    let megabytes = |bytes: usize| bytes as f64 / 1e6;
    let (patches, voxels) = (megabytes(dense_map.bytes()), megabytes(volume.bytes()));
    println!("{} keyframes: patches {patches:.0} MB, volume {voxels:.0} MB", dense_map.patches.len());
    assert!(patches + voxels < 300.0, "{patches} MB and {voxels} MB");
    let limit = megabytes(Volume::bytes_at_most(&config, &dense_map));
    assert!(voxels <= limit, "{voxels} MB, limit {limit} MB");
    // The map shows the corridor: walls on both sides, free in the middle, along the whole length.
    for k in 0..90 {
        let at = |x: f32| voxel_at(&[x, 0.3, 3.0 + k as f32].into(), 20.0);
        assert!(volume.is_occupied(at(WALL_M)) || volume.is_occupied(at(WALL_M - 0.05)), "{k} m: the right wall");
        assert!(volume.is_occupied(at(-WALL_M)) || volume.is_occupied(at(-WALL_M - 0.05)), "{k} m: the left wall");
        assert!(volume.get(at(0.0)).is_some_and(|known| !known.occupied), "{k} m: the middle");
    }
}
