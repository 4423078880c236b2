//! Relocalisation, loop closing, saved maps, and mapping on its own thread.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::{ate_rmse, fails, report, succeeds};
use yfslam::SavedMap;
use yfslam_io::write_atomically;

/// A desk without people; the camera moves along its axes.
const DESK: &str = "synth:sitting_xyz?people=0&width=320&height=240&frames=90";

#[test]
fn a_camera_that_was_covered_is_relocalised_within_ten_frames() {
    let folder = tempfile::tempdir().unwrap();
    let output = succeeds(folder.path(), &["run", DESK, "--fault", "black@1+1", "--out", "out"]);
    assert!(output.stdout.contains("lost 1 times, relocalised 1 times"), "{}", output.stdout);
    let report = report(&folder.path().join("out"));
    let lost = &report["loops_and_relocalisation"]["lost"][0];
    let frames = lost["frames"].as_u64().unwrap();
    assert!((30..=40).contains(&frames) && lost["relocalised"] == true, "{lost}");
    assert!(ate_rmse(&report) < 0.015, "{}", ate_rmse(&report));
}

#[test]
#[ignore = "long: see CONTRIBUTING.md"]
fn a_camera_lost_at_a_corner_does_not_confuse_the_next_corridor_with_the_last_one() {
    let folder = tempfile::tempdir().unwrap();
    let world = "synth:corridor_loop?frames=1330&width=320&height=240";
    succeeds(folder.path(), &["run", world, "--end", "275", "--out", "out", "-q"]);
    let report = report(&folder.path().join("out"));
    // A cover hides the corner; after it, doors and lamps look as before, 6 m and a right angle away.
    assert_eq!(
        report["loops_and_relocalisation"]["lost"][0]["from_ns"], 5_833_333_333_u64,
        "{}",
        report["loops_and_relocalisation"]["lost"]
    );
    assert!(ate_rmse(&report) < 0.1, "{}", ate_rmse(&report));
}

/// Once around a block of corridors and a little further, at ten frames per second.
const AROUND: &str = "synth:corridor_loop?people=0&frames=440&fps=10&width=320&height=240";

#[test]
fn a_path_that_returns_closes_its_loop() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["run", AROUND, "--method", "none", "--out", "out", "-q"]);
    let report = report(&folder.path().join("out"));
    let loops = report["loops_and_relocalisation"]["loops"].as_array().unwrap();
    assert!(loops.len() == 1 && loops[0]["merged_submaps"] == false, "{loops:?}");
    assert!(loops[0]["drift_m"].as_f64().unwrap() < 0.6, "{loops:?}");
    assert_eq!(report["frames"]["tracked"], 440);
    assert!(ate_rmse(&report) < 0.05, "{}", ate_rmse(&report));
}

#[test]
#[ignore = "long: see CONTRIBUTING.md"]
fn a_displaced_camera_starts_a_submap_that_is_merged_where_both_meet() {
    let folder = tempfile::tempdir().unwrap();
    // From the first corridor into the third; the path from there leads back to the first.
    let fault = ["--fault", "dropped@6+24"];
    succeeds(folder.path(), &[&["run", AROUND, "--method", "none", "--out", "out", "-q"], &fault[..]].concat());
    let report = report(&folder.path().join("out"));
    let loops = report["loops_and_relocalisation"]["loops"].as_array().unwrap();
    assert!(loops.len() == 1 && loops[0]["merged_submaps"] == true, "{loops:?}");
    assert_eq!(report["loops_and_relocalisation"]["frames_in_other_submaps"], 0);
    assert!(report["frames"]["tracked"].as_u64().unwrap() > 150);
    // Without merging, the error would be metres.
    assert!(ate_rmse(&report) < 0.15, "{}", ate_rmse(&report));
}

#[test]
fn a_saved_map_is_relocalised_in_and_stays_unchanged_or_is_extended() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["run", DESK, "--save-map", "desk.map", "--out", "a", "-q"]);
    let before = fs::read(folder.path().join("desk.map")).unwrap();
    // Noise is enough for a landmark to seem removed.
    let eager = "[dynamic.full]\nfree_space_margin_m = 0.001\nfree_space_margin_share = 0.0\n";
    fs::write(folder.path().join("eager.toml"), eager).unwrap();
    let again = ["run", DESK, "--load-map", "desk.map", "--reverse", "-q"];
    succeeds(folder.path(), &[&again[..], &["--localise", "--config", "eager.toml", "--out", "b"]].concat());
    let (mapped, localised) = (report(&folder.path().join("a")), report(&folder.path().join("b")));
    assert_eq!(localised["map"]["landmarks"], mapped["map"]["landmarks"], "none is forgotten");
    assert_eq!(localised["frames"]["tracked"], 90);
    let recognised = &localised["loops_and_relocalisation"]["loaded_map"]["recognised"];
    assert_eq!(recognised["after_frames"], 0, "{recognised}");
    assert_eq!(localised["map"]["keyframes"], 0, "no keyframe is of this run");
    let (mapped, localised) = (ate_rmse(&mapped), ate_rmse(&localised));
    assert!(localised < 1.2 * mapped.max(0.003), "{localised} m in the map, {mapped} m when it was made");
    assert_eq!(fs::read(folder.path().join("desk.map")).unwrap(), before);
    succeeds(folder.path(), &[&again[..], &["--save-map", "more.map", "--out", "c"]].concat());
    let keyframes =
        |name: &str| SavedMap::from_bytes(&fs::read(folder.path().join(name)).unwrap()).unwrap().map().keyframe_count();
    assert!(keyframes("more.map") >= keyframes("desk.map"));
    let frame = |name: &str| fs::read_to_string(folder.path().join(name).join("T_map_world.txt")).unwrap();
    assert!(frame("a").contains("up: camera"), "{}", frame("a"));
    assert_eq!([frame("b"), frame("c")], [frame("a"), frame("a")], "the map frame is kept over sessions");
    let elsewhere = "synth:walking_xyz?scene=rescue&people=0&frames=130&width=320&height=240";
    let lost = ["run", elsewhere, "--load-map", "desk.map", "--out", "d"];
    fails(
        folder.path(),
        &[&lost[..], &["--localise", "--end", "30"]].concat(),
        &["not recognised in any of 30 frames"],
    );
    fails(folder.path(), &[&lost[..], &["--end", "9"]].concat(), &["any of 9 frames", "a new map is begun only after"]);
    let printed = succeeds(folder.path(), &lost).stdout;
    assert!(printed.contains("desk.map was not recognised\n"), "{printed}");
}

#[test]
fn a_map_that_cannot_be_used_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["run", DESK, "--save-map", "desk.map", "--end", "20", "--out", "a", "-q"]);
    let bytes = fs::read(folder.path().join("desk.map")).unwrap();
    let refused = |content: &[u8], why: &str, more: &[&str]| {
        fs::write(folder.path().join("bad.map"), content).unwrap();
        fails(folder.path(), &[&["run", DESK, "--load-map", "bad.map", "-q"], more].concat(), &["bad.map", why]);
    };
    refused(b"%YAML:1.0", "this is no yfslam map", &[]);
    refused(&bytes[..bytes.len() / 2], "it was truncated", &[]);
    let mut altered = bytes.clone();
    *altered.last_mut().unwrap() ^= 4;
    refused(&altered, "it was altered", &[]);
    fs::write(folder.path().join("levels.toml"), "[features]\nlevels = 5\n").unwrap();
    refused(&bytes, "8 pyramid levels", &["--config", "levels.toml"]);
    fails(folder.path(), &["run", DESK, "--load-map", "none.map", "-q"], &["none.map cannot be read"]);
}

#[test]
fn mapping_on_its_own_thread_is_as_accurate() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["run", DESK, "--threaded", "--out", "out", "-q"]);
    let report = report(&folder.path().join("out"));
    assert_eq!(report["frames"]["tracked"], 90);
    assert!(ate_rmse(&report) < 0.015, "{}", ate_rmse(&report));
}

/// Environment variable with the file to write, for the process that is killed.
const VICTIM: &str = "YFSLAM_TEST_VICTIM";

/// Not a test of its own: the process that [`a_map_survives_a_hundred_killed_writers`] kills.
#[test]
fn victim() {
    let Some(path) = std::env::var_os(VICTIM) else { return };
    let path = Path::new(&path);
    let bytes = fs::read(path).unwrap();
    loop {
        write_atomically(path, |file| bytes.chunks(1 << 12).try_for_each(|part| file.write_all(part))).unwrap();
    }
}

#[test]
fn a_map_survives_a_hundred_killed_writers() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["run", DESK, "--save-map", "desk.map", "--end", "20", "--out", "a", "-q"]);
    let path = folder.path().join("desk.map");
    let bytes = fs::read(&path).unwrap();
    for round in 0..100u64 {
        let mut writer = Command::new(std::env::current_exe().unwrap());
        let writer = writer
            .args(["--exact", "recognition::victim"])
            .env(VICTIM, &path)
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        let mut writer = writer.spawn().unwrap();
        // From before the first write to about the tenth one, at a different moment each time.
        std::thread::sleep(Duration::from_micros(2_000 + 731 * (round * 17 % 100)));
        writer.kill().unwrap();
        writer.wait().unwrap();
        assert!(fs::read(&path).unwrap() == bytes && SavedMap::from_bytes(&bytes).is_ok(), "round {round}");
    }
    let unfinished = fs::read_dir(folder.path())
        .unwrap()
        .filter(|e| e.as_ref().unwrap().path().extension().is_some_and(|x| x == "tmp"));
    assert!(unfinished.count() > 10, "most writers were killed while they wrote");
}
