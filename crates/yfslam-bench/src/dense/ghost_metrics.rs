//! Compares the occupied space of a dense map with the exact world that it shows.
//!
//! In: the dense map of a rendered world, its volume, the world. Out: the share of the occupied voxels that is right, the share of the
//! measured surfaces that is there, and the share of ghosts: voxels where something has moved through. A voxel is right if an exact
//! static surface is within `TOLERANCE_M` of its centre.

use std::collections::HashMap;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use yfslam::dense::{DenseMap, Volume};
use yfslam::dense::{Voxel, center_m, voxel_at};
use yfslam_synth::{SynthFrame, World};

/// Distance within which two surfaces are the same, m.
pub const TOLERANCE_M: f32 = 0.05;
/// Distance between the points that stand for the exact surfaces, m.
const SPACING_M: f32 = 0.0125;

/// How a dense map compares with the exact world.
#[derive(Clone, Copy, Debug, Default)]
pub struct Occupancy {
    /// Occupied voxels.
    pub occupied: usize,
    /// Share of them on exact static surfaces.
    pub precision: f64,
    /// Share of the measured static surfaces that is occupied.
    pub recall: f64,
    /// Share of the occupied voxels where something has moved and nothing static is.
    pub ghosts: f64,
}

/// Points of surfaces, in cells for the search of neighbours.
#[derive(Default)]
pub struct Points(HashMap<Voxel, Vec<Point3<f32>>>);

impl Points {
    fn insert(&mut self, p: Point3<f32>) {
        let cell = self.0.entry(voxel_at(&p, 1.0 / TOLERANCE_M)).or_default();
        if !cell.iter().any(|q| (p - q).norm_squared() < SPACING_M * SPACING_M) {
            cell.push(p);
        }
    }

    fn is_near(&self, p: &Point3<f32>) -> bool {
        let [x, y, z] = voxel_at(p, 1.0 / TOLERANCE_M);
        (0..27).any(|i| {
            let cell = self.0.get(&[x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]);
            cell.is_some_and(|points| points.iter().any(|q| (p - q).norm() <= TOLERANCE_M))
        })
    }

    fn iter(&self) -> impl Iterator<Item = &Point3<f32>> {
        self.0.values().flatten()
    }
}

/// Exact surfaces of a world in the views of a dense map, in the frame of its volume.
#[derive(Default)]
pub struct ExactSurfaces {
    /// Static surfaces.
    fixed: Points,
    /// Static surfaces that the sensor has measured.
    measured: Points,
    /// Surfaces of what moves.
    moving: Points,
}

/// The rigid motion from the world's frame to that of a dense map: the mean rotation between the poses, about the mean position.
pub fn t_map_world(map: &DenseMap, world: &World) -> Isometry3<f64> {
    let exact: Vec<_> = map.patches.iter().map(|one| world.pose(index_of(world, one.timestamp_ns))).collect();
    let pairs = || map.patches.iter().map(|one| one.t_world_cam).zip(&exact);
    let count = map.patches.len().max(1) as f64;
    let mean = |sum: Vector3<f64>| sum / count;
    let center = mean(pairs().map(|(pose, _)| pose.translation.vector).sum());
    let center_exact = mean(pairs().map(|(_, exact)| exact.translation.vector).sum());
    let rotations: Vec<UnitQuaternion<f64>> =
        pairs().map(|(pose, exact)| pose.rotation * exact.rotation.inverse()).collect();
    let first = rotations.first().copied().unwrap_or_default();
    let offset = mean(rotations.iter().map(|rotation| (rotation * first.inverse()).scaled_axis()).sum());
    let rotation = UnitQuaternion::from_scaled_axis(offset) * first;
    Isometry3::from_parts((center - rotation * center_exact).into(), rotation)
}

/// The dense map that a run without drift would have made.
pub fn with_exact_poses(map: &DenseMap, world: &World) -> DenseMap {
    let alignment = t_map_world(map, world);
    let mut exact = map.clone();
    for one in &mut exact.patches {
        one.t_world_cam = alignment * world.pose(index_of(world, one.timestamp_ns));
    }
    exact
}

/// Number of the frame with that time stamp.
pub fn index_of(world: &World, timestamp_ns: i64) -> usize {
    (timestamp_ns as f64 * 1e-9 * world.config().camera.fps).round() as usize
}

impl ExactSurfaces {
    /// The surfaces in the views of a dense map.
    pub fn of(map: &DenseMap, volume: &Volume, world: &World) -> Self {
        let mut surfaces = Self::default();
        let Some(first) = map.patches.first() else { return surfaces };
        let Some(pose) = volume.pose(0) else { return surfaces };
        let alignment = pose * first.t_world_cam.inverse() * t_map_world(map, world);
        for one in &map.patches {
            let frame = world.frame(index_of(world, one.timestamp_ns));
            surfaces.add(&frame, world, &alignment, volume.config().max_range_m);
        }
        surfaces
    }

    fn add(&mut self, frame: &SynthFrame, world: &World, alignment: &Isometry3<f64>, range_m: f32) {
        let camera = &world.config().camera;
        let pose: Isometry3<f32> = (alignment * frame.t_world_cam).cast();
        for v in (0..camera.height).step_by(2) {
            for u in (0..camera.width).step_by(2) {
                let Some(&z) = frame.exact_depth.get(u, v).filter(|z| **z > 0.0 && **z <= range_m) else { continue };
                let [x, y] = camera.undistort(u as f64, v as f64).map(|x| x as f32);
                let p = pose * Point3::new(x * z, y * z, z);
                if frame.instances.get(u, v).is_some_and(|instance| *instance > 0) {
                    self.moving.insert(p);
                } else {
                    self.fixed.insert(p);
                    if frame.frame.depth.as_ref().is_some_and(|depth| depth.metres(u, v).is_some()) {
                        self.measured.insert(p);
                    }
                }
            }
        }
    }

    /// Compares a volume with the surfaces.
    pub fn compare(&self, volume: &Volume) -> Occupancy {
        let resolution_m = volume.config().resolution_m;
        let (mut occupied, mut right, mut ghosts, mut centers) = (0usize, 0usize, 0usize, Points::default());
        for voxel in volume.voxels().filter(|voxel| voxel.occupied) {
            let center = center_m(voxel.voxel, resolution_m);
            occupied += 1;
            centers.insert(center);
            if self.fixed.is_near(&center) {
                right += 1;
            } else if self.moving.is_near(&center) {
                ghosts += 1;
            }
        }
        let (mut measured, mut present) = (0usize, 0usize);
        for p in self.measured.iter() {
            measured += 1;
            present += usize::from(centers.is_near(p));
        }
        let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
        Occupancy {
            occupied,
            precision: share(right, occupied),
            recall: share(present, measured),
            ghosts: share(ghosts, occupied),
        }
    }
}
