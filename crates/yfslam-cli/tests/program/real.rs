//! Recorded sequences, if they are available: accuracy, and memory.

use std::fs;

use crate::common::{ate_rmse, real_data, report, succeeds};
use serde_json::Value;

const MODEL: &str = "models/yolo-fastestv2-coco.onnx";

/// Runs a sequence; `None` if the data is missing.
fn run(sequence: &str, method: &str) -> Option<Value> {
    let (sequence, model) = (real_data(sequence)?, real_data(MODEL)?);
    let folder = tempfile::tempdir().unwrap();
    let (sequence, model) = (sequence.to_str().unwrap(), model.to_str().unwrap());
    succeeds(folder.path(), &["run", sequence, "--method", method, "--detector", model, "--out", "out", "-q"]);
    Some(report(&folder.path().join("out")))
}

#[test]
fn a_static_desk_is_tracked_within_11_5_mm_with_and_without_the_filter() {
    for method in ["none", "yf"] {
        let Some(report) = run("rgbd/tum_fr1_xyz_dev", method) else { return };
        assert_eq!(report["frames"]["tracked"], 300, "{method}");
        assert!(ate_rmse(&report) <= 0.0115, "{method}: {}", ate_rmse(&report));
    }
}

#[test]
fn a_crowd_is_tracked_in_every_frame_within_30_mm_and_120_mb() {
    let Some(report) = run("rgbd/bonn_crowd_dev", "yf") else { return };
    assert_eq!(report["frames"]["tracked"], 600);
    assert!(ate_rmse(&report) <= 0.030, "{}", ate_rmse(&report));
    if let Some(peak_mb) = report["peak_memory_mb"].as_f64() {
        assert!(peak_mb <= 120.0, "{peak_mb}");
    }
}

#[test]
fn a_crowd_with_a_network_on_its_own_thread_gives_the_same_bytes_twice() {
    let (Some(sequence), Some(model)) = (real_data("rgbd/bonn_crowd_dev"), real_data(MODEL)) else { return };
    let folder = tempfile::tempdir().unwrap();
    let (sequence, model) = (sequence.to_str().unwrap(), model.to_str().unwrap());
    for out in ["a", "b"] {
        let args = ["run", sequence, "--detector", model, "--start", "260", "--end", "340", "--reverse", "--out", out];
        succeeds(folder.path(), &args);
    }
    for name in ["trajectory.txt", "keyframes.txt", "live.txt", "map.ply"] {
        let [a, b] = ["a", "b"].map(|out| fs::read(folder.path().join(out).join(name)).unwrap());
        assert!(a == b, "{name} differs");
    }
}
