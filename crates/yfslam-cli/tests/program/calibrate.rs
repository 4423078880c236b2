//! `yfslam calibrate`: the shutter of a synthetic camera is found from its images alone, or the command says that it is uncertain.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use crate::common::{fails, record, report, succeeds, yfslam};
use tempfile::TempDir;
use yfslam_io::{CameraSource, load_camera};

/// A camera that turns; its calibration does not mention its readout time.
const TURNING: &str = "walking_rpy?people=0&width=320&height=240&frames=200&unknown_readout=on&readout=";

/// The readout time of the rolling shutter, ms.
const ROLLING_MS: f64 = 25.0;

/// Returns a folder with the recording `rolling`.
fn rolling() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    FOLDER.get_or_init(|| turning("rolling", ROLLING_MS)).path()
}

fn turning(name: &str, readout_ms: f64) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["synth", &format!("{TURNING}{readout_ms}"), "-o", name, "-q"]);
    folder
}

/// Calibrates the recording. Returns the camera file, or `None` if the command says that its estimate is uncertain; it then wrote none.
fn calibrated(folder: &Path, args: &[&str], out: &str) -> Option<CameraSource> {
    let output = yfslam(folder, &[&["calibrate"], args, &["-o", out]].concat());
    if output.success {
        assert!(
            output.stdout.contains("readout in use (ms)") && output.stdout.contains("written to"),
            "{}",
            output.stdout
        );
        return Some(load_camera(folder.join(out).to_str().unwrap(), None).unwrap());
    }
    assert!(
        output.stderr.contains("error: uncertain: ") && output.stdout.contains("readout in use (ms)"),
        "{output:?}"
    );
    assert!(!folder.join(out).exists());
    None
}

#[test]
fn a_rolling_shutter_is_found_within_2_ms_and_its_camera_file_is_used_by_a_run() {
    let folder = rolling();
    let Some(source) = calibrated(folder, &["rolling", "--no-delay"], "found.toml") else { return };
    let readout_ms = source.camera.readout_ms.unwrap();
    assert!((readout_ms - ROLLING_MS).abs() < 2.0, "{readout_ms}");
    assert_eq!((source.camera.width, source.camera.depth_delay_ms), (320, None));
    let text = fs::read_to_string(folder.join("found.toml")).unwrap();
    assert!(text.starts_with("# rolling/camera.toml, ") && text.contains("200 frames of rolling"), "{text}");
    let run = succeeds(folder, &["run", "rolling", "--camera", "found.toml", "--end", "20", "-o", "run"]);
    assert!(run.stdout.contains(&format!("rolling shutter: {readout_ms:.1} ms (from the camera file)")), "{run:?}");
    let readout = &report(&folder.join("run"))["readout"];
    assert_eq!((&readout["in_use_ms"], &readout["origin"]), (&readout_ms.into(), &"camera".into()));
    assert_eq!(readout["estimate_ms"], serde_json::Value::Null);
}

#[test]
#[ignore = "long: see CONTRIBUTING.md"]
fn a_recording_in_reverse_has_the_same_shutter_in_its_camera_file() {
    let args = ["rolling", "--reverse", "--no-delay"];
    let Some(source) = calibrated(rolling(), &args, "reverse.toml") else { return };
    let readout_ms = source.camera.readout_ms.unwrap();
    assert!((readout_ms - ROLLING_MS).abs() < 2.0, "{readout_ms}");
}

#[test]
#[ignore = "long: see CONTRIBUTING.md"]
fn a_global_shutter_without_delay_is_written_as_0_and_without_a_file_the_camera_is_printed() {
    let folder = turning("global", 0.0);
    let args = ["calibrate", "global", "--end", "100"];
    let output = yfslam(folder.path(), &args);
    if !output.success {
        assert!(output.stderr.contains("error: uncertain: "), "{output:?}");
        return;
    }
    fs::write(folder.path().join("printed.toml"), &output.stdout).unwrap();
    assert!(
        output.stdout.contains("# delay of depth (ms)") && output.stdout.contains("# global shutter"),
        "{output:?}"
    );
    let camera = load_camera(folder.path().join("printed.toml").to_str().unwrap(), None).unwrap().camera;
    assert_eq!((camera.readout_ms, camera.depth_delay_ms), (Some(0.0), Some(0.0)));
    let again =
        succeeds(folder.path(), &[&args[..], &["--camera", "printed.toml", "--no-delay", "-o", "again.toml"]].concat());
    assert!(again.stderr.contains("the readout time in printed.toml is ignored"), "{}", again.stderr);
    assert!(again.stdout.contains("global shutter"), "{}", again.stdout);
}

#[test]
fn a_recording_without_enough_motion_is_uncertain_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("short"));
    assert_eq!(calibrated(folder.path(), &["short"], "camera.toml"), None);
}

#[test]
fn what_cannot_be_written_is_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("seq"));
    let refused = |more: &[&str], words: &[&str]| fails(folder.path(), &[&["calibrate", "seq"], more].concat(), words);
    refused(&["-o", "seq/camera.toml"], &["seq/camera.toml exists", "--force"]);
    refused(&["-o", "camera.yaml"], &["camera.yaml", "TOML"]);
    refused(&["-o", "seq"], &["is a folder"]);
    refused(&["-o", "seq/camera.toml/below.toml"], &["seq/camera.toml"]);
    refused(&["--force"], &["--out"]);
    refused(&["--detect-async"], &["--detect-async"]);
    refused(&["--camera", "nobody"], &["camera 'nobody'"]);
    fails(folder.path(), &["calibrate", "missing"], &["missing"]);
}
