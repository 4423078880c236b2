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
    #[getter]
    fn timestamp_ns(&self) -> i64 {
        self.tracked.timestamp_ns
    }

    #[getter]
    fn state(&self) -> &'static str {
        state_name(self.tracked.state)
    }

    #[getter]
    fn is_tracking(&self) -> bool {
        self.tracked.state == TrackingState::Tracking
    }

    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.tracked.t_world_cam.as_ref().map(|pose| arrays::pose(py, pose)).transpose()
    }

    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.tracked.covariance.as_ref().map(|covariance| arrays::covariance(py, covariance)).transpose()
    }

    #[getter]
    fn inliers(&self) -> usize {
        self.tracked.inliers
    }

    #[getter]
    fn is_keyframe(&self) -> bool {
        self.tracked.is_keyframe
    }

    #[getter]
    fn closed_loop(&self) -> bool {
        self.tracked.loop_closure.is_some()
    }

    #[getter]
    fn reason(&self) -> Option<String> {
        self.tracked.lost_reason.map(|reason| reason.to_string())
    }

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
