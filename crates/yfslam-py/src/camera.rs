//! `yfslam.Camera`: a calibration, with the unit of the depth images that belong to it.

use std::path::{Path, PathBuf};

use numpy::PyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use yfslam_io::camera::{PRESETS, camera_toml, check_camera, write_camera};
use yfslam_io::{CameraSource, load_camera};

use crate::arrays::array;
use crate::error::failure;

/// First line of files with a camera.
const ABOUT: &str = "written by the Python package yfslam";

/// A checked calibration.
#[pyclass(frozen, module = "yfslam")]
#[derive(Clone)]
pub struct Camera {
    pub source: CameraSource,
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (width, height, fx, fy, cx, cy, *, distortion=Vec::new(), depth_scale=None, fps=30.0, baseline_m=None,
        readout_ms=None, depth_readout_ms=None, depth_delay_ms=None))]
    #[expect(clippy::too_many_arguments, reason = "they are named in Python")]
    fn new(
        width: usize,
        height: usize,
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        distortion: Vec<f64>,
        depth_scale: Option<f64>,
        fps: f64,
        baseline_m: Option<f64>,
        readout_ms: Option<f64>,
        depth_readout_ms: Option<f64>,
        depth_delay_ms: Option<f64>,
    ) -> PyResult<Self> {
        if !matches!(distortion.len(), 0 | 4 | 5 | 8) {
            return Err(PyValueError::new_err(format!(
                "distortion has {} values; give none, k1 k2 p1 p2, k1 k2 p1 p2 k3, or with k4 k5 k6 (OpenCV)",
                distortion.len()
            )));
        }
        let value = |index: usize| distortion.get(index).copied().unwrap_or_default();
        let mut camera = yfslam::Camera::pinhole(width, height, fx, fy, cx, cy)
            .with_distortion([0, 1, 2, 3, 4].map(value))
            .with_fps(fps);
        camera.rational = [5, 6, 7].map(value);
        if let Some(baseline_m) = baseline_m {
            camera.bf = baseline_m * fx;
        }
        (camera.readout_ms, camera.depth_readout_ms, camera.depth_delay_ms) =
            (readout_ms, depth_readout_ms, depth_delay_ms);
        let mut source = CameraSource::new(camera, 1.0, "Camera()");
        source.missing.baseline = baseline_m.is_none();
        source.missing.depth_factor = depth_scale.is_none();
        if let Some(depth_scale) = depth_scale {
            if !(depth_scale.is_finite() && depth_scale > 0.0) {
                let text = format!("depth_scale is {depth_scale}; give metres per unit, such as 0.001 for millimetres");
                return Err(PyValueError::new_err(text));
            }
            source.depth_factor = 1.0 / depth_scale;
        }
        check_camera(&source).map_err(failure)?;
        Ok(Self { source })
    }

    /// Loads a preset, such as "bonn" or "tum1", or a camera file of any common kind.
    #[staticmethod]
    fn load(spec: &Bound<'_, PyAny>) -> PyResult<Self> {
        let path: PathBuf = spec.extract()?;
        let source = load_camera(&path.to_string_lossy(), None::<&Path>).map_err(failure)?;
        Ok(Self { source })
    }

    /// Writes the camera to a file in TOML, which `load` reads.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write_camera(&path, &self.source.camera, self.source.depth_factor, ABOUT).map_err(failure)
    }

    /// Returns the camera as text in TOML.
    fn to_toml(&self) -> PyResult<String> {
        camera_toml(&self.source.camera, self.source.depth_factor, ABOUT).map_err(failure)
    }

    /// Width of the images, px.
    #[getter]
    fn width(&self) -> usize {
        self.source.camera.width
    }

    /// Height of the images, px.
    #[getter]
    fn height(&self) -> usize {
        self.source.camera.height
    }

    /// Focal length in x, px.
    #[getter]
    fn fx(&self) -> f64 {
        self.source.camera.fx
    }

    /// Focal length in y, px.
    #[getter]
    fn fy(&self) -> f64 {
        self.source.camera.fy
    }

    /// Principal point in x, px.
    #[getter]
    fn cx(&self) -> f64 {
        self.source.camera.cx
    }

    /// Principal point in y, px.
    #[getter]
    fn cy(&self) -> f64 {
        self.source.camera.cy
    }

    /// Frames per second.
    #[getter]
    fn fps(&self) -> f64 {
        self.source.camera.fps
    }

    /// Distortion coefficients k1, k2, p1, p2, k3 and, for some lenses, k4, k5, k6 (OpenCV).
    #[getter]
    fn distortion(&self) -> Vec<f64> {
        let camera = &self.source.camera;
        let rational = if camera.rational == [0.0; 3] { &[][..] } else { &camera.rational };
        camera.distortion.iter().chain(rational).copied().collect()
    }

    /// Metres per unit of 16-bit depth images; None if unknown.
    #[getter]
    fn depth_scale(&self) -> Option<f64> {
        self.scale()
    }

    /// Time from the first to the last row of an image, ms; 0 for a global shutter, None if unknown.
    #[getter]
    fn readout_ms(&self) -> Option<f64> {
        self.source.camera.readout_ms
    }

    /// Baseline of a stereo camera, m; None if unknown.
    #[getter]
    fn baseline_m(&self) -> Option<f64> {
        let camera = &self.source.camera;
        (!self.source.missing.baseline).then(|| camera.bf / camera.fx)
    }

    /// The preset or file.
    #[getter]
    fn origin(&self) -> &str {
        &self.source.origin
    }

    /// The 3 x 3 matrix of the intrinsics.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let c = &self.source.camera;
        array(py, [3, 3], vec![c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0])
    }

    fn __repr__(&self) -> String {
        let c = &self.source.camera;
        format!("Camera({}x{}, fx={}, fy={}, cx={}, cy={})", c.width, c.height, c.fx, c.fy, c.cx, c.cy)
    }
}

impl Camera {
    /// Returns the unit of 16-bit depth images, m.
    pub fn scale(&self) -> Option<f64> {
        (!self.source.missing.depth_factor).then(|| 1.0 / self.source.depth_factor)
    }

    /// Returns a camera, or the preset or file of this name.
    pub fn from_py(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        match value.cast::<Self>() {
            Ok(camera) => Ok(camera.get().clone()),
            Err(_) => Self::load(value),
        }
    }
}

/// Returns the names of the presets.
#[pyfunction]
pub fn presets() -> Vec<&'static str> {
    PRESETS.to_vec()
}
