//! The ICL-NUIM data set (Handa et al., "A benchmark for RGB-D visual odometry, 3D reconstruction and SLAM", ICRA 2014) in its form for
//! TUM tools.
//!
//! In: a folder with `associations.txt`, whose stamps are frame numbers, `rgb/`, `depth/` and, optionally, `*.gt.freiburg`. Out: its
//! frames, the calibration, the ground truth. The data set has y up, which makes fy negative and its frames left-handed. Here y points
//! down and fy is positive, and the ground truth is mirrored accordingly.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use yfslam::config::DepthSource;

use super::intrinsics::{has_camera_file, rgbd_camera};
use super::layout::{Listing, rgbd_or_mono};
use super::pairs::from_associations;
use super::{GroundTruthReader, SequenceOptions};
use crate::error::Result;
use crate::trajectory::{StampedPose, TrajectoryFile};

/// Size and fx, fy, cx, cy as the data set documents them, with y down.
const CAMERA: ([usize; 2], [f64; 4]) = ([640, 480], [481.2, 480.0, 319.5, 239.5]);

/// Ending of the ground truth files.
const TRUTH_ENDING: &str = ".gt.freiburg";

/// Returns whether `folder` is such a sequence.
pub fn is_sequence(folder: &Path) -> bool {
    let name =
        folder.canonicalize().ok().and_then(|path| path.file_name().map(|name| name.to_string_lossy().to_lowercase()));
    let has_name = name.is_some_and(|name| {
        ["living_room_traj", "office_room_traj", "icl_nuim", "icl-nuim"].iter().any(|part| name.contains(part))
            || (name.starts_with("traj") && name.ends_with("_frei_png"))
    });
    folder.join("associations.txt").is_file() && (has_name || truth_file(folder).is_some())
}

fn truth_file(folder: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?;
    let is_truth = |path: &PathBuf| path.to_string_lossy().ends_with(TRUTH_ENDING);
    entries.flatten().map(|entry| entry.path()).filter(is_truth).min()
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let depth_source = rgbd_or_mono(folder, options)?;
    let (mut entries, report) = from_associations(&folder.join("associations.txt"))?;
    let fps = options.fps();
    for entry in &mut entries {
        entry.timestamp_ns = time_of(entry.timestamp_ns, fps);
        match &mut entry.paired_image {
            Some(paired) if depth_source == DepthSource::Image => paired.stamp_ns = time_of(paired.stamp_ns, fps),
            _ => entry.paired_image = None,
        }
    }
    let mut notes = vec![match options.fps {
        Some(fps) => format!("the stamps are frame numbers: {fps} frames per second, from --fps"),
        None => format!("the stamps are frame numbers: {fps} frames per second, as the data set has them"),
    }];
    let truth = truth_file(folder).unwrap_or_else(|| folder.join("groundtruth.txt"));
    notes.push("ICL-NUIM has y up and a negative fy: fy is positive here, and the ground truth is mirrored".into());
    let ground_truth = GroundTruthReader::icl_nuim(truth, fps);
    let mut calibration = None;
    if options.read_calibration && !has_camera_file(folder) {
        let (size, intrinsics) = CAMERA;
        calibration = Some(rgbd_camera(size, intrinsics, 5000.0, fps, "ICL-NUIM, as documented".into())?);
    }
    Ok(Listing { depth_source, entries, report, calibration, ground_truth, notes })
}

/// Returns the time of a frame whose number was read as seconds.
fn time_of(number_ns: i64, fps: f64) -> i64 {
    (number_ns as f64 / fps).round() as i64
}

/// Converts ground truth with frame numbers and y up into times and y down.
pub fn convert(mut truth: TrajectoryFile, fps: f64) -> TrajectoryFile {
    for pose in &mut truth.poses {
        *pose = StampedPose::new(time_of(pose.timestamp_ns, fps), mirrored(&pose.t_world_cam));
    }
    truth
}

/// Mirrors both frames of a pose at the plane y = 0.
fn mirrored(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q.w, -q.x, q.y, -q.z));
    Isometry3::from_parts(Translation3::new(t.x, -t.y, t.z), rotation)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;

    #[test]
    fn a_mirrored_pose_maps_mirrored_points_alike() {
        let pose = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.3, -0.7, 0.4));
        let mirror = |p: Point3<f64>| Point3::new(p.x, -p.y, p.z);
        let point = Point3::new(0.4, 0.5, -0.6);
        assert!((mirrored(&pose) * mirror(point) - mirror(pose * point)).norm() < 1e-12);
        assert_eq!(time_of(30_000_000_000, 30.0), 1_000_000_000);
    }
}
