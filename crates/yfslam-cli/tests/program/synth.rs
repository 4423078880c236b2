//! `yfslam synth`: the written recording equals the rendered world.

use std::fs;
use std::path::Path;

use crate::common::{ate_rmse, fails, report, succeeds};
use serde_json::Value;
use yfslam_synth::{World, parse_with_camera};

const WORLD: &str = "walking_xyz?people=2&share=0.3&width=320&height=240&frames=16";

fn same_trajectory(a: &Path, b: &Path) {
    for name in ["trajectory.txt", "keyframes.txt", "live.txt", "map.ply"] {
        assert_eq!(fs::read(a.join(name)).unwrap(), fs::read(b.join(name)).unwrap(), "{name} differs");
    }
}

#[test]
fn a_written_world_is_tracked_to_the_same_bits_as_the_rendered_one_also_with_boxes_and_distortion() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let (world, camera) = (format!("synth:{WORLD}"), ["--camera", "tum1"]);
    succeeds(root, &[&["synth", WORLD, "--out", "rec", "-q"], &camera[..]].concat());
    for (part, options) in [("forward", &[][..]), ("backward", &["--reverse", "--start", "2"])] {
        let (a, b) = (format!("a/{part}"), format!("b/{part}"));
        succeeds(root, &[&["run", &world, "--out", &a, "-q"], &camera[..], options].concat());
        let output = succeeds(root, &[&["run", "rec", "--out", &b], options].concat());
        assert!(output.stderr.contains("boxes.json"), "{}", output.stderr);
        same_trajectory(&root.join(a), &root.join(&b));
        let report = report(&root.join(b));
        assert_eq!(report["boxes"], "folder");
        assert!(report["dynamic"]["boxes"].as_u64().unwrap() > 0);
        assert!(ate_rmse(&report) < 0.02, "{part}: {}", ate_rmse(&report));
    }
}

#[test]
fn the_camera_file_has_the_readout_that_the_world_mentions_and_does_not_withhold() {
    let folder = tempfile::tempdir().unwrap();
    let camera = |query: &str, out: &str| -> toml::Table {
        let world = format!("walking_xyz?people=0&width=64&height=48&frames=2{query}");
        succeeds(folder.path(), &["synth", &world, "--out", out, "-q"]);
        toml::from_str(&fs::read_to_string(folder.path().join(out).join("camera.toml")).unwrap()).unwrap()
    };
    let told = camera("&readout=30&depth_readout=-20&offset_ms=8", "told");
    let ms = ["readout_ms", "depth_readout_ms", "depth_delay_ms"].map(|key| told[key].as_float().unwrap());
    assert_eq!(ms, [30.0, -20.0, 0.0], "the stamps contain the whole offset");
    for (query, out) in [("", "global"), ("&readout=30&unknown_readout=on", "withheld")] {
        assert!(camera(query, out).keys().all(|key| !key.ends_with("_ms")), "{query}");
    }
}

#[test]
fn boxes_masks_settings_and_lists_equal_those_of_the_world() {
    let folder = tempfile::tempdir().unwrap();
    let rec = folder.path().join("rec");
    succeeds(folder.path(), &["synth", WORLD, "--out", "rec", "-q"]);
    let config: yfslam_synth::WorldConfig =
        toml::from_str(&fs::read_to_string(rec.join("world.toml")).unwrap()).unwrap();
    assert_eq!(config, parse_with_camera(WORLD, yfslam_synth::default_camera(), 5000.0).unwrap());
    let world = World::new(&config).unwrap();
    let boxes: Value = serde_json::from_str(&fs::read_to_string(rec.join("boxes.json")).unwrap()).unwrap();
    assert_eq!(boxes["frames"].as_array().unwrap().len(), 16);
    let shot = world.frame(9);
    let known = &boxes["frames"][9];
    assert_eq!(known["timestamp_ns"], shot.frame.timestamp_ns);
    assert_eq!(known["boxes"].as_array().unwrap().len(), shot.boxes.len());
    for (known, (instance, class, bbox)) in known["boxes"].as_array().unwrap().iter().zip(&shot.boxes) {
        assert_eq!(
            (&known["instance"], &known["class"]),
            (&(*instance).into(), &yfslam_synth::CLASS_NAMES[*class].into())
        );
        assert_eq!(known["bbox"][2], f64::from(bbox.x_max));
    }
    let stamp = yfslam_io::time::format_stamp(shot.frame.timestamp_ns);
    let mut mask = yfslam::RgbImage::default();
    let bytes = fs::read(rec.join(format!("masks/{stamp}.png"))).unwrap();
    yfslam_io::decode::decode_color(&bytes, None, &mut mask).unwrap();
    assert!(mask.data().iter().map(|rgb| rgb[0]).eq(shot.instances.data().iter().copied()));
    for list in ["rgb.txt", "depth.txt", "associations.txt", "groundtruth.txt"] {
        let text = fs::read_to_string(rec.join(list)).unwrap();
        assert_eq!(text.lines().filter(|line| !line.starts_with('#')).count(), 16, "{list}");
    }
}

#[test]
fn a_carried_laptop_has_its_name_its_box_and_its_mask() {
    let folder = tempfile::tempdir().unwrap();
    let world = "carried_box?object=laptop&people=1&share=0.15&motion=static&fps=1&frames=30&width=320&height=240";
    succeeds(folder.path(), &["synth", world, "--out", "rec", "-q"]);
    let rec = folder.path().join("rec");
    let boxes: Value = serde_json::from_str(&fs::read_to_string(rec.join("boxes.json")).unwrap()).unwrap();
    let mut seen = 0;
    for frame in boxes["frames"].as_array().unwrap() {
        let Some(found) = frame["boxes"].as_array().unwrap().iter().find(|b| b["class"] == "laptop") else { continue };
        assert_eq!(found["instance"], 2);
        let stamp = yfslam_io::time::format_stamp(frame["timestamp_ns"].as_i64().unwrap());
        let mut mask = yfslam::RgbImage::default();
        let bytes = fs::read(rec.join(format!("masks/{stamp}.png"))).unwrap();
        yfslam_io::decode::decode_color(&bytes, None, &mut mask).unwrap();
        let own: Vec<usize> = (0..mask.data().len()).filter(|&i| mask.data()[i][0] == 2).collect();
        let (columns, rows) = (own.iter().map(|i| i % 320), own.iter().map(|i| i / 320));
        let bounds = [
            columns.clone().min().unwrap(),
            rows.clone().min().unwrap(),
            columns.max().unwrap() + 1,
            rows.max().unwrap() + 1,
        ];
        for (edge, bound) in bounds.into_iter().enumerate() {
            assert_eq!(found["bbox"][edge], bound as f64, "{stamp}");
        }
        seen += 1;
    }
    assert!(seen >= 5, "the laptop is seen in {seen} of 30 frames");
}

#[test]
fn an_existing_folder_is_only_replaced_if_it_is_a_recording_and_force_is_given() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let small = "walking_static?people=0&width=64&height=48&frames=3";
    fs::create_dir(root.join("mine")).unwrap();
    fs::write(root.join("mine/thesis.txt"), "years").unwrap();
    fails(root, &["synth", small, "--out", "mine"], &["mine", "is not empty", "--force"]);
    fails(root, &["synth", small, "--out", "mine", "--force"], &["is not a recording"]);
    assert_eq!(fs::read_to_string(root.join("mine/thesis.txt")).unwrap(), "years");
    fs::create_dir(root.join("rec")).unwrap();
    succeeds(root, &["synth", small, "--out", "rec"]);
    fails(root, &["synth", small, "--out", "rec"], &["--force"]);
    succeeds(root, &["synth", "walking_static?people=0&width=64&height=48&frames=2", "--out", "rec", "--force"]);
    assert_eq!(fs::read_dir(root.join("rec/rgb")).unwrap().count(), 2);
    fails(root, &["synth", "walking_sideways", "--out", "new"], &["walking_sideways", "walking_xyz"]);
    let mut left: Vec<_> = fs::read_dir(root).unwrap().map(|e| e.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["mine", "rec"], "nothing temporary stays");
}

#[test]
fn the_list_has_every_name_and_each_world_can_be_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let text = succeeds(folder.path(), &["synth", "--list"]).stdout;
    assert_eq!(text.lines().count(), yfslam_synth::SUITE.len());
    for name in yfslam_synth::names() {
        assert!(text.lines().any(|line| line.starts_with(name) && line.len() > name.len() + 20), "{name}: {text}");
        let spec = format!("{name}?width=64&height=48&frames=2");
        succeeds(folder.path(), &["synth", &spec, "--out", name, "-q"]);
    }
    fails(folder.path(), &["synth"], &["--out", "WORLD"]);
}

#[test]
fn a_number_that_no_world_can_have_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let world = "synth:walking_xyz?robots=18446744073709551615&people=4&frames=3&width=64&height=48";
    for command in ["run", "info"] {
        fails(
            folder.path(),
            &[command, world],
            &["robots", "18446744073709551615", "at most 6 together with the people"],
        );
    }
}
