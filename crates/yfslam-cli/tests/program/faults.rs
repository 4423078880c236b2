//! Faults of camera and driver: the run ends normally, every frame is counted, and the camera is relocalised or lost.

use std::path::Path;

use crate::common::{fails, report, succeeds};
use serde_json::Value;

/// 45 frames in 1.5 s; 12 of them have the fault.
const WORLD: &str = "walking_xyz?people=2&share=0.2&width=320&height=240&frames=45";
const WHEN: &str = "0.5+0.4";
const FRAMES: u64 = 45;
const FAULTY: u64 = 12;

fn count(report: &Value, key: &str) -> u64 {
    report["frames"][key].as_u64().unwrap()
}

fn run(folder: &Path, sequence: &str, faults: &[&str], out: &str) -> Value {
    let faults: Vec<&str> = faults.iter().flat_map(|fault| ["--fault", fault]).collect();
    succeeds(folder, &[&["run", sequence, "--out", out, "-q"], &faults[..]].concat());
    report(&folder.join(out))
}

/// Runs with one fault and checks what holds for all faults; `skipped` is the number of frames that SLAM must not get.
fn run_with_fault(kind: &str, frames: u64, skipped: u64, reason: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let fault = format!("{kind}@{WHEN}");
    let report = run(folder.path(), &format!("synth:{WORLD}"), &[&fault], "out");
    let [read, tracked, lost, before] = ["read", "tracked", "lost", "before_map"].map(|key| count(&report, key));
    assert_eq!((read, count(&report, "skipped")), (frames - skipped, skipped), "{kind}");
    assert_eq!(tracked + lost + before, read, "{kind}: every frame has a state");
    assert_eq!(report["frames"]["skipped_by_reason"].get(reason).and_then(Value::as_u64).unwrap_or(0), skipped);
    assert_eq!(report["faults"].as_array().unwrap().len(), 1);
    // Poses before the fault remain, and frames that are not tracked are lost.
    assert!(tracked >= 15, "{kind}: {tracked} tracked");
    let live = std::fs::read_to_string(folder.path().join("out/live.txt")).unwrap();
    assert_eq!(live.lines().filter(|line| !line.starts_with('#')).count() as u64, tracked, "{kind}");
    // Evaluated with all frames of the world, also those with faults.
    assert_eq!(report["evaluation"]["coverage"]["expected"], FRAMES, "{kind}: {}", report["evaluation"]["coverage"]);
    report
}

#[test]
fn tracking_continues_after_dropped_frames() {
    let report = run_with_fault("dropped", FRAMES - FAULTY, 0, "");
    assert_eq!(count(&report, "tracked"), FRAMES - FAULTY);
}

#[test]
fn repeated_frames_are_refused_once_each() {
    let report = run_with_fault("repeated", FRAMES + FAULTY, FAULTY, "refused by the tracker");
    assert_eq!(count(&report, "tracked"), FRAMES);
}

#[test]
fn late_frames_are_refused() {
    let report = run_with_fault("late", FRAMES, FAULTY / 2, "refused by the tracker");
    assert_eq!(count(&report, "tracked"), FRAMES - FAULTY / 2);
}

#[test]
fn the_camera_is_lost_in_white_and_black_images_and_has_no_pose() {
    for kind in ["blank", "black"] {
        let report = run_with_fault(kind, FRAMES, 0, "");
        assert!(count(&report, "lost") + count(&report, "before_map") >= FAULTY, "{kind}: {}", report["frames"]);
    }
}

#[test]
fn a_frozen_image_does_not_end_the_run() {
    run_with_fault("frozen", FRAMES, 0, "");
}

#[test]
fn frames_without_depth_or_time_or_under_a_cover_are_skipped_and_counted() {
    for (kind, reason) in [
        ("depth-dropout", "no depth in any pixel"),
        ("covered", "no depth in any pixel"),
        ("nan-stamp", "no time stamp"),
    ] {
        let report = run_with_fault(kind, FRAMES, FAULTY, reason);
        assert_eq!(count(&report, "tracked"), FRAMES - FAULTY, "{kind}: tracked after the fault");
    }
}

#[test]
fn faults_of_a_recording_equal_those_of_a_world() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let kinds = ["dropped@0.3+0.1", "repeated@0.5+0.1", "nan-stamp@0.7+0.1", "late@0.9+0.2", "depth-dropout@1.2+0.1"];
    let faults: Vec<&str> = kinds.iter().flat_map(|fault| ["--fault", fault]).collect();
    succeeds(root, &[&["synth", WORLD, "--out", "rec", "-q"], &faults[..]].concat());
    let disk = run(root, "rec", &[], "disk");
    let process = run(root, &format!("synth:{WORLD}"), &kinds, "process");
    assert_eq!(count(&disk, "tracked"), count(&process, "tracked"));
    for name in ["trajectory.txt", "live.txt", "map.ply"] {
        let read = |out: &str| std::fs::read(root.join(out).join(name)).unwrap();
        assert_eq!(read("disk"), read("process"), "{name}");
    }
    let association = &disk["association"];
    for (key, expected) in [("duplicate_stamps_skipped", 3), ("unstamped_skipped", 3), ("backward_stamps_skipped", 3)] {
        assert_eq!(association[key], expected, "{key}: {association}");
    }
    assert_eq!(count(&disk, "skipped"), 3, "{}", disk["frames"]);
    // Faults can also be injected while a recording is played.
    let played = run(root, "rec", &["depth-dropout@0.1+0.1"], "played");
    assert_eq!(count(&played, "skipped"), 6, "{}", played["frames"]);
}

#[test]
fn an_unknown_fault_is_refused_with_all_kinds() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["run", "synth:walking_xyz", "--fault", "sleepy@1+2"];
    fails(folder.path(), &args, &["sleepy", "KIND@START+SECONDS", "depth-dropout", "nan-stamp"]);
}
