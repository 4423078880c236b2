//! The network that is part of this crate; `models/README.md` describes its abilities and its origin.

use crate::config::DetectorConfig;
use crate::error::ModelError;
use crate::yolo::YoloFastestV2;

/// The ONNX file of the embedded network, which detects people. MIT OR Apache-2.0, like this crate.
pub const EMBEDDED_MODEL: &[u8] = include_bytes!("../models/person.onnx");

impl YoloFastestV2 {
    /// Loads the embedded network.
    ///
    /// # Errors
    /// `config` has a value out of range, or class names or anchors that do not fit.
    pub fn embedded(config: &DetectorConfig) -> Result<Self, ModelError> {
        Self::from_bytes("the embedded model", EMBEDDED_MODEL, config)
    }
}

#[cfg(test)]
mod tests {
    use sha2::{Digest, Sha256};
    use yfslam::Detector;

    use super::*;

    #[test]
    fn the_embedded_network_detects_people_and_has_at_most_a_megabyte() {
        let detector = YoloFastestV2::embedded(&DetectorConfig::default()).unwrap();
        assert!(detector.class_names().iter().any(|name| name == "person"), "{:?}", detector.class_names());
        assert!(EMBEDDED_MODEL.len() <= 1_000_000, "{}", EMBEDDED_MODEL.len());
    }

    #[test]
    fn the_model_card_states_size_and_hash_of_the_embedded_network() {
        let card = include_str!("../models/README.md");
        let hash: String = Sha256::digest(EMBEDDED_MODEL).iter().map(|byte| format!("{byte:02x}")).collect();
        let size = format!("{},{:03} bytes", EMBEDDED_MODEL.len() / 1000, EMBEDDED_MODEL.len() % 1000);
        assert!(card.contains(&format!("{size}, SHA-256 `{hash}`")), "{size}, {hash}");
    }
}
