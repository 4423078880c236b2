//! Configuration of the detector.

use serde::{Deserialize, Serialize};

/// Configuration of the detector; unknown keys are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectorConfig {
    /// Least score of a detection, in (0, 1). Score = objectness · class probability. Source: the demo program of the network.
    pub score_threshold: f32,
    /// Two boxes of one class are the same object if their intersection over union exceeds this, in (0, 1]; the one with the lower
    /// score is dropped. The demo program of the network has 0.4; with 0.5 more people who stand close together are found.
    pub iou_threshold: f32,
    /// A detected box is the mean, weighted by score, of the boxes of its class whose intersection over union with it exceeds this,
    /// in (0, 1]; with 1 it stays unchanged. YOLO-FastestV2 only. Source: Gidaris and Komodakis, ICCV 2015, section 4.3 (box
    /// voting).
    pub fuse_iou: f32,
    /// Width and height of the anchors, px of the network input, for the fine grid (stride 16), then for the coarse one (stride
    /// 32). If empty, those of the model file are used, else those of the official COCO model.
    pub anchors: Vec<Vec<[f32; 2]>>,
    /// Whether 1×1 convolutions are computed with 8-bit integers, for models with scales for this (`python -m train.quantize`):
    /// slightly less accurate; faster on processors with AVX-512 VNNI, many times slower on others.
    pub integers: bool,
    /// Names of the classes. If empty, those of the model file are used, else, for 80 classes, those of COCO.
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
    /// Returns the configuration of a detector that reports all boxes that the dynamic filter of `config` may use.
    pub fn for_filter(config: &yfslam::Config) -> Self {
        Self { score_threshold: config.dynamic.keep_score.min(config.dynamic.open_score), ..Self::default() }
    }

    /// Refuses values out of range.
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
    fn a_configuration_is_the_same_after_json_and_unknown_keys_are_refused() {
        let config =
            DetectorConfig { score_threshold: 0.1, anchors: vec![vec![[1.0, 2.0]]], ..DetectorConfig::default() };
        let text = serde_json::to_string(&config).unwrap();
        assert_eq!(serde_json::from_str::<DetectorConfig>(&text).unwrap(), config);
        assert_eq!(serde_json::from_str::<DetectorConfig>("{}").unwrap(), DetectorConfig::default());
        let error = serde_json::from_str::<DetectorConfig>(r#"{"score_treshold": 0.1}"#).unwrap_err();
        assert!(error.to_string().contains("score_treshold"), "{error}");
    }
}
