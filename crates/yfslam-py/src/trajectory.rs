//! `yfslam.Trajectory`: poses over time.

use std::path::PathBuf;

use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use yfslam::Pose;
use yfslam::nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use yfslam_io::{StampedPose, TrajectoryFile, write_trajectory};

use crate::arrays::{self, rows};
use crate::error::failure;

/// Largest difference between a rotation matrix times its transpose and the identity.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// Poses, world from camera, with time stamps.
#[pyclass(frozen, module = "yfslam")]
#[derive(Clone)]
pub struct Trajectory {
    pub poses: Vec<StampedPose>,
}

#[pymethods]
impl Trajectory {
    #[new]
    fn new(timestamps_ns: PyReadonlyArray1<'_, i64>, poses: PyReadonlyArray3<'_, f64>) -> PyResult<Self> {
        let (stamps, matrices) = (timestamps_ns.as_array(), poses.as_array());
        let (count, height, width) = matrices.dim();
        if (height, width) != (4, 4) || stamps.len() != count {
            return Err(PyValueError::new_err(format!(
                "{} time stamps and poses of shape ({count}, {height}, {width}); give N int64 and (N, 4, 4) float64",
                stamps.len()
            )));
        }
        let pose = |index: usize| {
            let at = |row: usize, column: usize| matrices[[index, row, column]];
            pose_of(at).ok_or_else(|| PyValueError::new_err(format!("pose {index} is no rigid motion")))
        };
        let poses = stamps.iter().enumerate().map(|(index, &stamp)| Ok(StampedPose::new(stamp, pose(index)?)));
        Ok(Self { poses: poses.collect::<PyResult<_>>()? })
    }

    /// Times, N, int64, ns.
    #[getter]
    fn timestamps_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.poses.iter().map(|pose| pose.timestamp_ns))
    }

    /// Poses, N x 4 x 4, world from camera.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        arrays::poses(py, self.poses.iter().map(|pose| pose.t_world_cam))
    }

    /// Positions of the camera, N x 3, m.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, self.poses.iter().map(|pose| position(&pose.t_world_cam)))
    }

    /// Returns N × 8: time in s, position, quaternion x y z w.
    fn tum<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(
            py,
            self.poses.iter().map(|StampedPose { timestamp_ns, t_world_cam }| {
                let ([x, y, z], q) = (position(t_world_cam), t_world_cam.rotation.coords);
                [*timestamp_ns as f64 * 1e-9, x, y, z, q.x, q.y, q.z, q.w]
            }),
        )
    }

    /// Writes the trajectory in the format of TUM.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write_trajectory(&path, &self.poses).map_err(failure)
    }

    fn __len__(&self) -> usize {
        self.poses.len()
    }

    fn __repr__(&self) -> String {
        format!("Trajectory({} poses)", self.poses.len())
    }
}

impl Trajectory {
    pub fn of(poses: impl IntoIterator<Item = (i64, Pose)>) -> Self {
        Self { poses: poses.into_iter().map(|(stamp, pose)| StampedPose::new(stamp, pose)).collect() }
    }
}

fn position(pose: &Pose) -> [f64; 3] {
    let t = &pose.translation.vector;
    [t.x, t.y, t.z]
}

/// Returns the pose of a homogeneous matrix; `None` if it is no rigid motion.
fn pose_of(at: impl Fn(usize, usize) -> f64) -> Option<Pose> {
    let rotation = Matrix3::from_fn(&at);
    let translation = Translation3::new(at(0, 3), at(1, 3), at(2, 3));
    let last = [0, 1, 2, 3].map(|column| at(3, column));
    let is_finite = (0..16).all(|index| at(index / 4, index % 4).is_finite());
    let is_rotation = (rotation * rotation.transpose() - Matrix3::identity()).abs().max() < ROTATION_TOLERANCE
        && rotation.determinant() > 0.0;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    (is_finite && is_rotation && last == [0.0, 0.0, 0.0, 1.0]).then(|| Isometry3::from_parts(translation, rotation))
}

/// Reads a trajectory in the format of TUM, KITTI or EuRoC.
#[pyfunction]
pub fn load_trajectory(py: Python<'_>, path: PathBuf) -> PyResult<Trajectory> {
    let read = py.detach(|| TrajectoryFile::read(&path)).map_err(failure)?;
    Ok(Trajectory { poses: read.poses })
}
