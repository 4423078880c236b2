//! Folders of recordings: their lists, camera files and ground truth.

use std::fs;
use std::path::Path;

use yfslam_io::sequence::Layout;
use yfslam_io::trajectory::read_times;
use yfslam_io::{Sequence, SequenceOptions, TrajectoryFile, complete_camera, detect_camera};

use crate::scratch::{with_file, with_folder};

/// The files that a folder of a recording may have, by the number that stands before their content.
const FILES: [&str; 20] = [
    "rgb.txt",
    "depth.txt",
    "right.txt",
    "associations.txt",
    "groundtruth.txt",
    "camera.yaml",
    "mav0/cam0/data.csv",
    "mav0/cam0/sensor.yaml",
    "mav0/cam1/data.csv",
    "mav0/cam1/sensor.yaml",
    "mav0/state_groundtruth_estimate0/data.csv",
    "times.txt",
    "calib.txt",
    "calibration.txt",
    "color.txt",
    "aligned_depth.txt",
    "rgb.csv",
    "calibration.yaml",
    "traj.txt",
    "pose/0.txt",
];

/// Images that lists may name.
const IMAGES: [&str; 12] = [
    "rgb/0.png",
    "rgb/1.png",
    "depth/0.png",
    "depth/1.png",
    "right/0.png",
    "mav0/cam0/data/0.png",
    "mav0/cam1/data/0.png",
    "image_2/000000.png",
    "color/0.png",
    "aligned_depth/0.png",
    "results/frame000000.png",
    "results/depth000000.png",
];

/// A recording: lines of `@` and a number of [`FILES`], each followed by the content of that file.
pub fn sequence(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    with_folder(|folder| {
        let folder = folder.join("sequence");
        for name in IMAGES {
            write_once(&folder.join(name))?;
        }
        let mut written = Vec::new();
        for part in text.split('@') {
            let (number, content) = part.split_once('\n').unwrap_or_default();
            let Some(name) = number.trim().parse().ok().and_then(|number: usize| FILES.get(number)) else { continue };
            let path = folder.join(name);
            fs::create_dir_all(path.parent()?).ok()?;
            fs::write(&path, content).ok()?;
            written.push(path);
        }
        let opened = open(&folder);
        written.iter().for_each(|path| drop(fs::remove_file(path)));
        Some(opened)
    })
    .flatten()
    .unwrap_or(false)
}

/// Writes a small image where there is none.
fn write_once(path: &Path) -> Option<()> {
    if !path.exists() {
        fs::create_dir_all(path.parent()?).ok()?;
        fs::write(path, [&b"P5\n16 12\n65535\n"[..], &[4; 2 * 16 * 12]].concat()).ok()?;
    }
    Some(())
}

fn open(folder: &Path) -> bool {
    let camera = detect_camera(folder);
    let mut opened = false;
    for layout in std::iter::once(None).chain(Layout::ALL.map(Some)) {
        let options = SequenceOptions { layout, ..SequenceOptions::default() };
        let Ok(sequence) = Sequence::open(folder, &options) else { continue };
        assert!(!sequence.entries.is_empty(), "a sequence that was accepted has no frames");
        let ascend = sequence.entries.windows(2).all(|pair| pair[0].timestamp_ns < pair[1].timestamp_ns);
        assert!(ascend, "the stamps of a sequence do not ascend");
        let _ = sequence.info();
        if let Some(path) = sequence.ground_truth.path() {
            let _ = sequence.ground_truth.read(path);
        }
        if let Ok(camera) = &camera {
            let _ = complete_camera(&mut camera.clone(), &sequence);
        }
        let _ = Sequence::open(folder, &SequenceOptions { reverse: true, ..options });
        opened = true;
    }
    opened
}

/// A list of times, and the same text as a list of poses of a file without times.
pub fn lists(bytes: &[u8]) -> bool {
    let times = with_file("times.txt", bytes, read_times);
    let Some(Ok(times)) = times else { return false };
    let poses = with_file("trajectory.txt", bytes, TrajectoryFile::read);
    if let Some(Ok(poses)) = poses {
        let _ = poses.with_times(&times, Path::new("times.txt"));
    }
    !times.is_empty()
}
