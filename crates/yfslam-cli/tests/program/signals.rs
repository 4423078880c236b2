//! SIGINT, SIGTERM and SIGKILL: what is computed is kept, and what is half-made goes away.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{report, succeeds};
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;
use yfslam::SavedMap;

/// Too long to end by itself during a test.
const LONG: &str = "walking_xyz?people=0&width=320&height=240&frames=5000";
/// Longer than anything here takes.
const PATIENCE: Duration = Duration::from_secs(60);

/// A program at work, which does not outlive the test.
pub(crate) struct Running(Child);

impl Running {
    /// Starts the program in `folder`, with its messages in the file `stderr`.
    pub(crate) fn start(folder: &Path, args: &[&str]) -> Self {
        let stderr = File::create(folder.join("stderr")).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_yfslam"));
        command.args(args).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr);
        Self(command.spawn().unwrap())
    }

    #[track_caller]
    pub(crate) fn wait_until(&mut self, what: &str, is_reached: impl Fn() -> bool) {
        let started = Instant::now();
        while !is_reached() {
            assert_eq!(self.0.try_wait().unwrap(), None, "the program ended before {what}");
            assert!(started.elapsed() < PATIENCE, "waited in vain for {what}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    pub(crate) fn send(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.0), signal).unwrap();
    }

    /// Returns the exit code; `None` if a signal ended the program without its doing.
    pub(crate) fn end(&mut self) -> Option<i32> {
        self.0.wait().unwrap().code()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub(crate) fn poses(file: &Path) -> usize {
    fs::read_to_string(file).unwrap().lines().filter(|line| !line.starts_with('#')).count()
}

fn assert_whole(map: &Path) {
    let saved = SavedMap::from_bytes(&fs::read(map).unwrap()).unwrap();
    assert!(saved.map().keyframes().count() > 0);
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Starts a run that has made a first checkpoint when this returns.
fn run(more: &[&str]) -> (TempDir, Running) {
    let folder = tempfile::tempdir().unwrap();
    let world = format!("synth:{LONG}");
    let args = ["run", &world, "--method", "none", "--out", "out", "--checkpoint", "0.05"];
    let mut running = Running::start(folder.path(), &[&args[..], more].concat());
    let first = folder.path().join("out/trajectory.txt");
    running.wait_until("the first checkpoint", || first.is_file());
    (folder, running)
}

#[test]
fn a_run_ends_in_order_after_sigint_and_sigterm() {
    for (signal, name, code) in [(Signal::INT, "SIGINT", 130), (Signal::TERM, "SIGTERM", 143)] {
        let (folder, mut running) = run(&["--save-map", "room.map", "--report"]);
        running.send(signal);
        assert_eq!(running.end(), Some(code));
        let out = folder.path().join("out");
        let report = report(&out);
        assert_eq!(report["interrupted"], true);
        let tracked = report["frames"]["tracked"].as_u64().unwrap();
        assert!((1..5000).contains(&tracked), "{tracked}");
        for file in ["trajectory.txt", "live.txt"] {
            assert_eq!(poses(&out.join(file)) as u64, tracked, "{file}");
        }
        let files = [
            "T_map_world.txt",
            "checkpoint.json",
            "checkpoint.map",
            "config.toml",
            "keyframes.txt",
            "live.txt",
            "map.ply",
            "report.html",
            "run.json",
            "trajectory.txt",
        ];
        assert_eq!(names(&out), files);
        assert!(fs::read_to_string(out.join("report.html")).unwrap().contains(&format!("interrupted by {name} after")));
        let stderr = fs::read_to_string(folder.path().join("stderr")).unwrap();
        assert!(stderr.contains(&format!("error: interrupted by {name}")), "{stderr}");
        assert_whole(&folder.path().join("room.map"));
    }
}

#[test]
fn a_killed_run_leaves_its_last_checkpoint_and_the_next_run_removes_incomplete_files() {
    let (folder, mut running) = run(&["--save-map", "maps/room.map"]);
    let (out, map) = (folder.path().join("out"), folder.path().join("maps/room.map"));
    running.wait_until("the map of a checkpoint", || map.is_file());
    running.send(Signal::KILL);
    assert_eq!(running.end(), None);
    assert!(poses(&out.join("trajectory.txt")) > 0 && poses(&out.join("live.txt")) > 0);
    assert_whole(&map);
    let incomplete = [out.join(".yfslam-1-0.tmp"), map.with_file_name(".yfslam-1-1.tmp")];
    incomplete.iter().for_each(|file| fs::write(file, "half").unwrap());
    let again = format!("synth:{}", LONG.replace("5000", "3"));
    let args = ["run", &again, "--method", "none", "--out", "out", "--save-map", "maps/room.map", "-q"];
    succeeds(folder.path(), &args);
    assert_eq!(report(&out)["interrupted"], false);
    let left = [names(&out), names(&folder.path().join("maps"))].concat();
    assert!(!left.iter().any(|name| name.ends_with(".tmp")), "{left:?}");
}

#[test]
fn a_second_signal_ends_the_program_at_once() {
    // A frame takes long, so that the run cannot end in order between the two signals.
    let folder = tempfile::tempdir().unwrap();
    let slow = "synth:walking_xyz?people=0&frames=2&width=4096&height=4096";
    let mut running = Running::start(folder.path(), &["run", slow, "--method", "none", "--out", "out"]);
    running.wait_until("the beginning of the run", || folder.path().join("out/config.toml").is_file());
    // Two different ones: the same signal twice may arrive once.
    running.send(Signal::INT);
    running.send(Signal::TERM);
    assert!(matches!(running.end(), Some(130 | 143)));
    let stderr = fs::read_to_string(folder.path().join("stderr")).unwrap();
    assert!(!stderr.contains("interrupted"), "the program ended in order: {stderr}");
}

#[test]
fn a_recording_that_is_interrupted_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut running = Running::start(folder.path(), &["synth", LONG, "--out", "rec"]);
    let has_images = || {
        let temporary = names(folder.path()).into_iter().find(|name| name.ends_with(".tmp"));
        temporary.is_some_and(|name| fs::read_dir(folder.path().join(name).join("rgb")).is_ok_and(|d| d.count() > 0))
    };
    running.wait_until("the first image", has_images);
    running.send(Signal::TERM);
    assert_eq!(running.end(), Some(143));
    assert_eq!(names(folder.path()), ["stderr"]);
}

#[test]
fn an_interrupted_bench_ends_its_processes_and_keeps_finished_cells() {
    let folder = tempfile::tempdir().unwrap();
    let short = LONG.replace("5000", "8");
    let args = ["bench", &short, LONG, "--methods", "none", "--seeds", "1", "--out", "b"];
    let mut running = Running::start(folder.path(), &args);
    let runs = folder.path().join("b/runs");
    running.wait_until("the second run", || {
        let folders = fs::read_dir(&runs).into_iter().flatten().flatten();
        folders.filter(|folder| folder.path().join("none/config.toml").is_file()).count() == 2
    });
    running.send(Signal::INT);
    assert_eq!(running.end(), Some(130));
    assert_eq!(names(&runs), ["walking_xyz_people_0_width_320_height_240_frames_8-1"]);
    assert_eq!(names(&folder.path().join("b/cells")).len(), 1);
}

#[test]
fn checkpoints_do_not_change_the_results() {
    let folder = tempfile::tempdir().unwrap();
    let world = "synth:walking_xyz?people=1&width=320&height=240&frames=20";
    let args = |out: &'static str, map: &'static str| {
        ["run", world, "--dense", "--seed", "1", "-q", "--out", out, "--save-map", map]
    };
    succeeds(folder.path(), &args("a", "a.map"));
    succeeds(folder.path(), &[&args("b", "b.map")[..], &["--checkpoint", "0.001"]].concat());
    let read = |name: String| fs::read(folder.path().join(name)).unwrap();
    for name in ["trajectory.txt", "live.txt", "keyframes.txt", "map.ply", "dense.map", "config.toml"] {
        assert!(read(format!("a/{name}")) == read(format!("b/{name}")), "{name} differs");
    }
    assert!(read("a.map".into()) == read("b.map".into()), "the maps differ");
    assert!(report(&folder.path().join("b"))["times"]["checkpoint"]["count"].as_u64() > Some(10));
}
