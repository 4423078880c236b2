//! Reads the ground truth of a sequence in the formats of the benchmarks.
//!
//! In: a file. Out: poses of the camera of the frames, world from camera, also if the file contains those of another camera or a body.

use std::path::{Path, PathBuf};

use nalgebra::Isometry3;

use super::{euroc, kitti};
use crate::error::Result;
use crate::text::read_text;
use crate::trajectory::TrajectoryFile;

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

    /// Returns the file in the folder if it exists.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref().filter(|path| path.is_file())
    }

    /// Reads `path` in the format of the benchmark or of TUM; in the format of TUM the poses are those of the camera.
    ///
    /// # Errors
    /// The file cannot be read, or a line is malformed.
    pub fn read(&self, path: &Path) -> Result<TrajectoryFile> {
        let text = read_text(path)?;
        match &self.format {
            Format::Euroc(t_body_cam) if text.contains(',') => euroc::parse_ground_truth(&text, path, t_body_cam),
            Format::Kitti(t_cam0_cam, stamps_ns) if kitti::is_ground_truth(&text) => {
                kitti::parse_ground_truth(&text, path, t_cam0_cam, stamps_ns)
            }
            _ => TrajectoryFile::parse(&text, path),
        }
    }
}
