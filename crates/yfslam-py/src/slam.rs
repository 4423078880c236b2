//! `yfslam.Slam`: frames in, poses out.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use yfslam::dense::{DenseConfig, Up};
use yfslam::{Execution, MapUse, SavedMap, TrackingState};
use yfslam_io::write_atomically;

use crate::camera::Camera;
use crate::dense::{DenseMap, UpArg};
use crate::error::{FrameRejected, failure};
use crate::frame::{Frame, Given, detections_array};
use crate::maps::FeatureRows;
use crate::tracked::{Tracked, state_name};
use crate::trajectory::Trajectory;
use crate::{config, detector, logging, maps};

/// The system; its methods may be called from any thread, one after the other.
#[pyclass(frozen, module = "yfslam", weakref)]
pub struct Slam {
    inner: Mutex<Option<Inner>>,
    camera: Camera,
    depth_scale: Option<f64>,
    dense_config: DenseConfig,
}

struct Inner {
    slam: yfslam::Slam,
    state: TrackingState,
    live: Vec<(i64, yfslam::Pose)>,
    resets: usize,
}

#[pymethods]
impl Slam {
    #[new]
    #[pyo3(signature = (camera, *, config=None, method=None, sensor=None, detector=Detector::Embedded, map=None, localise=false,
        threaded=false, dense=false, depth_scale=None))]
    #[expect(clippy::too_many_arguments, reason = "they are named in Python")]
    fn new(
        py: Python<'_>,
        camera: &Bound<'_, PyAny>,
        config: Option<&Bound<'_, PyAny>>,
        method: Option<&str>,
        sensor: Option<&str>,
        detector: Detector<'_>,
        map: Option<&Bound<'_, PyAny>>,
        localise: bool,
        threaded: bool,
        dense: bool,
        depth_scale: Option<f64>,
    ) -> PyResult<Self> {
        logging::follow_level(py)?;
        let camera = Camera::from_py(camera)?;
        let mut settings = config::resolve(config)?;
        if let Some(method) = method {
            settings.dynamic.method = config::method(method)?;
        }
        if let Some(sensor) = sensor {
            settings.depth.source = config::sensor(sensor)?;
        }
        let detector = detector.resolve(py, &settings)?;
        if localise && map.is_none() {
            return Err(failure("localise=True needs a map; give map, such as the path of a saved map"));
        }
        let saved = map.map(saved_map).transpose()?;
        let execution = if threaded { Execution::Threaded } else { Execution::Inline };
        let source = camera.source.camera.clone();
        let dense_config = settings.dense.clone();
        let built = py.detach(|| {
            let mut builder = yfslam::Slam::builder(source).execution(execution);
            if let Some(detector) = detector {
                builder = builder.detector(detector);
            }
            if let Some(saved) = saved {
                builder = builder.map(saved, if localise { MapUse::Localise } else { MapUse::Extend });
            }
            if dense {
                builder = builder.dense(settings.dense.clone());
            }
            builder.config(settings).build()
        });
        let slam = built.map_err(failure)?;
        let state = if map.is_some() { TrackingState::Lost } else { TrackingState::NotInitialized };
        let inner = Inner { slam, state, live: Vec::new(), resets: 0 };
        let depth_scale = depth_scale.or_else(|| camera.scale());
        Ok(Self { inner: Mutex::new(Some(inner)), camera, depth_scale, dense_config })
    }

    /// Tracks a Frame, or a time stamp in ns with arrays: rgb is uint8, height x width x 3 or height x width; depth is uint16 in units of
    /// depth_scale, or float32 in metres. Lost is no error: see `state` and `reason` of the result.
    #[pyo3(signature = (frame, rgb=None, depth=None, *, right=None, depth_scale=None, depth_timestamp_ns=None, detections=None,
        mask=None))]
    #[expect(clippy::too_many_arguments, reason = "they are named in Python")]
    fn track(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        rgb: Option<&Bound<'_, PyAny>>,
        depth: Option<&Bound<'_, PyAny>>,
        right: Option<&Bound<'_, PyAny>>,
        depth_scale: Option<f64>,
        depth_timestamp_ns: Option<i64>,
        detections: Option<&Bound<'_, PyAny>>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Tracked> {
        let frame = match (frame.cast::<Frame>(), rgb) {
            // Images are shared, not copied.
            (Ok(frame), None) => frame.get().frame.clone(),
            (Err(_), Some(rgb)) => {
                let depth_scale = depth_scale.or(self.depth_scale);
                let given = Given { rgb, depth, right, depth_scale, depth_timestamp_ns, detections, mask };
                given.frame(frame.extract()?)?
            }
            _ => {
                let text = "track() takes a Frame alone, or a time stamp in ns, an image and, for RGB-D cameras, a depth image";
                return Err(pyo3::exceptions::PyTypeError::new_err(text));
            }
        };
        let result = self.with(py, |inner| inner.track(&frame))?;
        logging::hand_over(py)?;
        match result {
            Ok(tracked) => Ok(Tracked { tracked }),
            Err(rejected) => Err(FrameRejected::new_err(rejected.to_string())),
        }
    }

    /// Waits until mapping is finished, and returns the trajectory.
    fn finish(&self, py: Python<'_>) -> PyResult<Trajectory> {
        let trajectory = self.with(py, |inner| {
            inner.slam.finish_mapping();
            Trajectory::of(inner.slam.trajectory())
        });
        logging::hand_over(py)?;
        trajectory
    }

    /// Returns the poses of all tracked frames as the map has them now.
    fn trajectory(&self, py: Python<'_>) -> PyResult<Trajectory> {
        self.with(py, |inner| Trajectory::of(inner.slam.trajectory()))
    }

    /// Returns the poses for each submap, each in its own world.
    fn trajectories(&self, py: Python<'_>) -> PyResult<Vec<Trajectory>> {
        self.with(py, |inner| inner.slam.trajectories().into_iter().map(Trajectory::of).collect())
    }

    /// Returns the poses as they were estimated at the time of each frame.
    fn live_trajectory(&self, py: Python<'_>) -> PyResult<Trajectory> {
        self.with(py, |inner| Trajectory::of(inner.live.iter().copied()))
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> Camera {
        self.camera.clone()
    }

    /// "not initialised", "tracking" or "lost".
    #[getter]
    fn state(&self, py: Python<'_>) -> PyResult<&'static str> {
        self.with(py, |inner| state_name(inner.state))
    }

    /// Counts of this session.
    #[getter]
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (s, keyframes, landmarks) = self.with(py, |inner| {
            let map = inner.slam.map();
            (inner.slam.statistics(), map.keyframe_count(), map.landmarks().count())
        })?;
        let dict = PyDict::new(py);
        let counts = [
            ("frames", s.frames),
            ("keyframes", keyframes),
            ("landmarks", landmarks),
            ("resets", s.resets),
            ("keyframes_skipped", s.keyframes_skipped),
            ("detector_failures", s.detector_failures),
            ("frames_without_detector", s.frames_without_detector),
            ("dense_patches", s.dense_patches),
            ("dense_patches_skipped", s.dense_patches_skipped),
            ("dense_bytes", s.dense_bytes),
        ];
        counts.iter().try_for_each(|(name, count)| dict.set_item(name, count))?;
        dict.set_item("mapping_has_ended", s.mapping_has_ended)?;
        dict.set_item("readout_ms", s.readout.in_use_ms)?;
        Ok(dict)
    }

    /// Saves the map, with the dense map if there is one, for the argument `map` and for `yfslam map`.
    fn save_map(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let bytes = self.with(py, Inner::encode)?.map_err(failure)?;
        py.detach(|| write_atomically(&path, |file| file.write_all(&bytes))).map_err(failure)
    }

    /// Returns the map as bytes, for the argument `map`.
    fn map_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.with(py, Inner::encode)?.map_err(failure)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Returns the features of the last frame.
    fn features<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = self.with(py, |inner| {
            let features = inner.slam.features().to_vec();
            let matched = (0..features.len()).map(|index| inner.slam.is_matched(index)).collect();
            FeatureRows { features, matched }
        })?;
        maps::features(py, &rows)
    }

    /// Returns the detections of movable objects in the last frame, N x 6.
    fn detections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = self.with(py, |inner| inner.slam.detections().to_vec())?;
        Ok(detections_array(py, &found)?.into_any())
    }

    /// Returns the parts of the last frame that move, N x 6: box, least and greatest depth in m.
    fn moving_regions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = self.with(py, |inner| inner.slam.moving_regions().to_vec())?;
        maps::regions(py, &found)
    }

    /// Returns the landmarks of the map.
    fn landmarks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = self.with(py, |inner| maps::landmark_rows(inner.slam.map()))?;
        maps::landmarks(py, &rows)
    }

    /// Returns the keyframes of the map.
    fn keyframes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = self.with(py, |inner| maps::keyframe_rows(inner.slam.map()))?;
        maps::keyframes(py, &rows)
    }

    /// Returns the dense map as it is now; the system must have been made with dense=True. up: "level", "camera" or a direction.
    #[pyo3(signature = (*, up=UpArg(Up::Level)))]
    fn dense_map(&self, py: Python<'_>, up: UpArg) -> PyResult<DenseMap> {
        let config = self.dense_config.clone();
        self.with(py, |inner| {
            let view = inner.slam.dense();
            let mut view = view.map_err(|_| failure("this Slam makes no dense map; make it with dense=True"))?;
            Ok(DenseMap::new(view.snapshot(), config, up.0))
        })?
    }

    /// Ends the threads of the system.
    fn close(&self, py: Python<'_>) {
        py.detach(|| drop(self.lock().take()));
    }

    fn __enter__(this: Bound<'_, Self>) -> Bound<'_, Self> {
        this
    }

    #[pyo3(signature = (*_error))]
    fn __exit__(&self, py: Python<'_>, _error: &Bound<'_, PyAny>) {
        self.close(py);
    }
}

impl Slam {
    fn lock(&self) -> MutexGuard<'_, Option<Inner>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls `f` without the interpreter's lock, which a detector in Python needs meanwhile.
    fn with<T: Send>(&self, py: Python<'_>, f: impl FnOnce(&mut Inner) -> T + Send) -> PyResult<T> {
        let result = py.detach(|| self.lock().as_mut().map(f));
        result.ok_or_else(|| failure("this Slam is closed; make another one"))
    }
}

impl Drop for Slam {
    fn drop(&mut self) {
        let inner = self.inner.get_mut().unwrap_or_else(PoisonError::into_inner).take();
        // A detector in Python may be at work on its thread, which is joined here and needs the interpreter's lock to end.
        if let Some(inner) = inner {
            Python::attach(|py| py.detach(|| drop(inner)));
        }
    }
}

impl Inner {
    fn track(&mut self, frame: &yfslam::Frame) -> Result<yfslam::Tracked, yfslam::FrameRejected> {
        let tracked = self.slam.track(frame)?;
        if tracked.state != self.state {
            let (before, now) = (state_name(self.state), state_name(tracked.state));
            let why = tracked.lost_reason.map_or_else(String::new, |reason| format!(": {reason}"));
            logging::info(format!("{before} → {now} at {} ns{why}", tracked.timestamp_ns));
            self.state = tracked.state;
        }
        let resets = self.slam.statistics().resets;
        if resets > self.resets {
            // A new map has another world: earlier poses do not belong to this trajectory.
            self.resets = resets;
            self.live.clear();
        }
        self.live.extend(tracked.t_world_cam.map(|pose| (tracked.timestamp_ns, pose)));
        Ok(tracked)
    }

    fn encode(&mut self) -> Result<Vec<u8>, yfslam::MapError> {
        self.slam.finish_mapping();
        self.slam.save_map()
    }
}

/// Returns a saved map of a path or bytes.
fn saved_map(value: &Bound<'_, PyAny>) -> PyResult<SavedMap> {
    if let Ok(bytes) = value.cast::<PyBytes>() {
        return SavedMap::from_bytes(bytes.as_bytes()).map_err(failure);
    }
    let path: PathBuf = value.extract()?;
    let bytes = yfslam_io::read_file(&path).map_err(failure)?;
    SavedMap::from_bytes(&bytes).map_err(|error| failure(format!("{}: {error}", path.display())))
}

/// The argument `detector`.
enum Detector<'py> {
    Embedded,
    Given(Option<Bound<'py, PyAny>>),
}

impl<'a, 'py> FromPyObject<'a, 'py> for Detector<'py> {
    type Error = PyErr;

    fn extract(value: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self::Given((!value.is_none()).then(|| value.to_owned())))
    }
}

impl Detector<'_> {
    fn resolve(self, py: Python<'_>, config: &yfslam::Config) -> PyResult<Option<Box<dyn yfslam::Detector>>> {
        let given = match self {
            Self::Embedded => Some(pyo3::types::PyString::new(py, "embedded").into_any()),
            Self::Given(given) => given,
        };
        detector::resolve(given.as_ref(), config)
    }
}
