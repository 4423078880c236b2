//! Videos: the same frames as a folder give the same trajectory, and no process of `ffmpeg` is left behind.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{fails, report, succeeds};
use yfslam_io::{Sequence, SequenceOptions};

const DESK: &str = "sitting_xyz?people=0&width=320&height=240&frames=60";

/// Frames per second; multiples of their period are whole milliseconds, the unit of time in MKV.
const FPS: &str = "25";

/// Returns whether `ffmpeg` and `ffprobe` can be used; says so when not.
fn has_ffmpeg() -> bool {
    let found = ["ffmpeg", "ffprobe"].map(|name| {
        let status = Command::new(name).arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success())
    });
    if found != [true, true] {
        println!("skipped: ffmpeg and ffprobe are not installed");
    }
    found == [true, true]
}

/// Renders a desk into `desk`, with time stamps of [`FPS`], and writes the colour images as videos, lossless and with reordered frames.
fn record(folder: &Path) {
    succeeds(folder, &["synth", DESK, "--out", "desk"]);
    let list = fs::read_to_string(folder.join("desk/rgb.txt")).unwrap();
    let files: Vec<&str> =
        list.lines().filter(|line| !line.starts_with('#')).map(|l| l.split_once(' ').unwrap().1).collect();
    let stamped = files.iter().enumerate().map(|(index, file)| format!("{:.3} {file}\n", index as f64 * 0.04));
    fs::write(folder.join("desk/rgb.txt"), stamped.collect::<String>()).unwrap();
    let images: Vec<Vec<u8>> = files.iter().map(|file| fs::read(folder.join("desk").join(file)).unwrap()).collect();
    encode(folder, &images, &["-c:v", "ffv1", "-pix_fmt", "bgr0", "desk.mkv"]);
    encode(folder, &images, &["-c:v", "mpeg4", "-bf", "2", "-q:v", "2", "desk.mp4"]);
}

fn encode(folder: &Path, images: &[Vec<u8>], options: &[&str]) {
    let mut command = Command::new("ffmpeg");
    command.args(["-loglevel", "error", "-f", "image2pipe", "-framerate", FPS, "-c:v", "png", "-i", "-"]).args(options);
    let mut child = command.current_dir(folder).stdin(Stdio::piped()).spawn().unwrap();
    let mut pipe = child.stdin.take().unwrap();
    images.iter().for_each(|image| pipe.write_all(image).unwrap());
    drop(pipe);
    assert!(child.wait().unwrap().success());
}

fn run(folder: &Path, sequence: &str, more: &[&str]) -> Vec<u8> {
    let args =
        ["run", sequence, "--sensor", "mono", "--method", "none", "--camera", "desk/camera.toml", "--out", "out"];
    succeeds(folder, &[&args[..], more].concat());
    let trajectory = fs::read(folder.join("out/trajectory.txt")).unwrap();
    assert!(trajectory.len() > 1000, "too little was tracked to compare");
    trajectory
}

#[test]
fn a_video_gives_the_trajectory_of_the_same_images_to_the_byte() {
    if !has_ffmpeg() {
        return;
    }
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    record(folder);
    let part = ["--start", "10", "--end", "50"];
    let (expected, of_part) = (run(folder, "desk", &[]), run(folder, "desk", &part));
    assert!(run(folder, "desk.mkv", &[]) == expected);
    assert_eq!(report(&folder.join("out"))["frames"]["skipped"], 0);
    assert!(run(folder, "desk.mkv", &["--fps", FPS]) == expected);
    assert!(run(folder, "desk.mkv", &part) == of_part);
    assert!(run(folder, "desk.mkv", &["--fps", "50"]) != expected, "the rate changes the time stamps");
    // A name that looks like an option or a protocol.
    fs::copy(folder.join("desk.mkv"), folder.join("pipe:-1.mkv")).unwrap();
    assert!(run(folder, "pipe:-1.mkv", &[]) == expected);
    let text = succeeds(folder, &["info", "desk.mkv", "--camera", "desk/camera.toml"]).stdout;
    for words in ["video", "60 images, 60 usable", "the time stamps are those in the video"] {
        assert!(text.contains(words), "'{words}' is missing: {text}");
    }
}

#[test]
fn frames_that_are_stored_in_another_order_are_played_in_the_order_of_time() {
    if !has_ffmpeg() {
        return;
    }
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    record(folder);
    let sequence = Sequence::open(&folder.join("desk.mp4"), &SequenceOptions::default()).unwrap();
    let stamps: Vec<i64> =
        sequence.entries.iter().map(|entry| entry.timestamp_ns - sequence.entries[0].timestamp_ns).collect();
    assert_eq!(stamps, (0..60).map(|index| index * 40_000_000).collect::<Vec<_>>());
    let mut apart = Vec::new();
    for (index, entry) in sequence.entries.iter().enumerate().step_by(7) {
        let (mut pixels, mut expected, mut bytes) = (Vec::new(), yfslam::RgbImage::default(), Vec::new());
        entry.color.read(&mut pixels).unwrap();
        let list = fs::read_to_string(folder.join("desk/rgb.txt")).unwrap();
        let file = list.lines().nth(index).unwrap().split_once(' ').unwrap().1;
        bytes.extend(fs::read(folder.join("desk").join(file)).unwrap());
        yfslam_io::decode::decode_color(&bytes, None, &mut expected).unwrap();
        let expected = expected.data().as_flattened();
        assert_eq!(pixels.len(), expected.len());
        let sum: u64 = pixels.iter().zip(expected).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        apart.push(sum as f64 / pixels.len() as f64);
    }
    // The codec loses a little; another frame than the right one would differ by more.
    assert!(apart.iter().all(|apart| *apart < 4.0), "{apart:?}");
    // An earlier frame is read again.
    let mut pixels = Vec::new();
    sequence.entries[3].color.read(&mut pixels).unwrap();
    sequence.entries[59].color.read(&mut pixels).unwrap();
    sequence.entries[0].color.read(&mut pixels).unwrap();
    assert_eq!(pixels.len(), 320 * 240 * 3);
}

#[test]
fn what_cannot_be_played_is_refused_with_the_cure() {
    if !has_ffmpeg() {
        return;
    }
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    record(folder);
    let camera = ["--camera", "desk/camera.toml"];
    let refused = |args: &[&str], words: &[&str]| fails(folder, &[&["run"], args, &camera[..]].concat(), words);
    refused(&["desk.mkv", "--sensor", "rgbd"], &["desk.mkv", "no depth images", "mono"]);
    refused(&["desk.mkv", "--reverse"], &["desk.mkv", "reverse", "extract the frames"]);
    refused(&["desk.mkv", "--color-topic", "/x"], &["no bag"]);
    fails(folder, &["run", "desk.mkv"], &["desk.mkv", "--camera"]);
    fails(folder, &["run", "desk.mkv", "--camera", "bonn"], &["desk.mkv", "320×240", "640×480"]);
    fs::write(folder.join("text.mp4"), "this is no video").unwrap();
    refused(&["text.mp4"], &["text.mp4", "ffprobe cannot read it", "check that a player shows it"]);
    // What is left of a video whose end is missing is played.
    let bytes = fs::read(folder.join("desk.mkv")).unwrap();
    fs::write(folder.join("half.mkv"), &bytes[..bytes.len() / 2]).unwrap();
    let half = Sequence::open(&folder.join("half.mkv"), &SequenceOptions::default()).unwrap().entries;
    assert!((20..50).contains(&half.len()), "{}", half.len());
    let mut pixels = Vec::new();
    half.iter().take(half.len() - 1).for_each(|entry| entry.color.read(&mut pixels).unwrap());
    // Without times, the rate must be given.
    let args = ["-loglevel", "error", "-i", "desk.mkv", "-f", "rawvideo", "-c:v", "mpeg2video", "bare.mpg"];
    assert!(Command::new("ffmpeg").args(args).current_dir(folder).status().unwrap().success());
    refused(&["bare.mpg"], &["bare.mpg", "without time stamps", "--fps"]);
    let text = succeeds(folder, &["info", "bare.mpg", "--fps", "25", "--camera", "desk/camera.toml"]).stdout;
    assert!(text.contains("60 images, 60 usable"), "{text}");
}

#[test]
#[cfg(unix)]
fn without_ffmpeg_the_error_says_how_to_install_it() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::write(folder.join("a.mp4"), "anything").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_yfslam"));
    command.args(["run", "a.mp4", "--sensor", "mono", "--camera", "bonn"]).env("PATH", folder).current_dir(folder);
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success());
    for words in ["a.mp4", "ffmpeg was not found", "apt install ffmpeg", "--color FOLDER --sensor mono"] {
        assert!(text.contains(words), "'{words}' is missing: {text}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn an_interrupted_or_killed_run_leaves_no_decoder() {
    use crate::signals::Running;
    use rustix::process::Signal;
    use std::time::{Duration, Instant};
    if !has_ffmpeg() {
        return;
    }
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    // Long, so that the decoder is still at work.
    let source = "testsrc=size=640x480:rate=30:duration=60";
    let args = ["-loglevel", "error", "-f", "lavfi", "-i", source, "-c:v", "mpeg4", "-q:v", "9", "long.mkv"];
    assert!(Command::new("ffmpeg").args(args).current_dir(folder).status().unwrap().success());
    let video = folder.join("long.mkv").canonicalize().unwrap();
    let video = video.to_str().unwrap();
    let decoders = || {
        let all = fs::read_dir("/proc").unwrap().filter_map(|entry| fs::read(entry.ok()?.path().join("cmdline")).ok());
        let is_decoder = |line: &Vec<u8>| {
            let line = String::from_utf8_lossy(line).into_owned();
            line.starts_with("ffmpeg") && line.contains(video)
        };
        all.filter(is_decoder).count()
    };
    for (signal, code) in [(Signal::INT, Some(130)), (Signal::KILL, None)] {
        let args = ["run", video, "--camera", "bonn", "--sensor", "mono", "--method", "none", "--out", "out"];
        let mut running = Running::start(folder, &args);
        running.wait_until("decoding", || decoders() > 0 && folder.join("out").is_dir());
        running.send(signal);
        assert_eq!(running.end(), code);
        let started = Instant::now();
        while decoders() > 0 {
            assert!(started.elapsed() < Duration::from_secs(20), "a decoder outlives the run after {signal:?}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}
