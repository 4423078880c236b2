//! Poses as 4 × 4 matrices in text, world from camera: one file for each frame (7-Scenes, ScanNet) or one line (Replica).

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Translation3};

use crate::error::{Error, Result};
use crate::rotation;
use crate::text::{content_lines, read_text};
use crate::trajectory::{StampedPose, TrajectoryFile};

/// What a matrix holds.
enum Matrix {
    Pose(Isometry3<f64>),
    /// Not finite: the data set has no pose for this frame.
    None,
    /// Not the matrix of a rigid motion.
    Bad,
}

/// Reads the pose of each frame from a file of its own. Frames without a file, and matrices that are not finite, are left out.
///
/// # Errors
/// A file is unreadable or does not hold a pose, or no frame has one.
pub fn read_pose_files(frames: &[(i64, PathBuf)], folder: &Path) -> Result<TrajectoryFile> {
    let mut poses = Vec::new();
    for (timestamp_ns, path) in frames.iter().filter(|(_, path)| path.is_file()) {
        match matrix(&read_text(path)?) {
            Matrix::Pose(pose) => poses.push(StampedPose::new(*timestamp_ns, pose)),
            Matrix::None => {}
            Matrix::Bad => return Err(Error::content(path, "is not the 4 × 4 matrix of a pose", CURE)),
        }
    }
    TrajectoryFile::from_poses(poses, folder)
}

const CURE: &str = "write its 16 numbers row by row";

/// Returns whether `text` is a list of 4 × 4 matrices, one a line.
pub fn is_matrix_list(text: &str) -> bool {
    content_lines(text).next().is_some_and(|(_, line)| !matches!(matrix(line), Matrix::Bad))
}

/// Parses one matrix a line; line `k` belongs to frame number `k`, at `stamp_ns(k)`.
///
/// # Errors
/// A line does not hold a pose, or none does.
pub fn parse_matrix_list(text: &str, path: &Path, stamp_ns: impl Fn(usize) -> i64) -> Result<TrajectoryFile> {
    let mut poses = Vec::new();
    for (index, (number, line)) in content_lines(text).enumerate() {
        match matrix(line) {
            Matrix::Pose(pose) => poses.push(StampedPose::new(stamp_ns(index), pose)),
            Matrix::None => {}
            Matrix::Bad => return Err(Error::line(path, number, "is not the 4 × 4 matrix of a pose", CURE)),
        }
    }
    TrajectoryFile::from_poses(poses, path)
}

/// Parses 16 numbers, row by row.
fn matrix(text: &str) -> Matrix {
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    let Some(Ok(m)) = numbers.map(<[f64; 16]>::try_from) else { return Matrix::Bad };
    if m.iter().any(|value| !value.is_finite()) {
        return Matrix::None;
    }
    let rotation = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
    let Some(rotation) = rotation::nearest_rotation(&rotation, rotation::OF_POSES) else { return Matrix::Bad };
    Matrix::Pose(Isometry3::from_parts(Translation3::new(m[3], m[7], m[11]), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_become_poses_and_those_that_are_not_finite_are_left_out() {
        let good = "0 -1 0 1.5 1 0 0 2 0 0 1 3 0 0 0 1";
        let text = format!("{good}\n{}\n{good}\n", "-inf ".repeat(16));
        assert!(is_matrix_list(&text));
        let file = parse_matrix_list(&text, Path::new("traj.txt"), |k| k as i64 * 10).unwrap();
        assert_eq!(file.poses.iter().map(|pose| pose.timestamp_ns).collect::<Vec<_>>(), [0, 20]);
        let pose = file.poses[1].t_world_cam;
        let point = pose * nalgebra::Point3::new(1.0, 0.0, 0.0);
        assert!((point - nalgebra::Point3::new(1.5, 3.0, 3.0)).norm() < 1e-12);
        assert!(!is_matrix_list("1 2 3 4 5 6 7 8"));
        let bad = format!("{good}\n2{good}\n");
        let error = parse_matrix_list(&bad, Path::new("traj.txt"), |k| k as i64).unwrap_err().to_string();
        assert!(error.contains("traj.txt:2") && error.contains("4 × 4"), "{error}");
    }
}
