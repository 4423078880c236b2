//! `yfslam.Frame`: the images of one instant.

use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use yfslam::{BoundingBox, Detection};

use crate::arrays::rows;
use crate::images;

/// A frame; its arrays are copies.
#[pyclass(frozen, module = "yfslam")]
pub struct Frame {
    pub frame: yfslam::Frame,
}

/// The images of a frame as Python gives them.
pub struct Given<'a, 'py> {
    pub rgb: &'a Bound<'py, PyAny>,
    pub depth: Option<&'a Bound<'py, PyAny>>,
    pub right: Option<&'a Bound<'py, PyAny>>,
    pub depth_scale: Option<f64>,
    pub depth_timestamp_ns: Option<i64>,
    pub detections: Option<&'a Bound<'py, PyAny>>,
    pub mask: Option<&'a Bound<'py, PyAny>>,
}

impl Given<'_, '_> {
    /// Returns the frame, with packed copies of the images.
    ///
    /// # Errors
    /// An array does not have the type or shape that is needed.
    pub fn frame(&self, timestamp_ns: i64) -> PyResult<yfslam::Frame> {
        let mut frame = yfslam::Frame::mono(timestamp_ns, images::color(self.rgb, "rgb")?);
        frame.depth = self.depth.map(|depth| images::depth(depth, self.depth_scale)).transpose()?;
        frame.right = self.right.map(|right| images::color(right, "right")).transpose()?;
        frame.mask = self.mask.map(images::mask).transpose()?;
        frame.detections = self.detections.map(|detections| detections_of(detections)).transpose()?;
        frame.depth_timestamp_ns = self.depth_timestamp_ns.filter(|_| frame.depth.is_some());
        Ok(frame)
    }
}

#[pymethods]
impl Frame {
    #[new]
    #[pyo3(signature = (timestamp_ns, rgb, depth=None, *, right=None, depth_scale=None, depth_timestamp_ns=None, detections=None,
        mask=None))]
    #[expect(clippy::too_many_arguments, reason = "they are named in Python")]
    fn new(
        timestamp_ns: i64,
        rgb: &Bound<'_, PyAny>,
        depth: Option<&Bound<'_, PyAny>>,
        right: Option<&Bound<'_, PyAny>>,
        depth_scale: Option<f64>,
        depth_timestamp_ns: Option<i64>,
        detections: Option<&Bound<'_, PyAny>>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let given = Given { rgb, depth, right, depth_scale, depth_timestamp_ns, detections, mask };
        Ok(Self { frame: given.frame(timestamp_ns)? })
    }

    /// Time of the colour image, ns.
    #[getter]
    fn timestamp_ns(&self) -> i64 {
        self.frame.timestamp_ns
    }

    /// Time of the depth image, ns; None if it has no time stamp of its own.
    #[getter]
    fn depth_timestamp_ns(&self) -> Option<i64> {
        self.frame.depth_timestamp_ns
    }

    /// Colour, height x width x 3, uint8.
    #[getter]
    fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<u8>>> {
        images::color_array(py, &self.frame.color)
    }

    /// Right image of a stereo pair; None without.
    #[getter]
    fn right<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray3<u8>>>> {
        self.frame.right.as_deref().map(|right| images::color_array(py, right)).transpose()
    }

    /// Depth in units of `depth_scale`, height x width, uint16; 0 where nothing was measured. None without.
    #[getter]
    fn depth<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<u16>>>> {
        self.frame.depth.as_deref().map(|depth| images::plane_array(py, &depth.raw)).transpose()
    }

    /// Metres per unit of `depth`.
    #[getter]
    fn depth_scale(&self) -> Option<f64> {
        self.frame.depth.as_deref().map(|depth| f64::from(depth.metres_per_unit))
    }

    /// Depth in metres, float32; 0 where nothing was measured. None without.
    #[getter]
    fn depth_m<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
        let Some(depth) = self.frame.depth.as_deref() else { return Ok(None) };
        let metres = depth.raw.data().iter().map(|&raw| f32::from(raw) * depth.metres_per_unit).collect();
        crate::arrays::array(py, [depth.raw.height(), depth.raw.width()], metres).map(Some)
    }

    /// Movable objects, uint8: 0 where there is none. None without.
    #[getter]
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<u8>>>> {
        self.frame.mask.as_deref().map(|mask| images::plane_array(py, mask)).transpose()
    }

    /// Known detections, N x 6: x_min, y_min, x_max, y_max (px), score, class. None without.
    #[getter]
    fn detections<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
        self.frame.detections.as_deref().map(|detections| detections_array(py, detections)).transpose()
    }

    fn __repr__(&self) -> String {
        let color = &self.frame.color;
        format!("Frame(timestamp_ns={}, {}x{})", self.frame.timestamp_ns, color.width(), color.height())
    }
}

impl Frame {
    pub fn new_from(frame: yfslam::Frame) -> Self {
        Self { frame }
    }
}

/// Returns detections as N × 6: x_min, y_min, x_max, y_max, score, class.
pub fn detections_array<'py>(py: Python<'py>, detections: &[Detection]) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let row = |d: &Detection| [d.bbox.x_min, d.bbox.y_min, d.bbox.x_max, d.bbox.y_max, d.score, d.class as f32];
    rows(py, detections.iter().map(row))
}

/// Returns the detections of rows of x_min, y_min, x_max, y_max, then score and class if they are given.
///
/// # Errors
/// A row has another number of values, or a value that is not finite or out of range.
pub fn detections_of(value: &Bound<'_, PyAny>) -> PyResult<Vec<Detection>> {
    let mut detections = Vec::new();
    for row in value.try_iter()? {
        let row: Vec<f64> = row?.extract()?;
        let wrong = |problem: &str| {
            PyValueError::new_err(format!(
                "a detection is {row:?}: {problem}; give x_min, y_min, x_max, y_max in px, then score (0 to 1) and class number"
            ))
        };
        let (Some([x_min, y_min, x_max, y_max]), 4..=6) = (row.first_chunk::<4>(), row.len()) else {
            return Err(wrong("it does not have 4 to 6 values"));
        };
        let (score, class) = (row.get(4).copied().unwrap_or(1.0), row.get(5).copied().unwrap_or(0.0));
        if !row.iter().all(|value| value.is_finite()) || !(0.0..=1.0).contains(&score) {
            return Err(wrong("a value is not finite, or the score is out of range"));
        }
        if !(0.0..=65_535.0).contains(&class) || class.fract() != 0.0 {
            return Err(wrong("the class is no number of a class"));
        }
        let [x_min, y_min, x_max, y_max] = [x_min, y_min, x_max, y_max].map(|v| *v as f32);
        let bbox = BoundingBox { x_min, y_min, x_max, y_max };
        detections.push(Detection { class: class as usize, score: score as f32, bbox });
    }
    detections.sort_by(|a, b| b.score.total_cmp(&a.score));
    Ok(detections)
}
