//! The true poses of a sequence's camera, in the formats of the benchmarks.
//!
//! In: a file. Out: poses of the camera of the frames, world from camera, whatever the file has poses of.

use std::path::{Path, PathBuf};

use nalgebra::Isometry3;

use super::{euroc, kitti};
use crate::error::Result;
use crate::text::read_text;
use crate::trajectory::TrajectoryFile;

/// Reads the ground truth of a sequence.
#[derive(Clone, Debug)]
pub struct TruthReader {
    /// Where it lies if it is there.
    path: Option<PathBuf>,
    format: Format,
}

/// What a file of the layout says.
#[derive(Clone, Debug)]
enum Format {
    /// Poses of the camera.
    Tum,
    /// Poses of the body, in which the camera has the given pose.
    Euroc(Isometry3<f64>),
    /// Matrices of camera 0, in which the camera has the given pose, at the given times, ns.
    Kitti(Isometry3<f64>, Vec<i64>),
}

impl TruthReader {
    pub(super) fn tum(path: PathBuf) -> Self {
        Self { path: Some(path), format: Format::Tum }
    }

    pub(super) fn euroc(path: PathBuf, t_body_cam: Isometry3<f64>) -> Self {
        Self { path: Some(path), format: Format::Euroc(t_body_cam) }
    }

    pub(super) fn kitti(path: Option<PathBuf>, t_cam0_cam: Isometry3<f64>, stamps_ns: Vec<i64>) -> Self {
        Self { path, format: Format::Kitti(t_cam0_cam, stamps_ns) }
    }

    /// The file in the folder, if there is one.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref().filter(|path| path.is_file())
    }

    /// Reads `path`, in the format of the benchmark or in TUM's; in TUM's the poses are the camera's own.
    ///
    /// # Errors
    /// It cannot be read, or a line is no pose.
    pub fn read(&self, path: &Path) -> Result<TrajectoryFile> {
        let text = read_text(path)?;
        match &self.format {
            Format::Euroc(t_body_cam) if text.contains(',') => euroc::parse_truth(&text, path, t_body_cam),
            Format::Kitti(t_cam0_cam, stamps_ns) if kitti::is_truth(&text) => {
                kitti::parse_truth(&text, path, t_cam0_cam, stamps_ns)
            }
            _ => TrajectoryFile::parse(&text, path),
        }
    }
}
