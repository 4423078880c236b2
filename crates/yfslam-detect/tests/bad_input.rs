//! Unusable models, configurations and images are refused with a message that says what to do, and without a panic.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::path::Path;
use std::sync::LazyLock;

use common::{Attribute, Constant, Net, Size, Style, random};
use proptest::prelude::*;
use yfslam::{Detection, Detector, RgbImage};
use yfslam_detect::{DetectorConfig, YoloFastestV2};

const SIZE: Size = Size { height: 32, width: 64, channels: 2, classes: 2 };

fn net() -> Net {
    Net::yolo(&SIZE, Style::Folded, 7)
}

fn config() -> DetectorConfig {
    DetectorConfig { class_names: vec!["person".into(), "chair".into()], ..DetectorConfig::default() }
}

fn photo() -> RgbImage {
    let mut state = 1;
    let pixels = (0..100 * 70).map(|_| [0; 3].map(|_: u8| (random(&mut state) * 256.0) as u8)).collect();
    RgbImage::from_vec(100, 70, pixels).unwrap()
}

/// Loads `bytes` and, if that succeeds, runs the network; returns the error message.
fn message(bytes: &[u8]) -> String {
    match YoloFastestV2::from_bytes("test.onnx", bytes, &config()) {
        Ok(mut detector) => {
            detector.detect(&photo(), &mut Vec::new()).unwrap();
            String::new()
        }
        Err(error) => error.to_string(),
    }
}

/// Returns the error message for a network that was changed by `change`.
fn message_after(change: impl FnOnce(&mut Net)) -> String {
    let mut net = net();
    change(&mut net);
    message(&net.to_onnx())
}

#[test]
fn a_file_of_another_format_is_refused() {
    let png = [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', 0, 0, 0, 13, b'I', b'H', b'D', b'R'];
    for bytes in [&[][..], &png, b"hello", &[0; 100], &[0xff; 100]] {
        let message = message(bytes);
        assert!(message.contains("test.onnx is not a readable ONNX model"), "{message}");
    }
}

#[test]
fn a_file_cut_short_at_any_point_is_refused() {
    let whole = net().to_onnx();
    assert_eq!(message(&whole), "");
    for length in (0..whole.len()).step_by(whole.len() / 200) {
        assert_ne!(message(&whole[..length]), "", "the first {length} of {} bytes", whole.len());
    }
}

#[test]
fn a_missing_file_is_named() {
    let error = YoloFastestV2::load(Path::new("no/such/model.onnx"), &config()).unwrap_err();
    assert!(error.to_string().contains("no/such/model.onnx"), "{error}");
}

#[test]
fn unsupported_operations_are_named_by_node_and_operator() {
    type Change = fn(&mut Net);
    let cases: [(&str, Change); 6] = [
        ("node \"relu1\" (Sigmoid): this operator is not supported", |net| net.nodes[1].op = "Sigmoid"),
        ("node \"conv0\" (Conv): padding must be 1", |net| net.nodes[0].attributes[2].1 = Attribute::Ints(vec![0; 4])),
        ("node \"pool2\" (MaxPool): only windows of 3", |net| {
            net.nodes[2].attributes[0].1 = Attribute::Ints(vec![2, 2])
        }),
        ("(Resize): only nearest-neighbour", |net| {
            let resize = net.nodes.iter_mut().find(|node| node.op == "Resize").unwrap();
            resize.attributes[0].1 = Attribute::Text("linear");
        }),
        ("input \"nowhere\" is not the result", |net| net.nodes[3].inputs[0] = "nowhere".into()),
        ("node \"conv0\" (Conv): a 3×3 convolution over all channels must be followed by", |net| {
            net.nodes.truncate(2);
            net.outputs = vec![("relu1_out".into(), vec![1, 2, 16, 32])];
        }),
    ];
    for (expected, change) in cases {
        let message = message_after(change);
        assert!(message.contains(expected) && message.contains("test.onnx"), "{message}");
        assert!(message.contains("this runtime computes"), "the remedy is missing: {message}");
    }
}

#[test]
fn weights_that_are_not_finite_are_refused() {
    for poison in [f32::NAN, f32::INFINITY] {
        let message = message_after(|net| {
            let Some(Constant::Floats(_, values)) = net.constants.get_mut("weight4") else { unreachable!() };
            values[1] = poison;
        });
        assert!(message.contains("constant \"weight4\" has values that are not finite"), "{message}");
    }
}

#[test]
fn a_model_that_does_not_fit_the_configuration_is_refused() {
    let load = |config: DetectorConfig| {
        YoloFastestV2::from_bytes("test.onnx", &net().to_onnx(), &config).unwrap_err().to_string()
    };
    let cases = [
        ("2 classes without names; set `class_names`", DetectorConfig { class_names: Vec::new(), ..config() }),
        ("2 classes, but 1 names", DetectorConfig { class_names: vec!["person".into()], ..config() }),
        ("score_threshold = 1.5", DetectorConfig { score_threshold: 1.5, ..config() }),
        ("score_threshold = NaN", DetectorConfig { score_threshold: f32::NAN, ..config() }),
        ("iou_threshold = 0", DetectorConfig { iou_threshold: 0.0, ..config() }),
        ("fuse_iou = NaN", DetectorConfig { fuse_iou: f32::NAN, ..config() }),
        ("anchors: [-1.0, 2.0]", DetectorConfig { anchors: vec![vec![[-1.0, 2.0]]], ..config() }),
        ("it has no scales for computing with integers", DetectorConfig { integers: true, ..config() }),
        ("anchors for 1", DetectorConfig { anchors: vec![vec![[1.0, 2.0]]], ..config() }),
        (
            "with 1 anchors [4, 1, classes] is expected",
            DetectorConfig { anchors: vec![vec![[1.0, 2.0]]; 2], ..config() },
        ),
    ];
    for (expected, config) in cases {
        let message = load(config);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn malformed_scales_are_refused() {
    for line in ["conv4 0.1", "conv4 0 128", "conv4 NaN 128", "conv4 0.1 256", "conv4 0.1 -1", "0.1 1"] {
        let mut net = net();
        net.metadata = vec![("scales", format!("conv1 0.1 0\n{line}"))];
        let error = YoloFastestV2::from_bytes("test.onnx", &net.to_onnx(), &config()).unwrap_err().to_string();
        assert!(error.contains(&format!("cannot read the scale \"{line}\"")), "{error}");
    }
}

#[test]
fn names_and_anchors_come_from_the_file_unless_the_configuration_gives_them() {
    let mut net = net();
    net.metadata = vec![("names", "{0: 'human', 1: 'dog'}".into()), ("anchors", "1,2,3,4,5,6,7,8,9,10,11,12".into())];
    let names = |config: &DetectorConfig| {
        YoloFastestV2::from_bytes("test.onnx", &net.to_onnx(), config).unwrap().class_names().to_vec()
    };
    assert_eq!(names(&DetectorConfig::default()), ["human", "dog"]);
    assert_eq!(names(&config()), ["person", "chair"]);
}

#[test]
fn an_empty_image_is_an_error_and_leaves_no_detections() {
    let mut detector = YoloFastestV2::from_bytes("test.onnx", &net().to_onnx(), &config()).unwrap();
    for (width, height) in [(0, 0), (0, 480), (640, 0)] {
        let mut found = vec![Detection { class: 0, score: 1.0, bbox: yfslam::BoundingBox::default() }];
        let error = detector.detect(&RgbImage::new(width, height), &mut found).unwrap_err();
        assert!(error.to_string().contains("the image is empty"), "{error}");
        assert_eq!(found, []);
    }
}

#[test]
fn boxes_lie_in_the_image_best_first_and_above_the_threshold() {
    let config = DetectorConfig { score_threshold: 0.05, ..config() };
    let mut detector = YoloFastestV2::from_bytes("test.onnx", &net().to_onnx(), &config).unwrap();
    let mut found = Vec::new();
    for (width, height) in [(1, 1), (3, 500), (100, 70)] {
        let image = RgbImage::from_vec(width, height, vec![[90, 160, 30]; width * height]).unwrap();
        detector.detect(&image, &mut found).unwrap();
        assert!(!found.is_empty());
        assert!(found.is_sorted_by(|a, b| a.score >= b.score));
        for Detection { class, score, bbox } in &found {
            assert!(*class < 2 && *score > 0.05 && *score <= 1.0);
            assert!(bbox.x_min >= 0.0 && bbox.y_min >= 0.0 && bbox.area() > 0.0);
            assert!(bbox.x_max <= width as f32 && bbox.y_max <= height as f32);
        }
    }
}

static BYTES: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut net = net();
    net.metadata = vec![("names", "person, chair".into()), ("anchors", "1,2,3,4,5,6,7,8,9,10,11,12".into())];
    net.to_onnx()
});

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Half of the damage is in the first bytes, which have the structure; the rest are weights.
    #[test]
    fn damaged_files_never_cause_a_panic(
        damage in prop::collection::vec((any::<bool>(), any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
    ) {
        let mut bytes = BYTES.clone();
        for (structure, index, value) in damage {
            let length = if structure { bytes.len() / 3 } else { bytes.len() };
            bytes[index.index(length)] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(mut detector) = YoloFastestV2::from_bytes("test.onnx", &bytes, &DetectorConfig::default()) {
            let mut found = Vec::new();
            detector.detect(&photo(), &mut found).unwrap();
            prop_assert!(found.iter().all(|detection| detection.score.is_finite() && detection.bbox.area().is_finite()));
        }
    }
}
