//! YOLO networks of other architectures, made on the spot.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use common::Net;
use common::other::{BOXES, net, net_with_masks};
use yfslam::image::RgbImage;
use yfslam::{BoundingBox, Detection, Detector};
use yfslam_detect::{AnyYolo, DetectorConfig, Network, load};

#[test]
fn masks_show_the_class_of_each_object_within_its_box() {
    let config = DetectorConfig::default();
    let mut detector = AnyYolo::from_bytes("test.onnx", &net_with_masks().to_onnx(), &config).unwrap();
    let mut found = Vec::new();
    // Twice the size of the input; boxes are 16 px wide every 20 px, from row 64 to row 96, the middle is row 96: what is below is not seen.
    detector.detect(&image(320, 192, [0, 255, 0]), &mut found).unwrap();
    assert_eq!(found.len(), BOXES);
    let mask = detector.mask().unwrap();
    assert_eq!((mask.width(), mask.height()), (320, 192));
    let shown = |x: usize, y: usize| *mask.get(x, y).unwrap();
    assert_eq!(
        [shown(40, 80), shown(80, 80), shown(60, 80), shown(40, 60), shown(40, 100), shown(29, 80)],
        [2, 2, 0, 0, 0, 0]
    );
    assert_eq!(mask.data().iter().filter(|class| **class == 2).count(), 6 * 16 * 32);
    // Each box has objects of its own: those with an even number, best first, which is from left to right.
    let number = |x: usize, y: usize| *detector.objects().unwrap().get(x, y).unwrap();
    assert_eq!([number(40, 80), number(80, 80), number(60, 80), number(40, 100), number(240, 80)], [1, 3, 0, 0, 11]);
    let mut plain = AnyYolo::from_bytes("test.onnx", &net("columns").to_onnx(), &config).unwrap();
    plain.detect(&image(320, 192, [0, 255, 0]), &mut found).unwrap();
    assert!(plain.mask().is_none() && plain.objects().is_none());
}

fn image(width: usize, height: usize, color: [u8; 3]) -> RgbImage {
    RgbImage::from_vec(width, height, vec![color; width * height]).unwrap()
}

fn find(net: &Net, image: &RgbImage) -> Vec<Detection> {
    let mut detector = AnyYolo::from_bytes("test.onnx", &net.to_onnx(), &DetectorConfig::default()).unwrap();
    assert_eq!(detector.class_names(), ["red", "green", "blue"]);
    let mut found = vec![Detection { class: 9, score: 1.0, bbox: BoundingBox::default() }];
    detector.detect(image, &mut found).unwrap();
    found
}

fn assert_near(bbox: BoundingBox, expected: [f32; 4]) {
    let found = [bbox.x_min, bbox.y_min, bbox.x_max, bbox.y_max];
    assert!(
        found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-3),
        "{found:?} {expected:?}"
    );
}

#[test]
fn boxes_in_columns_and_in_rows_are_those_of_the_image_with_class_and_score() {
    for (layout, factor) in [("columns", 1.0), ("rows", 0.5)] {
        // Twice the size of the input, of the same shape: no margins.
        let found = find(&net(layout), &image(320, 192, [0, 204, 51]));
        assert_eq!(found.len(), BOXES, "{layout}");
        assert!(found.iter().all(|found| found.class == 1 && (found.score - 0.8 * factor).abs() < 1e-3), "{found:?}");
        assert_near(found[0].bbox, [32.0, 64.0, 48.0, 96.0]);
        assert_near(found[3].bbox, [92.0, 64.0, 108.0, 96.0]);
        // Red first, whatever the order in which others take colours.
        assert_eq!(find(&net(layout), &image(320, 192, [255, 0, 0]))[0].class, 0);
    }
}

#[test]
fn boxes_beside_the_image_are_left_out() {
    // A square in an input of 160 × 96 px lies between columns 32 and 128.
    let found = find(&net("columns"), &image(96, 96, [0, 255, 0]));
    assert_eq!(found.len(), BOXES - 1);
    // The second begins and the last ends beside it.
    assert_near(found[0].bbox, [0.0, 32.0, 2.0, 48.0]);
    assert_near(found[10].bbox, [94.0, 32.0, 96.0, 48.0]);
}

#[test]
fn boxes_that_were_suppressed_already_are_all_kept_but_for_unknown_classes_and_low_scores() {
    let found = find(&net("final"), &image(160, 96, [1, 2, 3]));
    assert_eq!(found.iter().map(|found| (found.class, found.score)).collect::<Vec<_>>(), [(2, 0.9), (2, 0.4)]);
    assert_near(found[0].bbox, [4.0, 10.0, 14.0, 30.0]);
}

#[test]
fn what_is_known_to_neither_runtime_is_refused_and_each_takes_its_own() {
    let words = |net: &Net, config: &DetectorConfig| match load("test.onnx", &net.to_onnx(), config) {
        Ok(_) => String::new(),
        Err(error) => error.to_string(),
    };
    let config = DetectorConfig::default();
    assert_eq!(words(&net("columns"), &config), "");
    let size = common::Size { height: 64, width: 64, channels: 4, classes: 80 };
    assert_eq!(words(&Net::yolo(&size, common::Style::Folded, 1), &config), "");
    let mut strange = net("columns");
    strange.outputs[0].0 = "colours1_out".into();
    assert!(words(&strange, &config).contains("[1, 4 + classes, n]"), "{}", words(&strange, &config));
    let mut strange = net("columns");
    strange.nodes[0].op = "Sorcery";
    assert!(words(&strange, &config).contains("rten cannot load it"), "{}", words(&strange, &config));
    let mut strange = net("columns");
    strange.metadata.clear();
    assert!(words(&strange, &config).contains("3 classes without names"), "{}", words(&strange, &config));
    let integers = DetectorConfig { integers: true, ..config.clone() };
    assert!(words(&net("columns"), &integers).contains("integers are for YOLO-FastestV2 alone"));
    let named = DetectorConfig { class_names: vec!["a".into()], ..config };
    assert!(words(&net("columns"), &named).contains("3 classes, but 1 names"));
    let error = AnyYolo::from_bytes("test.onnx", b"hello", &DetectorConfig::default()).err().unwrap();
    assert!(error.to_string().contains("not a readable ONNX model"), "{error}");
}
