//! What a dense map is worth, by the exact world that it shows.
//!
//! In: a survey of a synthetic world, its volume, the world. Out: how much of the occupied space is true, how much of what was seen is
//! there, and how much of it is ghosts of what moved. A voxel is true if an exact static surface is within `TOLERANCE_M` of its middle.

use std::collections::HashMap;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use yfslam::dense::voxels::{Voxel, center_m, voxel_at};
use yfslam::dense::{Survey, Volume};
use yfslam_synth::{SynthFrame, World};

/// Distance within which two surfaces are the same, m.
pub const TOLERANCE_M: f32 = 0.05;
/// Exact surfaces are kept as points so far apart, m.
const FINE_M: f32 = 0.0125;

/// What was found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Occupancy {
    /// Voxels that are occupied.
    pub occupied: usize,
    /// Share of them on exact static surfaces.
    pub precision: f64,
    /// Share of the static surfaces seen that are occupied.
    pub recall: f64,
    /// Share of the occupied voxels where something moved and nothing stands.
    pub ghosts: f64,
}

/// Points of surfaces, to be asked whether one is near.
#[derive(Default)]
pub struct Points(HashMap<Voxel, Vec<Point3<f32>>>);

impl Points {
    fn insert(&mut self, p: Point3<f32>) {
        let at = self.0.entry(voxel_at(&p, 1.0 / TOLERANCE_M)).or_default();
        if !at.iter().any(|q| (p - q).norm_squared() < FINE_M * FINE_M) {
            at.push(p);
        }
    }

    fn is_near(&self, p: &Point3<f32>) -> bool {
        let [x, y, z] = voxel_at(p, 1.0 / TOLERANCE_M);
        (0..27).any(|i| {
            let around = self.0.get(&[x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]);
            around.is_some_and(|points| points.iter().any(|q| (p - q).norm() <= TOLERANCE_M))
        })
    }

    fn iter(&self) -> impl Iterator<Item = &Point3<f32>> {
        self.0.values().flatten()
    }
}

/// Exact surfaces of a world, in the frame of a volume.
#[derive(Default)]
pub struct Truth {
    /// All that stands still in the views of the pieces.
    standing: Points,
    /// Of it, what the sensor measured.
    measured: Points,
    /// All that moves in the views of the pieces.
    moving: Points,
}

/// The rigid motion from the world's frame to that of a survey: the mean rotation between the poses, about the mean position.
pub fn t_survey_world(survey: &Survey, world: &World) -> Isometry3<f64> {
    let exact: Vec<_> = survey.pieces.iter().map(|one| world.pose(index_of(world, one.timestamp_ns))).collect();
    let pairs = || survey.pieces.iter().map(|one| one.t_world_cam).zip(&exact);
    let count = survey.pieces.len().max(1) as f64;
    let mean = |sum: Vector3<f64>| sum / count;
    let center = mean(pairs().map(|(pose, _)| pose.translation.vector).sum());
    let center_exact = mean(pairs().map(|(_, exact)| exact.translation.vector).sum());
    let turns: Vec<UnitQuaternion<f64>> =
        pairs().map(|(pose, exact)| pose.rotation * exact.rotation.inverse()).collect();
    let first = turns.first().copied().unwrap_or_default();
    let off = mean(turns.iter().map(|turn| (turn * first.inverse()).scaled_axis()).sum());
    let rotation = UnitQuaternion::from_scaled_axis(off) * first;
    Isometry3::from_parts((center - rotation * center_exact).into(), rotation)
}

/// The survey as a run without drift would have it.
pub fn survey_of_exact_poses(survey: &Survey, world: &World) -> Survey {
    let turn = t_survey_world(survey, world);
    let mut exact = survey.clone();
    for one in &mut exact.pieces {
        one.t_world_cam = turn * world.pose(index_of(world, one.timestamp_ns));
    }
    exact
}

/// Number of the frame with that stamp.
pub fn index_of(world: &World, timestamp_ns: i64) -> usize {
    (timestamp_ns as f64 * 1e-9 * world.config().camera.fps).round() as usize
}

impl Truth {
    /// What the pieces of a survey could see.
    pub fn of(survey: &Survey, volume: &Volume, world: &World) -> Self {
        let mut truth = Self::default();
        let Some(first) = survey.pieces.first() else { return truth };
        let Some(pose) = volume.pose(0) else { return truth };
        let turn = pose * first.t_world_cam.inverse() * t_survey_world(survey, world);
        for one in &survey.pieces {
            truth.add(&world.frame(index_of(world, one.timestamp_ns)), world, &turn, volume.config().max_range_m);
        }
        truth
    }

    fn add(&mut self, shot: &SynthFrame, world: &World, turn: &Isometry3<f64>, range_m: f32) {
        let camera = &world.config().camera;
        let pose: Isometry3<f32> = (turn * shot.t_world_cam).cast();
        for v in (0..camera.height).step_by(2) {
            for u in (0..camera.width).step_by(2) {
                let Some(&z) = shot.exact_depth.get(u, v).filter(|z| **z > 0.0 && **z <= range_m) else { continue };
                let [x, y] = camera.undistort(u as f64, v as f64).map(|x| x as f32);
                let p = pose * Point3::new(x * z, y * z, z);
                if shot.instances.get(u, v).is_some_and(|instance| *instance > 0) {
                    self.moving.insert(p);
                } else {
                    self.standing.insert(p);
                    if shot.frame.depth.metres(u, v).is_some() {
                        self.measured.insert(p);
                    }
                }
            }
        }
    }

    /// How a volume compares.
    pub fn judge(&self, volume: &Volume) -> Occupancy {
        let resolution_m = volume.config().resolution_m;
        let (mut occupied, mut right, mut ghosts, mut centers) = (0usize, 0usize, 0usize, Points::default());
        for known in volume.voxels().filter(|known| known.occupied) {
            let center = center_m(known.voxel, resolution_m);
            occupied += 1;
            centers.insert(center);
            if self.standing.is_near(&center) {
                right += 1;
            } else if self.moving.is_near(&center) {
                ghosts += 1;
            }
        }
        let (mut seen, mut found) = (0usize, 0usize);
        for p in self.measured.iter() {
            seen += 1;
            found += usize::from(centers.is_near(p));
        }
        let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
        Occupancy {
            occupied,
            precision: share(right, occupied),
            recall: share(found, seen),
            ghosts: share(ghosts, occupied),
        }
    }
}
