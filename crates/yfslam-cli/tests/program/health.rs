//! Signs of wrong results: each is in run.json and in the summary when its fault is there, and none is in good worlds and recordings.

use crate::common::{real_data, report, succeeds};
use serde_json::Value;

const WORLD: &str = "synth:walking_xyz?people=1&width=320&height=240&frames=60";

/// Returns the numbers of frames with each sign, and the line of the summary.
fn signs(arguments: &[&str]) -> (Value, Option<String>) {
    let folder = tempfile::tempdir().unwrap();
    let output = succeeds(folder.path(), &[&["run"], arguments, &["--out", "out"]].concat());
    let line = output.stdout.lines().find(|line| line.starts_with("health: ")).map(str::to_owned);
    (report(&folder.path().join("out"))["health"].clone(), line)
}

fn frames(health: &Value, sign: &str) -> u64 {
    health[sign]["frames"].as_u64().unwrap()
}

#[test]
fn good_worlds_and_recordings_show_no_sign() {
    for world in [WORLD, "synth:corridor_loop?people=0&width=320&height=240&frames=60"] {
        assert_eq!(signs(&[world]).1, None, "{world}");
    }
    for (name, camera) in [("rgbd/tum_fr1_xyz_dev", "tum1"), ("rgbd/bonn_crowd_dev", "bonn")] {
        let Some(folder) = real_data(name) else { continue };
        let (_, line) = signs(&[folder.to_str().unwrap(), "--camera", camera, "--end", "200"]);
        assert_eq!(line, None, "{name}");
    }
}

#[test]
fn each_fault_of_depth_images_and_clock_shows_its_sign() {
    for (fault, sign, words) in [
        ("depth-noise@0.8+0.5", "depth_noisy", "depth that is noise"),
        ("depth-scale@0.8+0.5", "depth_contradicts", "depth that contradicts the images"),
        ("depth-saturated@0.8+0.5", "depth_saturated", "saturated depth"),
        ("frozen@0.8+0.5", "image_repeated", "the same image again"),
        ("dropped@0.8+0.5", "time_gap", "a gap in time"),
        ("clock-ahead@0.8+0.5", "time_gap", "a gap in time"),
    ] {
        let (health, line) = signs(&[WORLD, "--fault", fault]);
        assert!(frames(&health, sign) >= 1, "{fault}: {health}");
        assert!(line.as_ref().is_some_and(|line| line.contains(words)), "{fault}: {line:?}");
        let first = health[sign]["first_ns"].as_i64().unwrap();
        assert!(first > 0, "{fault}: {first}");
    }
}
