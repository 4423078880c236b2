//! Measures how thick the walls of a cloud are where the camera has passed twice: drift doubles them.
//!
//! In: the dense map of a rendered world, the world. Out: the extent of the cloud across exact flat surfaces that both halves of the
//! sequence have seen. Each flat patch is looked up where the first keyframe that saw it puts it, so that only the difference between
//! the two visits counts.

use std::collections::BTreeMap;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use yfslam::dense::cloud;
use yfslam::dense::{DenseConfig, DenseError, DenseMap};
use yfslam::dense::{Voxel, voxel_at};
use yfslam_synth::World;

use super::ghost_metrics::index_of;

/// There is one patch at most in each cube of this side, m.
const PATCH_M: f32 = 0.1;
/// Distances along and across a patch within which points of the cloud belong to it, m.
const ALONG_M: f32 = 0.06;
const ACROSS_M: f32 = 0.4;
/// Distance between the pixels from whose exact depths a normal is computed, px, and the largest distance of a flat surface from its plane, m.
const STEP_PX: usize = 6;
const FLAT_M: f32 = 0.002;

/// A flat patch of an exact surface.
struct Patch {
    /// Its position by the first keyframe that saw it, in the frame of the dense map.
    position: Point3<f32>,
    normal: Vector3<f32>,
    /// Whether the first half and the second half of the sequence have seen it.
    seen: [bool; 2],
}

/// The thickness of the walls.
#[derive(Clone, Copy, Debug)]
pub struct Thickness {
    /// Patches that both halves have seen.
    pub patches: usize,
    /// Mean extent of the cloud across them, m; 0 where it has one point.
    pub mean_m: f64,
}

/// Measures the cloud of a dense map.
///
/// # Errors
/// The volume would take more memory than is allowed.
pub fn wall_thickness(map: &DenseMap, world: &World, config: &DenseConfig) -> Result<Thickness, DenseError> {
    let volume = map.volume(config, &UnitQuaternion::identity(), |_| {})?;
    let mut near: BTreeMap<Voxel, Vec<Point3<f32>>> = BTreeMap::new();
    for point in cloud(map, &volume, |_| {}) {
        let p = Point3::from(point.position_m);
        near.entry(voxel_at(&p, 1.0 / ACROSS_M)).or_default().push(p);
    }
    let extent = |patch: &Patch| {
        let [x, y, z] = voxel_at(&patch.position, 1.0 / ACROSS_M);
        let around = (0..27).filter_map(|i| near.get(&[x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]));
        let members = around.flatten().filter_map(|p| {
            let across = (p - patch.position).dot(&patch.normal);
            let along = (p - patch.position - patch.normal * across).norm();
            (along <= ALONG_M && across.abs() <= ACROSS_M).then_some(across)
        });
        let [low, high] = members.fold([f32::MAX, f32::MIN], |[low, high], v| [low.min(v), high.max(v)]);
        (low <= high).then(|| f64::from(high - low))
    };
    let extents: Vec<f64> = patches(map, world, config).filter_map(|patch| extent(&patch)).collect();
    Ok(Thickness { patches: extents.len(), mean_m: extents.iter().sum::<f64>() / extents.len().max(1) as f64 })
}

/// The patches that both halves of the sequence have seen, in the order of their positions in the world.
fn patches(map: &DenseMap, world: &World, config: &DenseConfig) -> impl Iterator<Item = Patch> {
    let camera = &world.config().camera;
    let mut patches: BTreeMap<Voxel, Patch> = BTreeMap::new();
    for one in &map.patches {
        let index = index_of(world, one.timestamp_ns);
        let (half, frame) = (2 * index / world.len().max(1), world.frame(index));
        let (in_map, in_world) = (one.t_world_cam.cast::<f32>(), frame.t_world_cam.cast::<f32>());
        let point = |u: usize, v: usize| {
            let z = *frame.exact_depth.get(u, v).filter(|z| **z > 0.0 && **z <= config.max_range_m)?;
            let [x, y] = camera.undistort(u as f64, v as f64).map(|x| x as f32);
            Some(Point3::new(x * z, y * z, z))
        };
        for v in (STEP_PX..camera.height - STEP_PX).step_by(STEP_PX) {
            for u in (STEP_PX..camera.width - STEP_PX).step_by(STEP_PX) {
                let around = [[u, v], [u - STEP_PX, v], [u + STEP_PX, v], [u, v - STEP_PX], [u, v + STEP_PX]];
                let [Some(p), Some(left), Some(right), Some(above), Some(below)] = around.map(|[u, v]| point(u, v))
                else {
                    continue;
                };
                let normal = (right - left).cross(&(below - above)).normalize();
                if [left, right, above, below].iter().any(|q| (q - p).dot(&normal).abs() > FLAT_M) {
                    continue;
                }
                let (position, normal) = (in_map * p, in_map * normal);
                let patch = patches.entry(voxel_at(&(in_world * p), 1.0 / PATCH_M));
                patch.or_insert(Patch { position, normal, seen: [false; 2] }).seen[half.min(1)] = true;
            }
        }
    }
    patches.into_values().filter(|patch| patch.seen == [true; 2])
}
