//! Detectors: the embedded network, a file, or a function of Python.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use yfslam::{Config, Detection, Detector, DetectorError, Image, RgbImage};
use yfslam_detect::{DetectorConfig, YoloFastestV2};

use crate::error::failure;
use crate::{frame, images, logging};

/// Returns the detector that `value` stands for: "embedded", the path of an ONNX file, a function, or `None`.
///
/// # Errors
/// The file cannot be read or used, or the value is something else.
pub fn resolve(value: Option<&Bound<'_, PyAny>>, config: &Config) -> PyResult<Option<Box<dyn Detector>>> {
    let Some(value) = value else { return Ok(None) };
    if value.is_callable() {
        return Ok(Some(Box::new(PythonDetector::new(value)?)));
    }
    let Ok(path) = value.extract::<PathBuf>() else {
        return Err(PyTypeError::new_err(
            "detector must be \"embedded\", the path of an ONNX file, a function of an image, or None",
        ));
    };
    let settings = DetectorConfig::for_filter(config);
    if path.as_os_str() == "embedded" {
        return Ok(Some(Box::new(YoloFastestV2::embedded(&settings).map_err(failure)?)));
    }
    let bytes = yfslam_io::read_file(&path).map_err(failure)?;
    Ok(Some(yfslam_detect::load(&path.display().to_string(), &bytes, &settings).map_err(failure)?))
}

/// A function of Python that gets an image and returns boxes, or boxes and a mask.
struct PythonDetector {
    function: Py<PyAny>,
    class_names: Vec<String>,
    mask: Option<Arc<Image<u8>>>,
}

impl PythonDetector {
    fn new(function: &Bound<'_, PyAny>) -> PyResult<Self> {
        let names = function.getattr_opt("class_names")?;
        let class_names = names.map_or_else(|| Ok(vec!["person".to_owned()]), |names| names.extract())?;
        Ok(Self { function: function.clone().unbind(), class_names, mask: None })
    }

    fn call(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> PyResult<()> {
        Python::attach(|py| {
            let result = self.function.bind(py).call1((images::color_array(py, image)?,))?;
            // A tuple is boxes and a mask, anything else is boxes.
            let (boxes, mask) = match result.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() {
                Ok((boxes, mask)) if result.is_instance_of::<pyo3::types::PyTuple>() => (boxes, Some(mask)),
                _ => (result, None),
            };
            out.extend(frame::detections_of(&boxes)?);
            if let Some(unknown) = out.iter().find(|detection| detection.class >= self.class_names.len()) {
                let text = format!(
                    "the detector returned class {}, but has {} class_names",
                    unknown.class,
                    self.class_names.len()
                );
                return Err(failure(text));
            }
            self.mask = mask.filter(|mask| !mask.is_none()).map(|mask| images::mask(&mask)).transpose()?;
            Ok(())
        })
    }
}

impl Detector for PythonDetector {
    fn class_names(&self) -> &[String] {
        &self.class_names
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        out.clear();
        self.mask = None;
        self.call(image, out).map_err(|error| {
            out.clear();
            let text = error.to_string();
            logging::warn(format!("the detector failed: {text}"));
            DetectorError(text)
        })
    }

    fn mask(&self) -> Option<&Image<u8>> {
        self.mask.as_deref()
    }
}
