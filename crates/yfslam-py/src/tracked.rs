//! `yfslam.Tracked`: the result of one frame.

use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use yfslam::TrackingState;

use crate::arrays;

/// The result of one frame.
#[pyclass(frozen, module = "yfslam")]
pub struct Tracked {
    pub tracked: yfslam::Tracked,
}

/// Returns the name of a state.
pub fn state_name(state: TrackingState) -> &'static str {
    match state {
        TrackingState::NotInitialized => "not initialised",
        TrackingState::Tracking => "tracking",
        TrackingState::Lost => "lost",
    }
}

#[pymethods]
impl Tracked {
    /// Time of the frame, ns.
    #[getter]
    fn timestamp_ns(&self) -> i64 {
        self.tracked.timestamp_ns
    }

    /// "not initialised", "tracking" or "lost".
    #[getter]
    fn state(&self) -> &'static str {
        state_name(self.tracked.state)
    }

    /// Whether the pose is known.
    #[getter]
    fn is_tracking(&self) -> bool {
        self.tracked.state == TrackingState::Tracking
    }

    /// Pose as a 4 x 4 matrix, world from camera; None unless tracking.
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.tracked.t_world_cam.as_ref().map(|pose| arrays::pose(py, pose)).transpose()
    }

    /// Covariance, 6 x 6, of the pose error d in pose @ exp(d), d = (translation in m, rotation in rad) along the axes of the camera.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.tracked.covariance.as_ref().map(|covariance| arrays::covariance(py, covariance)).transpose()
    }

    /// Matched landmarks that fit the pose.
    #[getter]
    fn inliers(&self) -> usize {
        self.tracked.inliers
    }

    /// Whether the frame became a keyframe.
    #[getter]
    fn is_keyframe(&self) -> bool {
        self.tracked.is_keyframe
    }

    /// Whether a loop was closed: all poses may have changed.
    #[getter]
    fn closed_loop(&self) -> bool {
        self.tracked.loop_closure.is_some()
    }

    /// Why the pose is not known; None while tracking.
    #[getter]
    fn reason(&self) -> Option<String> {
        self.tracked.lost_reason.map(|reason| reason.to_string())
    }

    /// Wall time of the stages, ms.
    #[getter]
    fn times_ms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let times = &self.tracked.times;
        let stages = [
            ("features", times.features),
            ("detector_wait", times.detector_wait),
            ("dynamic", times.dynamic),
            ("tracking", times.tracking),
            ("mapping", times.mapping),
            ("loops", times.loops),
            ("dense_patch", times.dense_patch),
            ("dense_map", times.dense_map),
        ];
        let dict = PyDict::new(py);
        stages.iter().try_for_each(|(name, took)| dict.set_item(name, took.as_secs_f64() * 1e3))?;
        Ok(dict)
    }

    fn __bool__(&self) -> bool {
        self.is_tracking()
    }

    fn __repr__(&self) -> String {
        let reason = self.reason().map_or_else(String::new, |reason| format!(", reason={reason:?}"));
        let Self { tracked } = self;
        format!(
            "Tracked(timestamp_ns={}, state={:?}, inliers={}{reason})",
            tracked.timestamp_ns,
            self.state(),
            tracked.inliers
        )
    }
}
