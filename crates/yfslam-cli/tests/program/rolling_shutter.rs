//! A rolling shutter that is known costs no accuracy: the camera is tracked as with a global shutter.

use crate::common::{ate_rmse, report, succeeds};

/// A camera that turns, without noise of the sensor.
const WORLD: &str = "synth:walking_rpy?people=0&width=400&height=300&frames=240&noise=off";

/// Returns the rotation error of each frame relative to the one before, RMSE, degrees, and the absolute trajectory error, m, of a quick
/// part of the world.
fn errors(shutter: &str, config: &str) -> [f64; 2] {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("config.toml"), config).unwrap();
    let part = ["--start", "100", "--end", "240", "--method", "none"];
    let spec = format!("{WORLD}{shutter}");
    succeeds(folder.path(), &[&["run", &spec, "-c", "config.toml", "-q", "-o", "out"][..], &part].concat());
    let report = report(&folder.path().join("out"));
    [report["evaluation"]["rpe"][0]["rotation_deg"]["rmse"].as_f64().unwrap(), ate_rmse(&report)]
}

#[test]
fn a_known_rolling_shutter_errs_like_a_global_one() {
    let [global_deg, global_m] = errors("", "");
    let [known_deg, known_m] = errors("&readout=33", "");
    let ignored = "[tracking]\nestimate_readout = \"never\"\n";
    let [ignored_deg, ignored_m] = errors("&readout=33&unknown_readout=on", ignored);
    assert!(known_m <= 1.15 * global_m, "{known_m} m instead of {global_m} m");
    assert!(known_deg <= 1.15 * global_deg, "{known_deg}° instead of {global_deg}°");
    // The control: this camera turns fast enough that the readout matters. From frame to frame most of the error is noise of the features,
    // which no correction removes, so that only the trajectory has a bound.
    assert!(ignored_m > 1.2 * known_m && ignored_deg > known_deg, "ignored: {ignored_deg}°, {ignored_m} m");
}
