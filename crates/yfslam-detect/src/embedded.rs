//! The network that comes with this crate; `models/README.md` says what it can do and where it comes from.

use crate::config::DetectorConfig;
use crate::error::ModelError;
use crate::yolo::YoloFastestV2;

/// An ONNX file whose network finds people. MIT OR Apache-2.0, as this crate.
pub const EMBEDDED_MODEL: &[u8] = include_bytes!("../models/person.onnx");

impl YoloFastestV2 {
    /// The network that comes with this crate.
    ///
    /// # Errors
    /// If `config` holds a value out of range, or names classes or anchors that do not fit.
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
    fn the_embedded_network_finds_people_and_takes_at_most_a_megabyte() {
        let detector = YoloFastestV2::embedded(&DetectorConfig::default()).unwrap();
        assert!(detector.class_names().iter().any(|name| name == "person"), "{:?}", detector.class_names());
        assert!(EMBEDDED_MODEL.len() <= 1_000_000, "{}", EMBEDDED_MODEL.len());
    }

    #[test]
    fn the_card_of_the_embedded_network_names_its_size_and_hash() {
        let card = include_str!("../models/README.md");
        let hash: String = Sha256::digest(EMBEDDED_MODEL).iter().map(|byte| format!("{byte:02x}")).collect();
        let size = format!("{},{:03} bytes", EMBEDDED_MODEL.len() / 1000, EMBEDDED_MODEL.len() % 1000);
        assert!(card.contains(&format!("{size}, SHA-256 `{hash}`")), "{size}, {hash}");
    }
}
