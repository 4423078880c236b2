//! Faults of camera and driver: the run ends in order, every frame is accounted for, and the pose is found again or called lost.
#![allow(clippy::unwrap_used, reason = "a test may")]

mod common;

use std::path::Path;

use common::{fails, report, succeeds};
use serde_json::Value;

/// 45 frames in 1.5 s; the fault strikes 12 of them.
const WORLD: &str = "walking_xyz?people=2&share=0.2&width=320&height=240&frames=45";
const WHEN: &str = "0.5+0.4";
const FRAMES: u64 = 45;
const STRUCK: u64 = 12;

fn count(report: &Value, key: &str) -> u64 {
    report["frames"][key].as_u64().unwrap()
}

fn run(folder: &Path, sequence: &str, faults: &[&str], out: &str) -> Value {
    let faults: Vec<&str> = faults.iter().flat_map(|fault| ["--fault", fault]).collect();
    succeeds(folder, &[&["run", sequence, "--out", out, "-q"], &faults[..]].concat());
    report(&folder.join(out))
}

/// Runs with one fault and checks what holds for all of them; `skipped` are the frames that SLAM must not see.
fn strike(kind: &str, frames: u64, skipped: u64, reason: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let fault = format!("{kind}@{WHEN}");
    let report = run(folder.path(), &format!("synth:{WORLD}"), &[&fault], "out");
    let [read, tracked, lost, before] = ["read", "tracked", "lost", "before_map"].map(|key| count(&report, key));
    assert_eq!((read, count(&report, "skipped")), (frames - skipped, skipped), "{kind}");
    assert_eq!(tracked + lost + before, read, "{kind}: every frame has a state");
    assert_eq!(report["frames"]["skipped_by_reason"].get(reason).and_then(Value::as_u64).unwrap_or(0), skipped);
    assert_eq!(report["faults"].as_array().unwrap().len(), 1);
    // The pose before the fault stands, and what is not tracked is called lost.
    assert!(tracked >= 15, "{kind}: {tracked} tracked");
    let live = std::fs::read_to_string(folder.path().join("out/live.txt")).unwrap();
    assert_eq!(live.lines().filter(|line| !line.starts_with('#')).count() as u64, tracked, "{kind}");
    // Judged by all frames of the world, faults or not.
    assert_eq!(report["evaluation"]["coverage"]["expected"], FRAMES, "{kind}: {}", report["evaluation"]["coverage"]);
    report
}

#[test]
fn dropped_frames_are_missed_and_the_pose_is_found_again() {
    let report = strike("dropped", FRAMES - STRUCK, 0, "");
    assert_eq!(count(&report, "tracked"), FRAMES - STRUCK);
}

#[test]
fn repeated_frames_are_refused_once_each() {
    let report = strike("repeated", FRAMES + STRUCK, STRUCK, "refused by the tracker");
    assert_eq!(count(&report, "tracked"), FRAMES);
}

#[test]
fn late_frames_are_refused() {
    let report = strike("late", FRAMES, STRUCK / 2, "refused by the tracker");
    assert_eq!(count(&report, "tracked"), FRAMES - STRUCK / 2);
}

#[test]
fn white_and_black_pictures_are_called_lost_and_no_pose_is_made_up() {
    for kind in ["blank", "black"] {
        let report = strike(kind, FRAMES, 0, "");
        assert!(count(&report, "lost") + count(&report, "before_map") >= STRUCK, "{kind}: {}", report["frames"]);
    }
}

#[test]
fn a_frozen_picture_does_not_end_the_run() {
    strike("frozen", FRAMES, 0, "");
}

#[test]
fn frames_without_depth_or_time_or_under_a_cover_are_skipped_and_counted() {
    for (kind, reason) in [
        ("depth-dropout", "no depth in any pixel"),
        ("covered", "no depth in any pixel"),
        ("nan-stamp", "no time stamp"),
    ] {
        let report = strike(kind, FRAMES, STRUCK, reason);
        assert_eq!(count(&report, "tracked"), FRAMES - STRUCK, "{kind}: found again");
    }
}

#[test]
fn faults_on_disk_are_those_in_process() {
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
    // A recording can be struck while it is played, too.
    let played = run(root, "rec", &["depth-dropout@0.1+0.1"], "played");
    assert_eq!(count(&played, "skipped"), 6, "{}", played["frames"]);
}

#[test]
fn an_unknown_fault_is_refused_with_all_kinds() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["run", "synth:walking_xyz", "--fault", "sleepy@1+2"];
    fails(folder.path(), &args, &["sleepy", "KIND@START+SECONDS", "depth-dropout", "nan-stamp"]);
}
