//! Outputs that cannot be written, and standard streams that are not read: everything else is written all the same.

use std::fs::{self, File, OpenOptions};
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::{fails, record, report, succeeds, yfslam};
use tempfile::TempDir;

const RUN: [&str; 6] = ["run", "seq", "--method", "none", "--out", "out"];
/// Nothing is tracked in black images.
const BLACK: [&str; 2] = ["--fault", "black@0+9"];

fn run(more: &'static [&'static str]) -> Vec<&'static str> {
    [&RUN[..], more].concat()
}

/// A folder with the sequence `seq`.
fn recording() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("seq"));
    folder
}

/// The same with an earlier run in it.
fn folder_with_results() -> TempDir {
    let folder = recording();
    succeeds(folder.path(), &run(&["--dense", "--report", "--overlay", "-q"]));
    folder
}

fn program(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_yfslam"));
    command.args(args).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

#[track_caller]
fn assert_whole(out: &Path) {
    assert_eq!(report(out)["frames"]["tracked"], 12);
    for name in ["trajectory.txt", "keyframes.txt", "live.txt", "map.ply", "config.toml"] {
        assert!(fs::metadata(out.join(name)).is_ok_and(|file| file.len() > 0), "{name}");
    }
}

#[test]
fn a_map_that_cannot_be_saved_is_an_error_and_everything_else_is_written() {
    let folder = recording();
    fails(folder.path(), &run(&["--save-map", "/dev/full", "--report"]), &["/dev/full", "free some space", "1 output"]);
    let out = folder.path().join("out");
    assert_whole(&out);
    assert!(out.join("report.html").is_file());
}

#[test]
fn images_that_can_no_longer_be_written_do_not_end_the_run() {
    let folder = recording();
    let overlay = folder.path().join("out/overlay");
    fs::create_dir_all(&overlay).unwrap();
    // The fourth image has the name of a folder.
    fs::create_dir(overlay.join("000003.jpg")).unwrap();
    // An earlier image that cannot be removed is found before the run.
    fails(folder.path(), &run(&["--overlay"]), &["cannot remove the old", "000003.jpg", "choose another folder"]);
    fs::remove_dir(overlay.join("000003.jpg")).unwrap();
    let mut child = program(folder.path(), &run(&["--overlay"])).spawn().unwrap();
    while !folder.path().join("out/config.toml").is_file() {
        std::thread::sleep(Duration::from_millis(1));
    }
    fs::create_dir_all(overlay.join("000011.jpg")).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1));
    assert_whole(&folder.path().join("out"));
    assert!(overlay.join("000010.jpg").is_file());
}

#[test]
fn what_is_known_before_a_run_is_refused_before_it() {
    let folder = recording();
    let root = folder.path();
    fs::create_dir(root.join("folder")).unwrap();
    fs::write(root.join("file"), "").unwrap();
    let refused = |more: &'static [&'static str], words: &[&str]| {
        fails(root, &run(more), words);
        assert!(!root.join("out/config.toml").exists(), "{more:?}: the run began");
    };
    refused(&["--save-map", "folder"], &["folder", "because it is a folder; name a file"]);
    refused(&["--save-map", "file/lab.map"], &["file/lab.map cannot be written", "a part of this path is a file"]);
    refused(&["--save-map", "/proc/none/lab.map"], &["/proc/none/lab.map cannot be written"]);
    refused(&["--save-map", "out/dense.map"], &["out/dense.map", "another file of this run", "lab.map"]);
    refused(&["--checkpoint", "0"], &["--checkpoint", "positive number of seconds"]);
    fails(root, &["run", "seq", "--out", "file"], &["the output folder file cannot be used", "choose another"]);
    fails(root, &["run", "seq", "--out", "/proc/out"], &["the output folder /proc/out cannot be used"]);
    fs::create_dir_all(root.join("out")).unwrap();
    fs::write(root.join("out/overlay"), "").unwrap();
    refused(&["--overlay"], &["out/overlay cannot be used", "a part of this path is a file"]);
    // An earlier map stays, and no probe.
    fs::write(root.join("old.map"), "an earlier map").unwrap();
    fails(root, &[&run(&["--save-map", "old.map"])[..], &BLACK].concat(), &["no trajectory"]);
    assert_eq!(fs::read_to_string(root.join("old.map")).unwrap(), "an earlier map");
}

#[test]
fn a_run_in_the_folder_of_an_earlier_one_leaves_none_of_its_results() {
    let folder = folder_with_results();
    let out = folder.path().join("out");
    for name in ["trajectory.txt", "dense.map", "report.html", "overlay/000000.jpg"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    fs::write(out.join("notes.txt"), "mine").unwrap();
    // A run that is refused leaves everything.
    fails(folder.path(), &run(&["--camera", "tum9"]), &["tum9"]);
    assert!(out.join("trajectory.txt").is_file());
    // Nothing is tracked.
    fails(folder.path(), &[&RUN[..], &BLACK].concat(), &["no trajectory"]);
    let names = || {
        let mut names: Vec<_> = fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    };
    assert_eq!(names(), ["config.toml", "notes.txt"]);
    fails(folder.path(), &["map", "out"], &["dense.map"]);
    // The configuration of an earlier run is an input, also in its own folder.
    succeeds(folder.path(), &["run", "seq", "--config", "out/config.toml", "--out", "out", "-q"]);
    assert_whole(&out);
}

#[test]
fn a_full_or_closed_standard_error_does_not_end_a_run() {
    let folder = recording();
    let full = || OpenOptions::new().write(true).open("/dev/full").unwrap();
    let args = run(&["-vv"]);
    assert!(program(folder.path(), &args).stderr(full()).status().unwrap().success());
    assert_whole(&folder.path().join("out"));
    // Its reader goes away after the first bytes.
    let mut child =
        program(folder.path(), &[&args[..5], &["b", "-vv"]].concat()).stderr(Stdio::piped()).spawn().unwrap();
    child.stderr.take().unwrap().read_exact(&mut [0; 10]).unwrap();
    assert!(child.wait().unwrap().success());
    assert_whole(&folder.path().join("b"));
}

#[test]
fn a_standard_error_that_is_not_read_does_not_hold_up_a_run() {
    let folder = recording();
    let (_reader, writer) = std::io::pipe().unwrap();
    // More than a pipe holds is in it already.
    fill(&writer);
    assert!(program(folder.path(), &run(&["-vv"])).stderr(writer).status().unwrap().success());
    assert_whole(&folder.path().join("out"));
}

/// Fills a pipe, from a thread that stays blocked by it.
fn fill(pipe: &std::io::PipeWriter) {
    let mut pipe = pipe.try_clone().unwrap();
    let (sender, written) = std::sync::mpsc::channel();
    std::thread::spawn(
        move || {
            while std::io::Write::write_all(&mut pipe, &[b'x'; 512]).is_ok() && sender.send(()).is_ok() {}
        },
    );
    while written.recv_timeout(Duration::from_millis(200)).is_ok() {}
}

#[test]
fn a_closed_or_full_standard_output_loses_no_file() {
    let folder = recording();
    let (reader, closed) = std::io::pipe().unwrap();
    drop(reader);
    let args = run(&["--report"]);
    assert!(program(folder.path(), &args).stdout(closed).status().unwrap().success());
    assert_whole(&folder.path().join("out"));
    assert!(folder.path().join("out/report.html").is_file());
    let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
    let status = program(folder.path(), &[&args[..5], &["b", "--report"]].concat()).stdout(full).status().unwrap();
    assert_eq!(status.code(), Some(1));
    assert_whole(&folder.path().join("b"));
    assert!(folder.path().join("b/report.html").is_file());
    // The same for detections.
    let (reader, closed) = std::io::pipe().unwrap();
    drop(reader);
    let args = ["detect", "seq/rgb", "--out", "d"];
    assert!(program(folder.path(), &args).stdout(closed).status().unwrap().success());
    let list: serde_json::Value =
        serde_json::from_reader(File::open(folder.path().join("d/boxes.json")).unwrap()).unwrap();
    assert_eq!(list["images"].as_array().unwrap().len(), 12);
}

#[test]
fn a_device_or_a_pipe_in_place_of_a_file_is_refused_at_once() {
    let folder = recording();
    let made = Command::new("mkfifo").arg(folder.path().join("fifo")).status().unwrap();
    assert!(made.success());
    for special in ["/dev/zero", "fifo"] {
        let refused = |args: &[&str]| fails(folder.path(), args, &[special, "not a regular file"]);
        refused(&["map", special]);
        refused(&["run", "seq", "--load-map", special]);
    }
    let output = yfslam(folder.path(), &["detect", "/dev/zero", "fifo"]);
    assert!(!output.success && output.stderr.matches("not a regular file").count() == 2, "{}", output.stderr);
}
