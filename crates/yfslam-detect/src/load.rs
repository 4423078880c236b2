//! Chooses the runtime for a model file by its contents.

#[cfg(feature = "rten")]
use crate::any_yolo::AnyYolo;
use crate::config::DetectorConfig;
use crate::error::ModelError;
use crate::network::Network;
use crate::yolo::YoloFastestV2;

/// Loads a network from the contents of an ONNX file: YOLO-FastestV2 with this crate's own engine or, with the feature `rten`, another
/// YOLO network. `name` stands for the file in error messages.
///
/// # Errors
/// As for [`YoloFastestV2::load`].
pub fn load(name: &str, bytes: &[u8], config: &DetectorConfig) -> Result<Box<dyn Network>, ModelError> {
    match YoloFastestV2::from_bytes(name, bytes, config) {
        #[cfg(feature = "rten")]
        Err(ModelError::Unsupported { .. }) => Ok(Box::new(AnyYolo::from_bytes(name, bytes, config)?)),
        own => Ok(Box::new(own?)),
    }
}
