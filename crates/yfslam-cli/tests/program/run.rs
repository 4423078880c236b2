//! `yfslam run` on synthetic worlds: accuracy, repeatability, output files.

use std::fs;
use std::path::Path;

use crate::common::{SMALL_WORLD, ate_rmse, record, report, succeeds, yfslam};

/// People who walk through the image; small enough to be quick.
const WALKING: &str = "synth:walking_xyz?people=2&share=0.3&width=320&height=240&frames=40";

/// Files that depend on the input and the configuration alone.
const REPEATABLE: [&str; 5] = ["trajectory.txt", "keyframes.txt", "live.txt", "map.ply", "config.toml"];

fn assert_same_files(a: &Path, b: &Path) {
    for name in REPEATABLE {
        assert_eq!(fs::read(a.join(name)).unwrap(), fs::read(b.join(name)).unwrap(), "{name} differs");
    }
}

#[test]
fn a_walk_among_people_is_tracked_in_every_frame_within_10_mm() {
    let folder = tempfile::tempdir().unwrap();
    let output = succeeds(folder.path(), &["run", WALKING]);
    assert!(output.stderr.contains("boxes of people come from the renderer"), "{}", output.stderr);
    assert!(output.stdout.contains("tracked 40 of 40 frames") && output.stdout.contains("ATE"), "{}", output.stdout);
    let out = folder.path().join("yfslam-out/walking_xyz");
    let report = report(&out);
    assert!(ate_rmse(&report) < 0.010, "{}", ate_rmse(&report));
    assert_eq!(report["frames"]["tracked"], 40);
    assert_eq!(report["boxes"], "renderer");
    assert!(report["dynamic"]["dynamic_features"].as_u64().unwrap() > 0);
    for stage in ["render", "features", "dynamic_filter", "tracking", "mapping"] {
        assert!(report["times"][stage]["median_ms"].as_f64().is_some(), "{stage}: {}", report["times"]);
    }
    let total = report["process_ms_per_frame"].as_f64().unwrap();
    let parts = report["process_parts_ms_per_frame"].as_object().unwrap();
    let sum: f64 = parts.values().map(|ms| ms.as_f64().unwrap()).sum();
    assert!((sum - total).abs() < 0.01 || parts["other"] == 0.0, "{total} ms, {parts:?}");
    assert!(
        ["reading", "tracking", "mapping_and_loops"].iter().all(|part| parts[*part].as_f64() > Some(0.0)),
        "{parts:?}"
    );
    assert!(output.stdout.contains("processor time per frame: "), "{}", output.stdout);
    for name in ["trajectory.txt", "live.txt"] {
        let poses = fs::read_to_string(out.join(name)).unwrap();
        assert_eq!(poses.lines().filter(|line| !line.starts_with('#')).count(), 40, "{name}");
    }
}

#[test]
fn the_same_run_twice_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for grouping in ["exact", "ransac"] {
        for out in ["a", "b"] {
            succeeds(folder.path(), &["run", WALKING, "--grouping", grouping, "--seed", "7", "--out", out, "-q"]);
        }
        assert_same_files(&folder.path().join("a"), &folder.path().join("b"));
    }
}

#[test]
fn the_written_configuration_repeats_the_run() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("seq"));
    let args = ["run", "seq", "--method", "none", "--grouping", "ransac", "--seed", "3", "--out", "a", "-q"];
    succeeds(folder.path(), &args);
    succeeds(folder.path(), &["run", "seq", "--config", "a/config.toml", "--out", "b", "-q"]);
    assert_same_files(&folder.path().join("a"), &folder.path().join("b"));
    let config = &report(&folder.path().join("b"))["config"]["dynamic"];
    assert_eq!((&config["method"], &config["seed"]), (&"none".into(), &3.into()));
}

#[test]
fn a_recording_of_the_world_is_tracked_to_the_same_bytes_as_the_world() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("recording"));
    for (sequence, out) in [(SMALL_WORLD, "a"), ("recording", "b")] {
        for (part, args) in [("whole", &[][..]), ("part", &["--start", "2", "--end", "11", "--reverse"])] {
            let out = format!("{out}/{part}");
            let args = [&["run", sequence, "--method", "none", "--out", &out], args].concat();
            succeeds(folder.path(), &args);
        }
    }
    for (part, frames) in [("whole", 12), ("part", 9)] {
        let (a, b) = (folder.path().join("a").join(part), folder.path().join("b").join(part));
        assert_same_files(&a, &b);
        let report = report(&b);
        assert_eq!(report["frames"]["tracked"], frames);
        assert_eq!(report["evaluation"]["matches"], frames);
        assert!(ate_rmse(&report) < 0.010, "{part}: {}", ate_rmse(&report));
    }
}

#[test]
fn an_overlay_has_one_image_for_each_frame_and_none_of_an_earlier_run() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("seq"));
    let images = || {
        let mut names: Vec<_> =
            fs::read_dir(folder.path().join("o/overlay")).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        names
    };
    succeeds(folder.path(), &["run", "seq", "--method", "none", "--overlay", "--out", "o", "--end", "5"]);
    assert_eq!(images(), ["000000.jpg", "000001.jpg", "000002.jpg", "000003.jpg", "000004.jpg"]);
    succeeds(folder.path(), &["run", "seq", "--method", "none", "--overlay", "--out", "o", "--end", "2"]);
    assert_eq!(images(), ["000000.jpg", "000001.jpg"]);
}

#[test]
fn a_quiet_run_prints_nothing() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("seq"));
    let output = yfslam(folder.path(), &["run", "seq", "--method", "none", "--quiet"]);
    assert_eq!((output.success, output.stdout.as_str(), output.stderr.as_str()), (true, "", ""));
}

#[test]
fn a_walk_is_tracked_with_boxes_on_every_fifth_frame_and_with_an_asynchronous_detector() {
    let folder = tempfile::tempdir().unwrap();
    let every = |n: &str| {
        succeeds(folder.path(), &["run", WALKING, "--detect-every", n, "--out", n, "-q"]);
        report(&folder.path().join(n))
    };
    let [all, fifth] = ["1", "5"].map(every);
    assert!(ate_rmse(&fifth) < 0.010, "{}", ate_rmse(&fifth));
    let boxes = |report: &serde_json::Value| report["dynamic"]["boxes"].as_u64().unwrap();
    assert!(boxes(&fifth) > 0 && 4 * boxes(&fifth) < boxes(&all), "{} of {}", boxes(&fifth), boxes(&all));
    let live = ["run", WALKING, "--detector", "embedded", "--detect-async"];
    let refused = yfslam(folder.path(), &live);
    assert!(!refused.success && refused.stderr.contains("--threaded"), "{}", refused.stderr);
    succeeds(folder.path(), &[&live[..], &["--threaded", "--out", "live", "-q"]].concat());
    let live = report(&folder.path().join("live"));
    assert_eq!(live["frames"]["tracked"], 40);
    let detections = live["times"]["detector"]["count"].as_u64().unwrap();
    assert!((1..=40).contains(&detections), "{detections}");
    let refused = yfslam(folder.path(), &["run", WALKING, "--detect-every", "0"]);
    assert!(!refused.success && refused.stderr.contains("detect-every"), "{}", refused.stderr);
}
