//! Runs the program, and writes small recordings for it from the synthetic world.

pub mod layouts;

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;
use tempfile::TempDir;
use yfslam_io::time::format_stamp;
use yfslam_io::write::{write_color_png, write_depth_png};
use yfslam_synth::World;

/// A small world without people: quick to render, easy to track.
pub const SMALL_WORLD: &str = "synth:walking_xyz?people=0&width=320&height=240&frames=12";

/// The output of the program.
#[derive(Debug)]
pub struct Output {
    pub success: bool,
    pub stdout: String,
    pub stderr: String,
}

/// Runs the program in `folder`.
pub fn yfslam(folder: &Path, args: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_yfslam")).args(args).current_dir(folder).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Output { success: output.status.success(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// Runs the program and expects success.
pub fn succeeds(folder: &Path, args: &[&str]) -> Output {
    let output = yfslam(folder, args);
    assert!(output.success, "{args:?} failed: {}", output.stderr);
    output
}

/// Runs the program and expects a failure whose message contains all of `words`.
pub fn fails(folder: &Path, args: &[&str], words: &[&str]) {
    let output = yfslam(folder, args);
    assert!(!output.success, "{args:?} succeeded: {}", output.stdout);
    for word in words {
        assert!(output.stderr.contains(word), "{args:?} does not contain '{word}': {}", output.stderr);
    }
}

/// Returns the `run.json` of an output folder.
pub fn report(out: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(out.join("run.json")).unwrap()).unwrap()
}

/// Returns the RMSE of the absolute trajectory error in a report, m.
pub fn ate_rmse(report: &Value) -> f64 {
    report["evaluation"]["ate"]["translation_m"]["rmse"].as_f64().unwrap()
}

/// Writes [`SMALL_WORLD`] to `folder` in TUM layout, with its camera and ground truth; files are named `rgb/0.png` and so on.
pub fn record(folder: &Path) {
    // Rendered once for all tests of a file.
    static RECORDING: OnceLock<TempDir> = OnceLock::new();
    copy(RECORDING.get_or_init(render).path(), folder);
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let (from, to) = (entry.as_ref().unwrap().path(), to.join(entry.unwrap().file_name()));
        if from.is_dir() {
            copy(&from, &to);
        } else {
            fs::copy(from, to).unwrap();
        }
    }
}

fn render() -> TempDir {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let world = World::new(&yfslam_synth::parse(SMALL_WORLD).unwrap()).unwrap();
    let (mut rgb, mut depth, mut truth) = (String::new(), String::new(), String::new());
    for index in 0..world.len() {
        let shot = world.frame(index);
        let stamp = format_stamp(shot.frame.timestamp_ns);
        write_color_png(&folder.join(format!("rgb/{index}.png")), &shot.frame.color).unwrap();
        write_depth_png(&folder.join(format!("depth/{index}.png")), &shot.frame.depth.as_ref().unwrap().raw).unwrap();
        writeln!(rgb, "{stamp} rgb/{index}.png").unwrap();
        writeln!(depth, "{stamp} depth/{index}.png").unwrap();
        let (t, q) = (shot.t_world_cam.translation, shot.t_world_cam.rotation);
        writeln!(truth, "{stamp} {} {} {} {} {} {} {}", t.x, t.y, t.z, q.i, q.j, q.k, q.w).unwrap();
    }
    let factor = world.config().depth_factor;
    // Scalar keys must stand before the tables of the camera.
    let camera = format!("depth_factor = {factor:?}\n{}", toml::to_string(&world.config().camera).unwrap());
    for (name, text) in [("rgb.txt", rgb), ("depth.txt", depth), ("groundtruth.txt", truth), ("camera.toml", camera)] {
        fs::write(folder.join(name), text).unwrap();
    }
    temporary
}

/// Changes a text file line by line; `None` drops a line.
pub fn edit_lines(path: &Path, edit: impl Fn(usize, &str) -> Option<String>) {
    let text = fs::read_to_string(path).unwrap();
    let lines = text.lines().enumerate().filter_map(|(i, line)| edit(i, line));
    fs::write(path, lines.map(|line| line + "\n").collect::<String>()).unwrap();
}

/// Returns a file or folder of the development data; prints a message and returns `None` if it is missing.
pub fn real_data(name: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let root = std::env::var_os("YFSLAM_DATA").map_or(beside, PathBuf::from);
    let path = root.join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {name} is not in the folder that YFSLAM_DATA names");
    None
}
