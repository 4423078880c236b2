//! Faulty input: an error with file, value and what to do, or a skipped frame that is counted.

use std::fs;
use std::path::Path;

use crate::common::{SMALL_WORLD, edit_lines, fails, record, report, succeeds};
use tempfile::TempDir;
use yfslam::Image;
use yfslam_io::write::{write_color_png, write_depth_png};

fn recording() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("seq"));
    folder
}

/// Runs a recording with one faulty frame: the others are tracked, the faulty one is counted and named.
#[track_caller]
fn assert_skipped(folder: &TempDir, reason: &str, file: &str) {
    let output = succeeds(folder.path(), &["run", "seq", "--method", "none", "--out", "out"]);
    let frames = &report(&folder.path().join("out"))["frames"];
    assert_eq!((frames["read"].as_u64(), frames["tracked"].as_u64()), (Some(11), Some(11)), "{frames}");
    assert_eq!((&frames["skipped"], &frames["skipped_by_reason"][reason]), (&1.into(), &1.into()), "{frames}");
    assert!(frames["first_skipped"].as_str().unwrap().contains(file), "{frames}");
    assert!(output.stdout.contains(&format!("1 × {reason}")) && output.stdout.contains(file), "{}", output.stdout);
}

fn for_each_frame(folder: &TempDir, kind: &str, change: impl Fn(&Path)) {
    for i in 0..12 {
        change(&folder.path().join(format!("seq/{kind}/{i}.png")));
    }
}

fn truncate(path: &Path) {
    let bytes = fs::read(path).unwrap();
    fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
}

const RUN: [&str; 4] = ["run", "seq", "--method", "none"];

#[test]
fn a_missing_an_empty_and_a_wrong_folder_give_different_errors() {
    let folder = recording();
    fs::create_dir(folder.path().join("empty")).unwrap();
    let run = |sequence, words: &[&str]| fails(folder.path(), &["run", sequence, "--method", "none"], words);
    run("nowhere", &["nowhere", "No such file", "check the path"]);
    run("empty", &["empty", "no rgb.txt", "name a folder in TUM RGB-D layout"]);
    run(".", &["did you mean ./seq?"]);
    run("seq/rgb.txt", &["is a file, not a folder"]);
    run("synth:strolling_xyz", &["strolling_xyz", "walking_xyz"]);
}

#[test]
fn a_missing_image_is_a_skip_and_all_missing_is_an_error() {
    let folder = recording();
    fs::remove_file(folder.path().join("seq/rgb/5.png")).unwrap();
    assert_skipped(&folder, "missing file", "rgb/5.png");
    for_each_frame(&folder, "rgb", |path| drop(fs::remove_file(path)));
    fails(folder.path(), &RUN, &["seq", "rgb/0.png", "unpack the images"]);
}

#[test]
fn a_truncated_image_is_a_skip_and_all_truncated_is_an_error() {
    let folder = recording();
    truncate(&folder.path().join("seq/depth/4.png"));
    assert_skipped(&folder, "damaged image", "depth/4.png");
    for_each_frame(&folder, "depth", truncate);
    fails(folder.path(), &RUN, &["depth/0.png", "damaged", "unpack the file again"]);
}

#[test]
fn an_image_of_the_wrong_type_is_a_skip_and_all_wrong_is_an_error() {
    let folder = recording();
    fs::write(folder.path().join("seq/rgb/3.png"), "RIFF....WEBP").unwrap();
    assert_skipped(&folder, "wrong type of image", "rgb/3.png");
    // Colour where depth is expected, as after a mix-up of the lists.
    edit_lines(&folder.path().join("seq/depth.txt"), |_, line| Some(line.replace("depth/", "rgb/")));
    fails(folder.path(), &RUN, &["rgb/0.png", "16-bit grey PNG"]);
}

#[test]
fn depth_of_another_size_is_a_skip_and_all_of_another_size_is_an_error() {
    let folder = recording();
    let write =
        |path: &Path| write_depth_png(path, &Image::from_vec(160, 120, vec![9000; 160 * 120]).unwrap()).unwrap();
    write(&folder.path().join("seq/depth/6.png"));
    assert_skipped(&folder, "wrong size of image", "depth/6.png");
    for_each_frame(&folder, "depth", write);
    fails(folder.path(), &RUN, &["depth/0.png", "160×120", "320×240", "register depth to colour"]);
    for_each_frame(&folder, "rgb", |path| write_color_png(path, &Image::new(64, 48)).unwrap());
    fails(folder.path(), &RUN, &["rgb/0.png", "64×48", "camera file"]);
}

#[test]
fn depth_without_any_measurement_is_a_skip_and_an_error_if_all_frames_are_such() {
    let folder = recording();
    let blind = |path: &Path| write_depth_png(path, &Image::new(320, 240)).unwrap();
    blind(&folder.path().join("seq/depth/7.png"));
    assert_skipped(&folder, "no depth in any pixel", "depth/7.png");
    for_each_frame(&folder, "depth", blind);
    fails(folder.path(), &RUN, &["depth/0.png", "no depth in any pixel", "check the depth sensor"]);
}

#[test]
fn unusable_frames_at_the_start_are_skipped() {
    let folder = recording();
    write_depth_png(&folder.path().join("seq/depth/blind.png"), &Image::new(320, 240)).unwrap();
    for (kind, file) in [("rgb", "rgb/0.png"), ("depth", "depth/blind.png")] {
        let list = folder.path().join(format!("seq/{kind}.txt"));
        let blind: String = (0..35).map(|i| format!("-{}.5 {file}\n", 40 - i)).collect();
        fs::write(&list, blind + &fs::read_to_string(&list).unwrap()).unwrap();
    }
    succeeds(folder.path(), &["run", "seq", "--method", "none", "--out", "out"]);
    let frames = &report(&folder.path().join("out"))["frames"];
    assert_eq!((frames["skipped"].as_u64(), frames["tracked"].as_u64()), (Some(35), Some(12)), "{frames}");
}

#[test]
fn frames_without_features_give_an_error_with_the_reason() {
    let folder = recording();
    for_each_frame(&folder, "rgb", |path| write_color_png(path, &Image::new(320, 240)).unwrap());
    fails(
        folder.path(),
        &RUN,
        &["no trajectory", "the best had 0 features", "tracking.init_min_features asks for 500"],
    );
}

#[test]
fn repeated_and_backward_stamps_are_counted_skips_and_an_unsorted_list_is_an_error() {
    let folder = recording();
    let list = folder.path().join("seq/rgb.txt");
    // Line 3 repeats the stamp of line 2; line 8 runs back before line 1.
    edit_lines(&list, |i, line| {
        let name = line.split_once(' ').unwrap().1;
        Some(match i {
            3 => format!("0.066666667 {name}"),
            8 => format!("0.000000001 {name}"),
            _ => line.to_owned(),
        })
    });
    let output = succeeds(folder.path(), &["run", "seq", "--method", "none", "--out", "out"]);
    let report = report(&folder.path().join("out"));
    let association = &report["association"];
    assert_eq!(association["duplicate_stamps_skipped"], 1, "{association}");
    assert_eq!(association["backward_stamps_skipped"], 1, "{association}");
    assert_eq!(report["frames"]["tracked"], 10);
    assert!(output.stdout.contains("1 × duplicate stamp, 1 × stamp runs backward"), "{}", output.stdout);

    edit_lines(&list, |i, line| Some(format!("{} {}", 100 - i, line.split_once(' ').unwrap().1)));
    fails(folder.path(), &RUN, &["rgb.txt", "stamps run backward", "sort the file"]);
    edit_lines(&list, |i, line| Some(if i == 4 { "soon rgb/4.png".into() } else { line.to_owned() }));
    fails(folder.path(), &RUN, &["rgb.txt:5", "'soon'", "decimal seconds"]);
}

#[test]
fn images_without_common_time_stamps_are_an_error_with_these_stamps() {
    let folder = recording();
    edit_lines(&folder.path().join("seq/depth.txt"), |_, line| Some(format!("77{line}")));
    fails(folder.path(), &RUN, &["no colour image has a depth image within 20.0 ms", "770.0", "same clock"]);
}

#[test]
fn an_implausible_depth_factor_is_refused_with_a_plausible_one() {
    let folder = recording();
    let run = |factor, words: &[&str]| fails(folder.path(), &[&RUN[..], &["--depth-factor", factor]].concat(), words);
    run("1", &["depth factor 1 ", "--depth-factor 5000"]);
    run("1000000", &["depth factor 1000000 ", "--depth-factor 5000"]);
    run("-5", &["depth factor is -5", "1000 for millimetres"]);
}

#[test]
fn an_unknown_or_missing_camera_is_an_error_with_the_presets() {
    let folder = recording();
    fails(folder.path(), &[&RUN[..], &["--camera", "tum9"]].concat(), &["tum9", "tum1, tum2, tum3, bonn"]);
    fs::remove_file(folder.path().join("seq/camera.toml")).unwrap();
    fails(folder.path(), &RUN, &["seq", "no camera file", "--camera"]);
    fails(folder.path(), &["run", SMALL_WORLD, "--camera", "tum9"], &["tum9", "tum1, tum2, tum3, bonn"]);
}

#[test]
fn faulty_ground_truth_is_an_error_if_it_is_requested_and_a_warning_if_it_is_found_in_the_folder() {
    let folder = recording();
    let truth = folder.path().join("seq/groundtruth.txt");
    edit_lines(&truth, |i, line| Some(if i == 2 { "0.066666667 nan 0 0 0 0 0 1".into() } else { line.to_owned() }));
    let explicit = [&RUN[..], &["--groundtruth", "seq/groundtruth.txt"]].concat();
    fails(folder.path(), &explicit, &["groundtruth.txt:3", "tx is 'nan'", "repair the value"]);
    let output = succeeds(folder.path(), &RUN);
    assert!(output.stderr.contains("no evaluation: seq/groundtruth.txt:3"), "{}", output.stderr);
    fails(folder.path(), &["eval", "seq/groundtruth.txt", "yfslam-out/seq/live.txt"], &["groundtruth.txt:3", "'nan'"]);
}

#[test]
fn ground_truth_of_another_recording_fails_the_run_but_not_its_trajectory() {
    let folder = recording();
    edit_lines(&folder.path().join("seq/groundtruth.txt"), |_, line| Some(format!("9{line}")));
    fails(folder.path(), &[&RUN[..], &["--groundtruth", "seq/groundtruth.txt"]].concat(), &["no overlap in time"]);
    assert!(folder.path().join("yfslam-out/seq/trajectory.txt").is_file());
}

#[test]
fn an_unreadable_or_unsupported_network_is_refused() {
    let folder = recording();
    fs::write(folder.path().join("text.onnx"), "This is not a network.").unwrap();
    let run = |file, words: &[&str]| fails(folder.path(), &["run", "seq", "--detector", file], words);
    run("nowhere.onnx", &["nowhere.onnx", "check the path"]);
    run("text.onnx", &["text.onnx", "not a readable ONNX model", "export it again"]);
    // A class that the network does not have, with one method and with several.
    fs::write(folder.path().join("c.toml"), "[dynamic]\nmovable = [\"unicorn\"]\n").unwrap();
    for method in ["yf", "boxes,yf"] {
        let args = ["run", "seq", "--config", "c.toml", "--method", method];
        fails(folder.path(), &args, &["dynamic.movable", "'unicorn'", "it knows: person"]);
    }
    // A valid protobuf without a graph.
    fs::write(folder.path().join("bare.onnx"), [0x08, 0x08]).unwrap();
    run("bare.onnx", &["bare.onnx"]);
}

#[test]
fn an_unknown_key_or_a_bad_value_in_the_configuration_is_named() {
    let folder = recording();
    let refuse = |toml: &str, words: &[&str]| {
        fs::write(folder.path().join("my.toml"), toml).unwrap();
        fails(folder.path(), &[&RUN[..], &["--config", "my.toml"]].concat(), words);
    };
    refuse("[tracking]\nlocal_raduis_px = 4.0\n", &["my.toml", "line 2", "local_raduis_px", "local_radius_px"]);
    refuse("[trakcing]\n", &["my.toml", "trakcing", "tracking"]);
    refuse("[features]\ncount = \"many\"\n", &["my.toml", "line 2", "count"]);
    refuse("[features\n", &["my.toml", "line 1"]);
    fails(folder.path(), &[&RUN[..], &["--config", "nowhere.toml"]].concat(), &["nowhere.toml", "check the path"]);
    fails(folder.path(), &[&RUN[..], &["--association-tolerance", "nan"]].concat(), &["NaN", "milliseconds"]);
    fails(folder.path(), &[&RUN[..], &["--start", "99"]].concat(), &["99", "12 frames", "smaller start"]);
}

#[test]
fn an_output_folder_that_cannot_be_written_is_reported_before_the_run() {
    let folder = recording();
    fs::write(folder.path().join("file"), "").unwrap();
    fails(folder.path(), &[&RUN[..], &["--out", "file/out"]].concat(), &["file/out", "choose another folder"]);
    fails(folder.path(), &["demo", "--out", "file"], &["file", "choose another folder"]);
}

#[test]
fn a_sensor_that_the_sequence_does_not_have_is_refused_and_mono_ignores_depth() {
    let folder = recording();
    for sequence in ["seq", SMALL_WORLD] {
        fails(folder.path(), &["run", sequence, "--sensor", "stereo"], &["no right ", "--sensor", "mono"]);
        fails(folder.path(), &["run", sequence, "--sensor", "mono", "--dense"], &["--dense needs depth images"]);
    }
    fails(folder.path(), &["run", "seq", "--sensor", "mono", "--method", "none"], &["no map could be initialised"]);
}
