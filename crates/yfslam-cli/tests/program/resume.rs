//! `--resume`: a run that was interrupted or killed goes on from its last checkpoint, and only the same run does.

use std::fs;
use std::path::Path;

use crate::common::{ate_rmse, fails, report, succeeds};
use crate::signals::{Running, poses};
use rustix::process::Signal;

const FRAMES: u64 = 90;
const WORLD: &str = "synth:walking_xyz?people=1&width=320&height=240&frames=90";

fn args(out: &str) -> Vec<&str> {
    vec!["run", WORLD, "--method", "yf", "--out", out, "--checkpoint", "0.05"]
}

/// Starts a run and ends it by a signal once it has a checkpoint and, if it can, some frames more. Returns the exit code.
fn ended_by(signal: Signal, folder: &Path) -> Option<i32> {
    let mut running = Running::start(folder, &args("out"));
    let state = folder.join("out/checkpoint.json");
    running.wait_until("a checkpoint", || {
        let text = fs::read_to_string(&state).unwrap_or_default();
        let state: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
        state["tally"]["tracked"].as_u64() >= Some(20)
    });
    running.send(signal);
    running.end()
}

#[test]
fn a_run_that_was_killed_or_interrupted_goes_on_and_ends_close_to_one_that_was_not() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    succeeds(root, &[&args("whole")[..], &["-q"]].concat());
    assert!(!root.join("whole/checkpoint.json").exists(), "a run that has ended has no checkpoint");
    let whole = report(&root.join("whole"));
    for (signal, code) in [(Signal::KILL, None), (Signal::INT, Some(130))] {
        assert_eq!(ended_by(signal, root), code);
        succeeds(root, &[&args("out")[..], &["--resume", "-q"]].concat());
        let report = report(&root.join("out"));
        let after = report["resumed"]["after_frames"].as_u64().unwrap();
        assert!((20..FRAMES).contains(&after), "{after}");
        assert_eq!(report["interrupted"], false);
        assert_eq!(report["frames"]["read"], FRAMES, "{}", report["frames"]);
        let tracked = report["frames"]["tracked"].as_u64().unwrap();
        assert!(tracked >= FRAMES - 3, "{}", report["frames"]);
        for file in ["trajectory.txt", "live.txt"] {
            assert_eq!(poses(&root.join("out").join(file)) as u64, tracked, "{file}");
        }
        let (resumed, uninterrupted) = (ate_rmse(&report), ate_rmse(&whole));
        assert!(resumed < uninterrupted + 0.01, "{resumed} instead of {uninterrupted} m");
        assert!(!root.join("out/checkpoint.json").exists() && !root.join("out/checkpoint.map").exists());
        println!("after {after} frames: ATE {resumed:.4} m, uninterrupted {uninterrupted:.4} m, {tracked} tracked");
    }
}

#[test]
fn another_run_does_not_go_on_from_a_checkpoint_and_the_error_says_what_differs() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    fails(root, &[&args("out")[..], &["--resume"]].concat(), &["out has no checkpoint", "leave out --resume"]);
    assert_eq!(ended_by(Signal::KILL, root), None);
    let other = WORLD.replace("frames=90", "frames=80");
    let with = |more: &[&'static str]| [&args("out")[..], more, &["--resume"]].concat();
    fs::write(root.join("other.toml"), "features.count = 999\n").unwrap();
    fs::write(
        root.join("other-camera.toml"),
        "width = 320\nheight = 240\nfx = 250.0\nfy = 250.0\ncx = 160.0\ncy = 120.0\n",
    )
    .unwrap();
    for (arguments, words) in [
        (with(&["--config", "other.toml"]), "the configuration (features.count)"),
        (with(&["--fault", "black@1+1"]), "the faults"),
        (with(&["--dense"]), "--dense"),
        (with(&["--load-map", "x.map"]), "cannot be used with"),
        (
            vec!["run", &other, "--method", "yf", "--out", "out", "--resume"],
            "walking_xyz of 80 frames instead of walking_xyz of 90",
        ),
        (vec!["run", WORLD, "--method", "none", "--out", "out", "--resume"], "the method (none instead of yf)"),
        (vec!["run", WORLD, "--method", "none,yf", "--out", "out", "--resume"], "several methods"),
        (vec!["live", WORLD, "--method", "yf", "--out", "out", "--resume"], "--resume is for recordings"),
    ] {
        fails(root, &arguments, &[words]);
    }
    // All of them were refused before anything was removed.
    let state = fs::read_to_string(root.join("out/checkpoint.json")).unwrap();
    fs::write(root.join("out/checkpoint.json"), &state[..state.len() / 2]).unwrap();
    fails(root, &with(&[]), &["checkpoint.json is not a checkpoint"]);
    fs::write(root.join("out/checkpoint.json"), state).unwrap();
    let map = fs::read(root.join("out/checkpoint.map")).unwrap();
    fs::write(root.join("out/checkpoint.map"), &map[..map.len() / 2]).unwrap();
    fails(root, &with(&[]), &["checkpoint.map"]);
    fs::write(root.join("out/checkpoint.map"), map).unwrap();
    succeeds(root, &with(&["-q"]));
}
