//! `yfslam.open`: everything that `yfslam run` reads, frame by frame.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use numpy::PyArray1;
use pyo3::prelude::*;
use yfslam_cli::recording::Options;
use yfslam_io::sequence::TopicChoice;

use crate::camera::Camera;
use crate::error::failure_with_causes;
use crate::frame::Frame;
use crate::trajectory::Trajectory;
use crate::{config, logging};

type Playing = yfslam_cli::recording::Recording;

/// A sequence; each iteration plays it from its start.
#[pyclass(frozen, module = "yfslam")]
pub struct Recording {
    options: Options,
    /// The sequence as it was opened, until it is played.
    opened: Mutex<Option<Playing>>,
    name: String,
    notes: Vec<String>,
    warnings: Vec<String>,
    camera: Camera,
    sensor: &'static str,
    has_boxes: bool,
    stamps_ns: Vec<i64>,
}

/// Opens a sequence.
#[pyfunction]
#[pyo3(signature = (path, *, camera=None, sensor=None, depth_factor=None, start=0, end=None, reverse=false, boxes=true,
    movable=vec!["person".to_owned()], masks=None, layout=None, associations=None, color=None, depth=None, fps=None,
    association_tolerance_ms=None, faults=Vec::new(), color_topic=None, depth_topic=None, left_topic=None, right_topic=None,
    camera_info_topic=None, truth_topic=None, base_frame=None))]
#[expect(clippy::too_many_arguments, reason = "they are named in Python")]
pub fn open(
    py: Python<'_>,
    path: PathBuf,
    camera: Option<PathBuf>,
    sensor: Option<&str>,
    depth_factor: Option<f64>,
    start: usize,
    end: Option<usize>,
    reverse: bool,
    boxes: bool,
    movable: Vec<String>,
    masks: Option<PathBuf>,
    layout: Option<String>,
    associations: Option<PathBuf>,
    color: Option<PathBuf>,
    depth: Option<PathBuf>,
    fps: Option<f64>,
    association_tolerance_ms: Option<f64>,
    faults: Vec<String>,
    color_topic: Option<String>,
    depth_topic: Option<String>,
    left_topic: Option<String>,
    right_topic: Option<String>,
    camera_info_topic: Option<String>,
    truth_topic: Option<String>,
    base_frame: Option<String>,
) -> PyResult<Recording> {
    logging::follow_level(py)?;
    let options = Options {
        sequence: path.to_string_lossy().into_owned(),
        layout,
        associations,
        color,
        depth,
        fps,
        camera: camera.map(|camera| camera.to_string_lossy().into_owned()),
        sensor: sensor.map(config::sensor).transpose()?,
        depth_factor,
        association_tolerance_ms,
        masks,
        start,
        end,
        reverse,
        faults,
        topics: TopicChoice {
            color: color_topic,
            depth: depth_topic,
            left: left_topic,
            right: right_topic,
            camera_info: camera_info_topic,
            truth: truth_topic,
            base_frame,
        },
        own_boxes: boxes.then_some(movable),
    };
    let playing = py.detach(|| Playing::open(&options)).map_err(|error| failure_with_causes(&error))?;
    playing.warnings().iter().for_each(|warning| logging::warn(warning.clone()));
    logging::hand_over(py)?;
    Ok(Recording {
        options,
        name: playing.name().to_owned(),
        notes: playing.notes().to_vec(),
        warnings: playing.warnings().to_vec(),
        camera: Camera { source: playing.camera().clone() },
        sensor: config::sensor_name(playing.depth_source()),
        has_boxes: playing.has_boxes(),
        stamps_ns: playing.stamps_ns().to_vec(),
        opened: Mutex::new(Some(playing)),
    })
}

#[pymethods]
impl Recording {
    /// Short name of the sequence.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// What the sequence was taken for, and what was assumed.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// What is probably a mistake.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> Camera {
        self.camera.clone()
    }

    /// "rgbd", "stereo" or "mono".
    #[getter]
    fn sensor(&self) -> &'static str {
        self.sensor
    }

    /// Whether frames carry boxes of the sequence, so that no detector is needed.
    #[getter]
    fn has_boxes(&self) -> bool {
        self.has_boxes
    }

    /// Times of all frames, ns, also of those that will turn out to be unusable.
    #[getter]
    fn timestamps_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_slice(py, &self.stamps_ns)
    }

    /// Returns the ground truth, of `file` or of the sequence; None if it has none.
    #[pyo3(signature = (file=None))]
    fn truth(&self, py: Python<'_>, file: Option<PathBuf>) -> PyResult<Option<Trajectory>> {
        let truth = py.detach(|| {
            let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
            if opened.is_none() {
                *opened = Some(Playing::open(&self.options)?);
            }
            opened.as_ref().map_or(Ok(None), |playing| playing.truth(file.as_deref()))
        });
        let truth = truth.map_err(|error| failure_with_causes(&error))?;
        Ok(truth.map(|poses| Trajectory { poses }))
    }

    fn __iter__(&self, py: Python<'_>) -> PyResult<RecordingIterator> {
        logging::follow_level(py)?;
        let opened = py.detach(|| self.opened.lock().unwrap_or_else(PoisonError::into_inner).take());
        let playing = match opened {
            Some(playing) => playing,
            None => py.detach(|| Playing::open(&self.options)).map_err(|error| failure_with_causes(&error))?,
        };
        Ok(RecordingIterator { playing: Mutex::new(Some(playing)), skipped: Mutex::default() })
    }

    fn __len__(&self) -> usize {
        self.stamps_ns.len()
    }

    fn __repr__(&self) -> String {
        format!("Recording({:?}, {} frames, {})", self.name, self.stamps_ns.len(), self.sensor)
    }
}

/// The frames of a sequence; those that cannot be used are left out with a warning.
#[pyclass(frozen, module = "yfslam")]
pub struct RecordingIterator {
    playing: Mutex<Option<Playing>>,
    skipped: Mutex<Vec<String>>,
}

#[pymethods]
impl RecordingIterator {
    /// Why frames were left out so far.
    #[getter]
    fn skipped(&self) -> Vec<String> {
        self.skipped.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn __iter__(this: Bound<'_, Self>) -> Bound<'_, Self> {
        this
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Frame>> {
        loop {
            // Many unusable frames in a row must not keep Ctrl-C waiting.
            py.check_signals()?;
            let next = py.detach(|| {
                let mut playing = self.playing.lock().unwrap_or_else(PoisonError::into_inner);
                let next = playing.as_mut().and_then(Iterator::next);
                if next.is_none() {
                    *playing = None;
                }
                next
            });
            match next {
                None => return Ok(None),
                Some(Ok(frame)) => return Ok(Some(Frame::new_from(frame))),
                Some(Err(message)) => {
                    logging::warn(format!("skipped {message}"));
                    logging::hand_over(py)?;
                    self.skipped.lock().unwrap_or_else(PoisonError::into_inner).push(message);
                }
            }
        }
    }
}
