//! Reads the ground truth of a sequence in the formats of the benchmarks.
//!
//! In: a file. Out: poses of the camera of the frames, world from camera, also if the file contains those of another camera or a body.

use std::path::{Path, PathBuf};

use nalgebra::Isometry3;

use super::{csv, euroc, icl_nuim, kitti, matrices};
use crate::bag::is_bag;
use crate::error::Result;
use crate::text::read_text;
use crate::trajectory::{StampedPose, TrajectoryFile};

/// Reads the ground truth of a sequence.
#[derive(Clone, Debug)]
pub struct GroundTruthReader {
    /// Where the file is expected.
    path: Option<PathBuf>,
    format: Format,
}

/// Content of the ground truth file of a layout.
#[derive(Clone, Debug)]
enum Format {
    /// Poses of the camera.
    Tum,
    /// Poses of the body; the camera has the given pose in the body frame.
    Euroc(Isometry3<f64>),
    /// Matrices of camera 0 at the given times, ns; the camera has the given pose in the frame of camera 0.
    Kitti(Isometry3<f64>, Vec<i64>),
    /// A file with a matrix for each frame; time of the frame, ns, and file.
    PoseFiles(Vec<(i64, PathBuf)>),
    /// A matrix on each line, the first of frame 0, where the frame with this number is at time 0, at this many frames per second.
    MatrixList(u64, f64),
    /// Frame numbers and poses with y up, at this many frames per second.
    IclNuim(f64),
    /// A table whose header names the columns.
    Csv,
    /// Poses of the camera that were read from a topic of a bag.
    Bag(Vec<StampedPose>, String),
}

impl GroundTruthReader {
    pub(super) fn tum(path: PathBuf) -> Self {
        Self { path: Some(path), format: Format::Tum }
    }

    pub(super) fn euroc(path: PathBuf, t_body_cam: Isometry3<f64>) -> Self {
        Self { path: Some(path), format: Format::Euroc(t_body_cam) }
    }

    pub(super) fn kitti(path: Option<PathBuf>, t_cam0_cam: Isometry3<f64>, stamps_ns: Vec<i64>) -> Self {
        Self { path, format: Format::Kitti(t_cam0_cam, stamps_ns) }
    }

    /// Makes a reader of one pose file for each frame, which are in `folder`; without frames there is no ground truth.
    pub(super) fn pose_files(folder: PathBuf, frames: Vec<(i64, PathBuf)>) -> Self {
        Self { path: (!frames.is_empty()).then_some(folder), format: Format::PoseFiles(frames) }
    }

    pub(super) fn matrix_list(path: PathBuf, first: u64, fps: f64) -> Self {
        Self { path: Some(path), format: Format::MatrixList(first, fps) }
    }

    pub(super) fn icl_nuim(path: PathBuf, fps: f64) -> Self {
        Self { path: Some(path), format: Format::IclNuim(fps) }
    }

    pub(super) fn csv(path: PathBuf) -> Self {
        Self { path: Some(path), format: Format::Csv }
    }

    /// Makes a reader of poses that were read from a topic of the bag at `path`.
    pub(super) fn bag(path: PathBuf, poses: Vec<StampedPose>, topic: String) -> Self {
        Self { path: Some(path), format: Format::Bag(poses, topic) }
    }

    /// Makes a reader of a sequence without ground truth.
    pub(super) fn none() -> Self {
        Self { path: None, format: Format::Tum }
    }

    /// Returns the file, or the folder of the pose files, if it exists.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref().filter(|path| path.exists())
    }

    /// Returns the topic of a bag from which the poses were read.
    pub(super) fn topic(&self) -> Option<&str> {
        match &self.format {
            Format::Bag(_, topic) => Some(topic),
            _ => None,
        }
    }

    /// Reads `path` in the format of the benchmark or of TUM, or a bag; in the format of TUM and in bags the poses are those of the camera.
    ///
    /// # Errors
    /// The file cannot be read, or a line is malformed.
    pub fn read(&self, path: &Path) -> Result<TrajectoryFile> {
        if let Format::Bag(poses, _) = &self.format
            && self.path.as_deref() == Some(path)
        {
            return TrajectoryFile::from_poses(poses.clone(), path);
        }
        if let Format::PoseFiles(frames) = &self.format
            && path.is_dir()
        {
            return matrices::read_pose_files(frames, path);
        }
        if is_bag(path) {
            return TrajectoryFile::read(path);
        }
        let text = read_text(path)?;
        match &self.format {
            Format::MatrixList(first, fps) if matrices::is_matrix_list(&text) => {
                let stamp_ns = |index: usize| ((index as f64 - *first as f64) / fps * 1e9).round() as i64;
                matrices::parse_matrix_list(&text, path, stamp_ns)
            }
            Format::IclNuim(fps) => TrajectoryFile::parse(&text, path).map(|truth| icl_nuim::convert(truth, *fps)),
            Format::Csv if text.contains(',') => csv::parse_poses(&text, path),
            Format::Euroc(t_body_cam) if text.contains(',') => euroc::parse_ground_truth(&text, path, t_body_cam),
            Format::Kitti(t_cam0_cam, stamps_ns) if kitti::is_ground_truth(&text) => {
                kitti::parse_ground_truth(&text, path, t_cam0_cam, stamps_ns)
            }
            _ => TrajectoryFile::parse(&text, path),
        }
    }
}
