//! The up direction of a dense map, without a gravity sensor.
//!
//! In: patches with their poses. Out: a rotation after which the z-axis points up, x to the front of the first image and y to its
//! left (ROS, REP 103). Floors, tables and ceilings are level: of all directions near the vertical of the first image, up is the
//! one along which most points share their heights.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::dense::DenseMap;

/// Greatest angle between the up direction and the vertical of the first image, degrees.
const SEARCH_DEG: f64 = 30.0;
/// Thickness of the layers in which heights are counted, m.
const LAYER_M: f64 = 0.03;
/// Number of points that are used at most.
const POINTS: usize = 20_000;

/// Which direction of the world becomes the z-axis of a dense map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Up {
    /// The direction along which most level surfaces were measured, within 30° of that of the first image.
    Level,
    /// The direction that points up in an upright first image.
    Camera,
    /// A given direction in the world of the keyframes.
    Direction(Vector3<f64>),
}

/// Returns the rotation after which the z-axis of the world points up.
pub(crate) fn turn(dense_map: &DenseMap, up: Up) -> UnitQuaternion<f64> {
    match up {
        Up::Level => of_dense_map(dense_map),
        Up::Camera => of_camera(),
        Up::Direction(direction) => from_up(&direction),
    }
}

/// Returns the rotation for an upright first image: camera x right, y down, z forward become y negative, z negative, x.
pub(crate) fn of_camera() -> UnitQuaternion<f64> {
    from_up(&-Vector3::y())
}

/// Returns the rotation that turns direction `up` of the world to z, and the horizontal part of the world's z-axis to x.
pub(crate) fn from_up(up: &Vector3<f64>) -> UnitQuaternion<f64> {
    let z = up.try_normalize(1e-9).unwrap_or(-Vector3::y());
    let level = |v: Vector3<f64>| (v - z * z.dot(&v)).try_normalize(0.1);
    let x = level(Vector3::z()).or_else(|| level(Vector3::x())).unwrap_or(Vector3::x());
    let rows = Matrix3::from_rows(&[x.transpose(), z.cross(&x).transpose(), z.transpose()]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows))
}

/// Returns the rotation from the level surfaces of the patches; that for an upright first image if there are none.
pub(crate) fn of_dense_map(dense_map: &DenseMap) -> UnitQuaternion<f64> {
    let points = sample(dense_map);
    let first = dense_map.patches.first().map_or(-Vector3::y(), |patch| patch.t_world_cam * -Vector3::y());
    let mut best = (levelness(&points, &first), first);
    let mut reach = SEARCH_DEG.to_radians();
    // Search on rings of directions around the best one, with decreasing radius.
    while reach > 0.001 {
        let center = best.1;
        let side = if center.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let (a, b) = (center.cross(&side).normalize(), center.cross(&center.cross(&side)).normalize());
        for ring in 1..=3 {
            for step in 0..12 {
                let (sin, cos) = libm::sincos(f64::from(step) * std::f64::consts::TAU / 12.0);
                let tilt = libm::tan(reach * f64::from(ring) / 3.0);
                let up = (center + (a * cos + b * sin) * tilt).normalize();
                if up.angle(&first) <= SEARCH_DEG.to_radians() {
                    let found = levelness(&points, &up);
                    if found > best.0 {
                        best = (found, up);
                    }
                }
            }
        }
        reach *= 0.5;
    }
    from_up(&best.1)
}

/// Returns the height of the floor, m along the z-axis of a turned world: the lowest layer with at least a tenth of the points of
/// the fullest one.
pub(crate) fn floor_m(dense_map: &DenseMap, turned: &UnitQuaternion<f64>) -> Option<f64> {
    let points: Vec<_> = sample(dense_map).into_iter().map(|p| turned * p).collect();
    let counts = layers(&points, &Vector3::z());
    let most = counts.values().max()?;
    let (layer, _) = counts.iter().find(|(_, count)| **count * 10 >= *most)?;
    Some((*layer as f64 + 0.5) * LAYER_M)
}

/// Returns static points of the patches in the world, m.
fn sample(dense_map: &DenseMap) -> Vec<Vector3<f64>> {
    let cells = dense_map.patches.len() * dense_map.grid.rays().len();
    let step = (cells / POINTS).max(1);
    let points = dense_map.patches.iter().flat_map(|patch| {
        let pose = patch.t_world_cam;
        patch.patch.points(&dense_map.grid, 4.0).map(move |(p, _)| (pose * p.cast::<f64>()).coords)
    });
    points.step_by(step).collect()
}

/// Returns the number of points in each layer of heights.
fn layers(points: &[Vector3<f64>], up: &Vector3<f64>) -> std::collections::BTreeMap<i64, usize> {
    let mut counts = std::collections::BTreeMap::new();
    for p in points {
        *counts.entry((up.dot(p) / LAYER_M).floor() as i64).or_insert(0) += 1;
    }
    counts
}

/// Returns how far points share their heights: the number of pairs in the same layer.
fn levelness(points: &[Vector3<f64>], up: &Vector3<f64>) -> usize {
    layers(points, up).values().map(|count| count * count).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
    use crate::dense::scene;

    #[test]
    fn an_upright_image_gives_the_axes_of_ros() {
        let turn = of_camera();
        let close = |a: Vector3<f64>, b: Vector3<f64>| assert!((a - b).norm() < 1e-9, "{a} {b}");
        close(turn * Vector3::z(), Vector3::x());
        close(turn * Vector3::x(), -Vector3::y());
        close(turn * Vector3::y(), -Vector3::z());
    }

    /// Returns a dense map of a floor 1.2 m below a camera that is tilted down by `pitch`.
    fn floor(pitch: f64) -> DenseMap {
        let grid = CellGrid::new(&scene::camera(), 2);
        let (sin, cos) = pitch.sin_cos();
        let depth = |[_, y]: &[f32; 2]| {
            let down = sin + cos * f64::from(*y);
            if down > 0.2 { (1.2 / down) as f32 } else { 0.0 }
        };
        let patch = KeyframePatch::of_depths(grid.rays().iter().map(depth), [90; 3]);
        DenseMap::of_poses(grid, [(crate::geometry::Pose::identity(), patch)])
    }

    #[test]
    fn the_floor_gives_the_up_direction_of_a_tilted_camera() {
        let (dense_map, pitch) = (floor(0.35), 0.35f64);
        let turn = of_dense_map(&dense_map);
        // The floor's normal in the frame of the camera.
        let up = turn * -Vector3::new(0.0, pitch.cos(), pitch.sin());
        assert!(up.angle(&Vector3::z()) < 0.02, "{up}");
        let floor = floor_m(&dense_map, &turn).unwrap();
        assert!((floor + 1.2).abs() < 0.06, "{floor}");
    }
}
