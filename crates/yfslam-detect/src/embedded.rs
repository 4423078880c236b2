//! The network that comes with this crate; `models/README.md` says what it can do and where it comes from.

use crate::{DetectorConfig, ModelError, YoloFastestV2};

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
    use yfslam::Detector;

    use super::*;

    #[test]
    fn the_embedded_network_finds_people_and_takes_at_most_a_megabyte() {
        let detector = YoloFastestV2::embedded(&DetectorConfig::default()).unwrap();
        assert!(detector.class_names().iter().any(|name| name == "person"), "{:?}", detector.class_names());
        assert!(EMBEDDED_MODEL.len() <= 1_000_000, "{}", EMBEDDED_MODEL.len());
    }
}
