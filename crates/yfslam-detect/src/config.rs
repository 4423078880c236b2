//! What can be set about the detector.

use serde::{Deserialize, Serialize};

/// Settings of the detector; unknown keys are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectorConfig {
    /// Least score of a reported object, in (0, 1). Score = objectness · class probability. Source: the network's own demo.
    pub score_threshold: f32,
    /// Of two boxes of one class whose intersection over union exceeds this, in (0, 1], only the better one is reported. The
    /// network's own demo has 0.4; with 0.5 more of people who stand close together are found.
    pub iou_threshold: f32,
    /// A reported box is the mean, weighed by their scores, of those found boxes of its class whose intersection over union with it
    /// exceeds this, in (0, 1]; 1: it stays as it is. YOLO-FastestV2 alone. Source: Gidaris and Komodakis, ICCV 2015, section 4.3 (box voting).
    pub fuse_iou: f32,
    /// Width and height of the anchors, px of the network input, for the fine grid (stride 16), then for the coarse one
    /// (stride 32). Empty: those that the model file names, else those of the official COCO model.
    pub anchors: Vec<Vec<[f32; 2]>>,
    /// Whether 1×1 convolutions are computed with integers of 8 bits, in models that say how (`python -m train.quantize`): a little less
    /// accurate; faster where the processor has AVX-512 VNNI, many times slower elsewhere.
    pub integers: bool,
    /// Names of the classes. Empty: those that the model file names, else, for 80 classes, those of COCO.
    pub class_names: Vec<String>,
}

impl Default for DetectorConfig {
    fn default() -> Self {
        Self {
            score_threshold: 0.3,
            iou_threshold: 0.5,
            fuse_iou: 0.7,
            integers: false,
            anchors: Vec::new(),
            class_names: Vec::new(),
        }
    }
}

impl DetectorConfig {
    /// Refuses values with which no network can be run.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { score_threshold, iou_threshold, fuse_iou, anchors, .. } = self;
        if !(*score_threshold > 0.0 && *score_threshold < 1.0) {
            return Err(format!("score_threshold = {score_threshold} must lie between 0 and 1"));
        }
        if !(*iou_threshold > 0.0 && *iou_threshold <= 1.0) {
            return Err(format!("iou_threshold = {iou_threshold} must lie between 0 and 1"));
        }
        if !(*fuse_iou > 0.0 && *fuse_iou <= 1.0) {
            return Err(format!("fuse_iou = {fuse_iou} must lie between 0 and 1"));
        }
        let wrong = |anchor: &&[f32; 2]| anchor.iter().any(|side| !(side.is_finite() && *side > 0.0));
        match anchors.iter().flatten().find(wrong) {
            Some(anchor) => Err(format!("anchors: {anchor:?} must be a width and a height above 0 px")),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_writing_and_reading_and_unknown_keys_are_refused() {
        let config =
            DetectorConfig { score_threshold: 0.1, anchors: vec![vec![[1.0, 2.0]]], ..DetectorConfig::default() };
        let text = serde_json::to_string(&config).unwrap();
        assert_eq!(serde_json::from_str::<DetectorConfig>(&text).unwrap(), config);
        assert_eq!(serde_json::from_str::<DetectorConfig>("{}").unwrap(), DetectorConfig::default());
        let error = serde_json::from_str::<DetectorConfig>(r#"{"score_treshold": 0.1}"#).unwrap_err();
        assert!(error.to_string().contains("score_treshold"), "{error}");
    }
}
