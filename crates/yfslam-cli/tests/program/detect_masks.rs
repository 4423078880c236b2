//! `yfslam detect` with a network that segments: masks in `boxes.json` and in images.

#[path = "../../../yfslam-detect/tests/common/mod.rs"]
mod networks;

use std::fs;

use crate::common::succeeds;
use networks::other::{BOXES, net_with_masks};
use serde_json::{Value, json};
use yfslam::RgbImage;
use yfslam_io::decode::decode_color;
use yfslam_io::write::write_color_png;

#[test]
fn each_object_of_a_network_that_segments_has_its_own_mask_drawn_and_encoded() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    fs::write(root.join("segments.onnx"), net_with_masks().to_onnx()).unwrap();
    // Twice the size of the input; boxes are 16 px wide every 20 px, from row 64 to row 96; those with an even number show what is above
    // row 96, the others nothing within their box.
    write_color_png(&root.join("green.png"), &RgbImage::from_vec(320, 192, vec![[0, 255, 0]; 320 * 192]).unwrap())
        .unwrap();
    succeeds(root, &["detect", "green.png", "--detector", "segments.onnx", "--images", "--out", "out"]);
    let list: Value = serde_json::from_str(&fs::read_to_string(root.join("out/boxes.json")).unwrap()).unwrap();
    let boxes = list["images"][0]["boxes"].as_array().unwrap();
    assert_eq!(boxes.len(), BOXES);
    let mut image = RgbImage::default();
    decode_color(&fs::read(root.join("out/images/000000-green.png")).unwrap(), None, &mut image).unwrap();
    for (index, found) in boxes.iter().enumerate() {
        let [left, middle] = [32 + 20 * index, 40 + 20 * index];
        assert_eq!((found["class"].as_str(), &found["mask"]["size"]), (Some("green"), &json!([192, 320])));
        let column = |first: usize| -> Vec<usize> {
            let between = [32, 160].repeat(15);
            [vec![first * 192 + 64], between, vec![32, 96 + (319 - first - 15) * 192]].concat()
        };
        let counts = if index % 2 == 0 { column(left) } else { vec![320 * 192] };
        assert_eq!(found["mask"]["counts"], json!(counts), "{index}");
        // Part of the colour of the class in the lower part of the box, where there is no bar.
        let [red, green, blue] = *image.get(middle, 88).unwrap();
        assert_eq!(blue > 50, index % 2 == 0, "{index}: {red} {green} {blue}");
    }
}
