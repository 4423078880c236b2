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

/// Anchors of the official model, px of its 352 × 352 input: k-means centres of the boxes of COCO.
pub(crate) const COCO_ANCHORS: [[[f32; 2]; 3]; 2] =
    [[[12.64, 19.39], [37.88, 51.48], [55.71, 138.31]], [[126.91, 78.23], [131.57, 214.55], [279.92, 258.87]]];

/// The 80 classes of COCO (Lin et al., ECCV 2014) in the order of their ids.
pub(crate) const COCO_NAMES: [&str; 80] = [
    "person",
    "bicycle",
    "car",
    "motorcycle",
    "airplane",
    "bus",
    "train",
    "truck",
    "boat",
    "traffic light",
    "fire hydrant",
    "stop sign",
    "parking meter",
    "bench",
    "bird",
    "cat",
    "dog",
    "horse",
    "sheep",
    "cow",
    "elephant",
    "bear",
    "zebra",
    "giraffe",
    "backpack",
    "umbrella",
    "handbag",
    "tie",
    "suitcase",
    "frisbee",
    "skis",
    "snowboard",
    "sports ball",
    "kite",
    "baseball bat",
    "baseball glove",
    "skateboard",
    "surfboard",
    "tennis racket",
    "bottle",
    "wine glass",
    "cup",
    "fork",
    "knife",
    "spoon",
    "bowl",
    "banana",
    "apple",
    "sandwich",
    "orange",
    "broccoli",
    "carrot",
    "hot dog",
    "pizza",
    "donut",
    "cake",
    "chair",
    "couch",
    "potted plant",
    "bed",
    "dining table",
    "toilet",
    "tv",
    "laptop",
    "mouse",
    "remote",
    "keyboard",
    "cell phone",
    "microwave",
    "oven",
    "toaster",
    "sink",
    "refrigerator",
    "book",
    "clock",
    "vase",
    "scissors",
    "teddy bear",
    "hair drier",
    "toothbrush",
];

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
