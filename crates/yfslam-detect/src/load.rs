//! From the contents of a model file to whatever runs it.

use yfslam::Detector;

use crate::{DetectorConfig, ModelError, YoloFastestV2};

/// Reads the contents of an ONNX file: YOLO-FastestV2 for this crate's own runtime or, with the feature `rten`, another YOLO network.
/// `name` is what errors call it.
///
/// # Errors
/// As [`YoloFastestV2::load`].
pub fn load(name: &str, bytes: &[u8], config: &DetectorConfig) -> Result<Box<dyn Detector>, ModelError> {
    match YoloFastestV2::from_bytes(name, bytes, config) {
        #[cfg(feature = "rten")]
        Err(ModelError::Unsupported { .. }) => Ok(Box::new(crate::AnyYolo::from_bytes(name, bytes, config)?)),
        own => Ok(Box::new(own?)),
    }
}
