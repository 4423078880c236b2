//! `yfslam detect`: boxes as JSON and drawn on images, and errors for images that cannot be read.

use std::fs;
use std::path::Path;

use crate::common::{fails, real_data, succeeds, yfslam};
use serde_json::Value;
use yfslam::RgbImage;
use yfslam_io::decode::decode_color;
use yfslam_io::write::write_color_png;

/// Renders eight images of people in an office into `rec/rgb`.
fn render(root: &Path) {
    succeeds(root, &["synth", "walking_static?people=3&share=0.5&frames=8", "--out", "rec", "-q"]);
}

fn boxes(out: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(out.join("boxes.json")).unwrap()).unwrap()
}

fn pixels(path: &Path) -> RgbImage {
    let mut image = RgbImage::default();
    decode_color(&fs::read(path).unwrap(), None, &mut image).unwrap();
    image
}

#[test]
fn a_folder_gives_a_line_for_each_image_and_an_image_with_boxes_the_same_on_every_run() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    render(root);
    fs::create_dir_all(root.join("a/images")).unwrap();
    fs::write(root.join("a/images/000007-old.png"), "").unwrap();
    fs::write(root.join("a/images/mine.png"), "").unwrap();
    let output = succeeds(root, &["detect", "rec/rgb", "--images", "--out", "a"]);
    succeeds(root, &["detect", "rec/rgb", "--pictures", "--out", "b", "-q"]);
    assert_eq!(fs::read(root.join("a/boxes.json")).unwrap(), fs::read(root.join("b/boxes.json")).unwrap());
    let list = boxes(&root.join("a"));
    assert_eq!((&list["model"]["file"], &list["classes"]), (&"embedded".into(), &Value::from(vec!["person"])));
    let images = list["images"].as_array().unwrap();
    assert_eq!(images.len(), 8);
    let mut found = 0;
    for (index, image) in images.iter().enumerate() {
        let file = image["file"].as_str().unwrap();
        let stem = Path::new(file).file_stem().unwrap().to_str().unwrap();
        let drawn = pixels(&root.join(format!("a/images/{index:06}-{stem}.png")));
        let plain = pixels(&root.join(file));
        assert_eq!((image["width"].as_u64(), image["height"].as_u64()), (Some(640), Some(480)));
        let boxes = image["boxes"].as_array().unwrap();
        assert_eq!(drawn != plain, !boxes.is_empty(), "{file}");
        for found in boxes {
            let edges: Vec<f64> = found["bbox"].as_array().unwrap().iter().map(|edge| edge.as_f64().unwrap()).collect();
            assert!(edges[0] < edges[2] && edges[1] < edges[3] && edges[2] <= 640.0 && edges[3] <= 480.0, "{found}");
            assert!(found["score"].as_f64().unwrap() > 0.3 && found["class"] == "person");
        }
        assert!(output.stdout.contains(file));
        found += boxes.len();
    }
    assert!(found > 0 && output.stdout.contains(&format!("{found} × person found in 8 images")), "{}", output.stdout);
    let mut left: Vec<_> = fs::read_dir(root.join("a/images")).unwrap().map(|e| e.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left.len(), 9, "{left:?}");
    assert!(left.contains(&"mine.png".into()) && !left.contains(&"000007-old.png".into()));
}

/// Returns left, top, right and bottom edge of each box, best first.
fn edges(image: &Value) -> Vec<[f64; 4]> {
    let boxes = image["boxes"].as_array().unwrap().iter();
    boxes.map(|found| std::array::from_fn(|side| found["bbox"][side].as_f64().unwrap())).collect()
}

#[test]
fn people_in_images_of_a_camera_on_its_side_are_detected_as_in_upright_images() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    render(root);
    fs::create_dir(root.join("lying")).unwrap();
    for file in fs::read_dir(root.join("rec/rgb")).unwrap().map(|entry| entry.unwrap().path()) {
        let upright = pixels(&file);
        let (width, height) = (upright.width(), upright.height());
        // The right side becomes the upper side: the camera is rolled clockwise.
        let turned = |index: usize| *upright.get(width - 1 - index / height, index % height).unwrap();
        let lying = RgbImage::from_vec(height, width, (0..width * height).map(turned).collect()).unwrap();
        write_color_png(&root.join("lying").join(file.file_name().unwrap()), &lying).unwrap();
    }
    succeeds(root, &["detect", "rec/rgb", "--out", "upright", "-q"]);
    succeeds(root, &["detect", "lying", "--out", "as-it-is", "-q"]);
    succeeds(root, &["detect", "lying", "--roll", "90", "--out", "turned", "-q"]);
    let [upright, as_it_is, turned] = ["upright", "as-it-is", "turned"].map(|out| boxes(&root.join(out)));
    let all = |list: &Value| list["images"].as_array().unwrap().iter().map(edges).collect::<Vec<_>>();
    let agreeing = |list: &Value| {
        let pairs = all(&upright).into_iter().zip(all(list));
        let near = |a: &[f64; 4], b: &[f64; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 30.0);
        pairs
            .flat_map(|(a, b)| {
                a.into_iter()
                    .filter(|&[x0, y0, x1, y1]| b.iter().any(|found| near(&[y0, 640.0 - x1, y1, 640.0 - x0], found)))
                    .collect::<Vec<_>>()
            })
            .count()
    };
    let known = all(&upright).concat().len();
    assert!(known >= 8 && agreeing(&turned) * 10 >= known * 8, "{} of {known}", agreeing(&turned));
    assert!(agreeing(&as_it_is) * 2 < known, "{} of {known}: nothing is shown", agreeing(&as_it_is));
}

#[test]
fn a_higher_threshold_keeps_only_the_best_boxes() {
    let folder = tempfile::tempdir().unwrap();
    render(folder.path());
    let scores = |score: &str| -> Vec<f64> {
        succeeds(folder.path(), &["detect", "rec/rgb", "--score", score, "--out", score, "-q"]);
        let list = boxes(&folder.path().join(score));
        let found = list["images"].as_array().unwrap().iter().flat_map(|image| image["boxes"].as_array().unwrap());
        found.map(|found| found["score"].as_f64().unwrap()).collect()
    };
    // Halfway between the lowest and the highest score.
    let many = scores("0.05");
    let (least, best) = many.iter().fold((1.0f64, 0.0f64), |(low, high), score| (low.min(*score), high.max(*score)));
    let middle = format!("{:.3}", 0.5 * (least + best));
    let few = scores(&middle);
    assert!(!few.is_empty() && many.len() > few.len(), "{many:?}");
    let limit: f64 = middle.parse().unwrap();
    assert_eq!(few, many.into_iter().filter(|score| *score > limit).collect::<Vec<_>>());
}

#[test]
fn an_image_that_cannot_be_read_is_reported_and_the_others_are_processed() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    write_color_png(&root.join("images/good.png"), &RgbImage::new(40, 30)).unwrap();
    let bytes = fs::read(root.join("images/good.png")).unwrap();
    fs::write(root.join("images/cut.png"), &bytes[..bytes.len() / 2]).unwrap();
    fs::write(root.join("images/notes.txt"), "not an image").unwrap();
    fs::write(root.join("photo.jpg"), "RIFF....WEBP").unwrap();
    let output = yfslam(root, &["detect", "images", "photo.jpg", "--out", "out"]);
    assert!(!output.success);
    for words in ["images/cut.png is damaged", "photo.jpg is a WebP image", "2 of 3 images could not be read"] {
        assert!(output.stderr.contains(words), "no '{words}' in {}", output.stderr);
    }
    let images = boxes(&root.join("out"))["images"].clone();
    assert!(images[0]["error"].as_str().unwrap().contains("damaged") && images[0].get("boxes").is_none());
    assert_eq!(images[1]["boxes"], Value::Array(Vec::new()));
}

#[test]
fn unusable_arguments_are_refused_before_the_first_image() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    fs::create_dir_all(root.join("seq/rgb")).unwrap();
    fs::create_dir(root.join("empty")).unwrap();
    write_color_png(&root.join("a.png"), &RgbImage::new(40, 30)).unwrap();
    fails(root, &["detect", "a.png", "nowhere.png"], &["nowhere.png does not exist", "check the path"]);
    fails(root, &["detect", "empty"], &["empty holds no images", ".png, .jpg or .jpeg"]);
    fails(root, &["detect", "seq"], &["did you mean seq/rgb?"]);
    fails(root, &["detect", "a.png", "--class", "unicorn"], &["'unicorn'", "its classes are: person"]);
    fails(root, &["detect", "a.png", "--score", "1.5"], &["score_threshold = 1.5", "between 0 and 1"]);
    fails(root, &["detect", "a.png", "--score", "-1"], &["score_threshold = -1"]);
    fails(root, &["detect", "a.png", "--detector", "nowhere.onnx"], &["nowhere.onnx", "check the path"]);
    fails(root, &["detect"], &["IMAGE|FOLDER"]);
    assert!(!root.join("yfslam-out/detect/boxes.json").exists());
}

#[test]
fn classes_of_another_network_are_kept_apart() {
    let (Some(model), Some(sequence)) =
        (real_data("models/yolo-fastestv2-coco.onnx"), real_data("rgbd/tum_fr1_xyz_dev/rgb"))
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (model, sequence) = (model.to_str().unwrap(), sequence.to_str().unwrap());
    let run = |classes: &str, out: &str| -> Vec<String> {
        let args = ["detect", sequence, "--detector", model, "--class", classes, "--out", out, "-q"];
        succeeds(folder.path(), &args);
        let list = boxes(&folder.path().join(out));
        let found = list["images"].as_array().unwrap().iter().flat_map(|image| image["boxes"].as_array().unwrap());
        found.map(|found| found["class"].as_str().unwrap().to_owned()).collect()
    };
    let (both, screens) = (run("tv,keyboard", "both"), run("tv", "tv"));
    assert!(both.iter().any(|class| class == "keyboard"));
    assert!(!screens.is_empty() && screens.iter().all(|class| class == "tv"));
    assert_eq!(both.iter().filter(|class| *class == "tv").count(), screens.len());
}
