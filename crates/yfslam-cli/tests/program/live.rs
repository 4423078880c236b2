//! `yfslam live`: a recording at real time, every frame with --lockstep, and frames on standard input.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{fails, record, report, succeeds};

/// The files that a run and a live run of the same frames have in common to the last byte.
const FILES: [&str; 4] = ["trajectory.txt", "live.txt", "keyframes.txt", "map.ply"];

fn assert_same(a: &Path, b: &Path) {
    for file in FILES {
        assert_eq!(fs::read(a.join(file)).unwrap(), fs::read(b.join(file)).unwrap(), "{file}");
    }
}

#[test]
fn lockstep_gives_the_bytes_of_run() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("room"));
    succeeds(folder.path(), &["run", "room", "--out", "a", "--save-map", "a.map"]);
    succeeds(folder.path(), &["live", "room", "--lockstep", "--out", "b", "--save-map", "b.map"]);
    assert_same(&folder.path().join("a"), &folder.path().join("b"));
    let map = |name| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(map("a.map"), map("b.map"));
}

#[test]
fn a_recording_is_played_at_real_time_and_every_frame_is_accounted_for() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("room"));
    // Ten times slower than real time, so that each frame is tracked also on a busy machine: 12 frames at 30 Hz take 3.7 s.
    let started = std::time::Instant::now();
    succeeds(folder.path(), &["live", "room", "--rate", "0.1", "--out", "slow", "--method", "none"]);
    assert!(started.elapsed().as_secs_f64() > 3.6, "{:?}", started.elapsed());
    let slow = report(&folder.path().join("slow"));
    assert_eq!(slow["frames"]["tracked"], 12, "{slow}");
    // Far too fast: most frames are dropped, and counted.
    succeeds(folder.path(), &["live", "room", "--rate", "1000", "--out", "fast", "--method", "none"]);
    let frames = &report(&folder.path().join("fast"))["frames"];
    let count = |key: &str| frames[key].as_u64().unwrap();
    assert!(count("skipped") > 0, "{frames}");
    assert_eq!(count("read") + count("skipped"), 12, "{frames}");
}

/// The frames of a recording of [`record`] in the format of the pipe.
fn piped(room: &Path) -> Vec<u8> {
    let camera = fs::read(room.join("camera.toml")).unwrap();
    let mut bytes =
        [b"YFSFRAME".as_slice(), &1_u32.to_le_bytes(), &(camera.len() as u32).to_le_bytes(), &camera].concat();
    let list = fs::read_to_string(room.join("rgb.txt")).unwrap();
    for (index, line) in list.lines().enumerate() {
        let (seconds, nanoseconds) = line.split_whitespace().next().unwrap().split_once('.').unwrap();
        let stamp_ns: i64 = format!("{seconds}{nanoseconds:0<9}").parse().unwrap();
        let mut frame = stamp_ns.to_le_bytes().to_vec();
        for (role, name) in [(1, "rgb"), (2, "depth")] {
            let file = fs::read(room.join(format!("{name}/{index}.png"))).unwrap();
            frame.extend([role, 5, 0, 0]);
            frame.extend((file.len() as u32).to_le_bytes());
            frame.extend(file);
        }
        bytes.extend((frame.len() as u32).to_le_bytes());
        bytes.extend(frame);
    }
    bytes
}

fn send(folder: &Path, args: &[&str], bytes: &[u8]) -> (bool, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_yfslam"));
    command.args(args).current_dir(folder).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    // A program that refuses the stream closes it.
    let _ = input.write_all(bytes);
    drop(input);
    let output = child.wait_with_output().unwrap();
    (output.status.success(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn frames_on_standard_input_give_the_bytes_of_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let room = folder.path().join("room");
    record(&room);
    succeeds(folder.path(), &["run", "room", "--out", "a"]);
    let (success, stderr) = send(folder.path(), &["live", "-", "--lockstep", "--out", "b"], &piped(&room));
    assert!(success, "{stderr}");
    assert_same(&folder.path().join("a"), &folder.path().join("b"));
}

#[test]
fn a_pipe_that_breaks_keeps_what_was_tracked_and_another_format_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let room = folder.path().join("room");
    record(&room);
    let bytes = piped(&room);
    let (success, stderr) = send(folder.path(), &["live", "-", "--lockstep", "--out", "b"], &bytes[..bytes.len() / 2]);
    assert!(success, "{stderr}");
    let frames = &report(&folder.path().join("b"))["frames"];
    assert!(frames["tracked"].as_u64().unwrap() > 3 && frames["skipped"] == 1, "{frames}");
    let (success, stderr) = send(folder.path(), &["live", "-", "--out", "c"], b"\x89PNG is something else");
    assert!(!success && stderr.contains("YFSFRAME"), "{stderr}");
}

#[test]
fn options_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("room"));
    fails(folder.path(), &["live", "room", "--rate", "0"], &["--rate", "above 0"]);
    fails(folder.path(), &["live", "room", "--rate", "2", "--lockstep"], &["--lockstep"]);
    fails(folder.path(), &["live", "room", "--method", "none,boxes"], &["--threaded"]);
    fails(folder.path(), &["live", "-", "--start", "3"], &["--start"]);
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_live_run_that_waits_and_what_was_tracked_is_saved() {
    use rustix::process::{Pid, Signal, kill_process};

    let folder = tempfile::tempdir().unwrap();
    let room = folder.path().join("room");
    record(&room);
    let mut command = Command::new(env!("CARGO_BIN_EXE_yfslam"));
    command.args(["live", "-", "--method", "none", "--out", "out", "--save-map", "room.map", "--checkpoint", "0.01"]);
    command.current_dir(folder.path()).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    // The sender stays, and sends no more: the program waits for the next frame.
    let mut input = child.stdin.take().unwrap();
    input.write_all(&piped(&room)).unwrap();
    input.flush().unwrap();
    let started = std::time::Instant::now();
    while !folder.path().join("room.map").is_file() {
        assert!(started.elapsed().as_secs() < 60, "nothing was tracked");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    drop(input);
    let report = report(&folder.path().join("out"));
    assert_eq!(report["interrupted"], true);
    assert!(report["frames"]["tracked"].as_u64().unwrap() > 0, "{report}");
}
