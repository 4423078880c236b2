//! Networks in ONNX.

use yfslam::{Detector, RgbImage};
use yfslam_detect::{DetectorConfig, YoloFastestV2};

/// Most pixels of the input of a network that is run.
const MOST_INPUT_PIXELS: usize = 1 << 14;

/// A network; one that is accepted finds boxes of finite numbers.
pub fn network(bytes: &[u8]) -> bool {
    let Ok(mut network) = YoloFastestV2::from_bytes("fuzz.onnx", bytes, &DetectorConfig::default()) else {
        return false;
    };
    let (width, height) = network.input_size();
    if width * height <= MOST_INPUT_PIXELS {
        let mut found = Vec::new();
        let detected = network.detect(&RgbImage::new(50, 40), &mut found);
        assert!(detected.is_ok(), "a network that was accepted fails: {:?}", detected.err());
        assert!(found.iter().all(|detection| detection.score.is_finite() && detection.bbox.area().is_finite()));
    }
    true
}
