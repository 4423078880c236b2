//! `yfslam.World`: rendered frames with ground truth, in any order.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use yfslam_io::{CameraSource, StampedPose};
use yfslam_synth::{CLASS_NAMES, SUITE, WorldConfig, parse, parse_with_camera};

use crate::arrays::{self, rows};
use crate::camera::Camera;
use crate::error::failure;
use crate::frame::Frame;
use crate::images;
use crate::trajectory::Trajectory;

/// A synthetic world.
#[pyclass(frozen, module = "yfslam")]
pub struct World {
    world: Arc<yfslam_synth::World>,
}

/// The frames of a world, in order.
#[pyclass(module = "yfslam")]
pub struct WorldIterator {
    world: Arc<yfslam_synth::World>,
    next: usize,
}

/// A rendered frame with its ground truth.
#[pyclass(frozen, module = "yfslam")]
pub struct SynthFrame {
    frame: yfslam_synth::SynthFrame,
}

/// Returns the names of the worlds with a description in a line.
#[pyfunction]
pub fn worlds() -> Vec<(&'static str, &'static str)> {
    SUITE.iter().map(|world| (world.name, world.about)).collect()
}

#[pymethods]
impl World {
    #[new]
    #[pyo3(signature = (spec="walking_xyz", *, camera=None))]
    fn new(py: Python<'_>, spec: &str, camera: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let mut config = match camera.map(Camera::from_py).transpose()? {
            Some(Camera { source }) => {
                let factor =
                    if source.missing.depth_factor { WorldConfig::default().depth_factor } else { source.depth_factor };
                parse_with_camera(spec, source.camera, factor)
            }
            None => parse(spec),
        }
        .map_err(failure)?;
        config.detections = true;
        let world = py.detach(|| yfslam_synth::World::new(&config)).map_err(failure)?;
        Ok(Self { world: Arc::new(world) })
    }

    #[classattr]
    fn class_names() -> Vec<&'static str> {
        CLASS_NAMES.to_vec()
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> Camera {
        let config = self.world.config();
        Camera { source: CameraSource::new(config.camera.clone(), config.depth_factor, "synthetic world") }
    }

    /// Returns the exact poses of all frames.
    fn truth(&self) -> Trajectory {
        let pose = |index| StampedPose::new(self.world.timestamp_ns(index), self.world.pose(index));
        Trajectory { poses: (0..self.world.len()).map(pose).collect() }
    }

    fn __len__(&self) -> usize {
        self.world.len()
    }

    fn __getitem__(&self, py: Python<'_>, index: isize) -> PyResult<SynthFrame> {
        let count = self.world.len();
        let from_start = if index < 0 { count.checked_add_signed(index) } else { usize::try_from(index).ok() };
        let index = from_start
            .filter(|&index| index < count)
            .ok_or_else(|| PyIndexError::new_err(format!("the world has {count} frames; there is no frame {index}")))?;
        Ok(SynthFrame { frame: py.detach(|| self.world.frame(index)) })
    }

    fn __iter__(&self) -> WorldIterator {
        WorldIterator { world: self.world.clone(), next: 0 }
    }

    fn __repr__(&self) -> String {
        let config = self.world.config();
        format!("World({:?}, {} frames, seed {})", config.scene, self.world.len(), config.seed)
    }
}

#[pymethods]
impl WorldIterator {
    fn __iter__(this: Bound<'_, Self>) -> Bound<'_, Self> {
        this
    }

    fn __next__(&mut self, py: Python<'_>) -> Option<SynthFrame> {
        if self.next >= self.world.len() {
            return None;
        }
        let (world, index) = (self.world.clone(), self.next);
        self.next += 1;
        Some(SynthFrame { frame: py.detach(|| world.frame(index)) })
    }
}

#[pymethods]
impl SynthFrame {
    /// The frame as a camera delivers it, with exact detections.
    #[getter]
    fn frame(&self) -> Frame {
        Frame { frame: self.frame.frame.clone() }
    }

    /// Time of the frame, ns.
    #[getter]
    fn timestamp_ns(&self) -> i64 {
        self.frame.frame.timestamp_ns
    }

    /// Colour, height x width x 3, uint8.
    #[getter]
    fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<u8>>> {
        images::color_array(py, &self.frame.frame.color)
    }

    /// Exact pose, 4 x 4, world from camera.
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::pose(py, &self.frame.t_world_cam)
    }

    /// What each pixel shows: 0 the static world, k person or object k.
    #[getter]
    fn instances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        images::plane_array(py, &self.frame.instances)
    }

    /// Depth without noise, m; 0 where nothing is visible.
    #[getter]
    fn exact_depth_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        images::plane_array(py, &self.frame.exact_depth)
    }

    /// Exact boxes, N x 4, px.
    #[getter]
    fn boxes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let boxes = self.frame.boxes.iter();
        rows(py, boxes.map(|(_, _, bbox)| [bbox.x_min, bbox.y_min, bbox.x_max, bbox.y_max]))
    }

    /// Number of the person or object of each box, as in `instances`.
    #[getter]
    fn box_instances<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u8>> {
        PyArray1::from_iter(py, self.frame.boxes.iter().map(|(instance, ..)| *instance))
    }

    /// Class of each box, an index into `World.class_names`.
    #[getter]
    fn box_classes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.frame.boxes.iter().map(|(_, class, _)| *class as i64))
    }
}
