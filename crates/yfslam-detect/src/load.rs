//! From the contents of a model file to whatever runs it.

use yfslam::Detector;
use yfslam::image::Image;

use crate::{DetectorConfig, ModelError, YoloFastestV2};

/// A network that finds objects, and may tell which pixels show which of them.
pub trait Network: Detector {
    /// Which object each pixel of the image seen last shows: 0 for none, else 1 + its place in what [`Detector::detect`] gave; where
    /// several lie one over another, the best. `None` from networks that find boxes alone.
    fn objects(&self) -> Option<&Image<u16>> {
        None
    }
}

impl Network for YoloFastestV2 {}

/// Reads the contents of an ONNX file: YOLO-FastestV2 for this crate's own runtime or, with the feature `rten`, another YOLO network.
/// `name` is what errors call it.
///
/// # Errors
/// As [`YoloFastestV2::load`].
pub fn load(name: &str, bytes: &[u8], config: &DetectorConfig) -> Result<Box<dyn Network>, ModelError> {
    match YoloFastestV2::from_bytes(name, bytes, config) {
        #[cfg(feature = "rten")]
        Err(ModelError::Unsupported { .. }) => Ok(Box::new(crate::AnyYolo::from_bytes(name, bytes, config)?)),
        own => Ok(Box::new(own?)),
    }
}
