//! The Replica rooms as rendered for iMAP (Sucar et al., ICCV 2021) and published with NICE-SLAM (Zhu et al., CVPR 2022).
//!
//! In: a folder with `results/frame000000.jpg`, `results/depth000000.png` and `traj.txt`, with `cam_params.json` in it or beside it. Out:
//! its frames, the calibration, the ground truth.

use std::path::Path;

use yfslam::config::DepthSource;

use super::folders::Images;
use super::images::images_in;
use super::intrinsics::{has_camera_file, layout_camera, rgbd_camera};
use super::layout::{Calibration, Listing, rgbd_or_mono};
use super::{GroundTruthReader, SequenceOptions};
use crate::error::Result;

/// Name of the camera file.
pub const CAMERA_FILE: &str = "cam_params.json";

/// Size and fx, fy, cx, cy of all published rooms, for folders without the file.
const CAMERA: ([usize; 2], [f64; 4]) = ([1200, 680], [600.0, 600.0, 599.5, 339.5]);

/// Units of depth images per metre.
const DEPTH_FACTOR: f64 = 6553.5;

/// Returns whether `folder` is such a sequence.
pub fn is_sequence(folder: &Path) -> bool {
    images_in(&folder.join("results"), |name| name.starts_with("frame")).is_ok_and(|images| !images.is_empty())
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let depth_source = rgbd_or_mono(folder, options)?;
    let results = folder.join("results");
    let color = images_in(&results, |name| name.starts_with("frame"))?;
    let first = color.first().and_then(|image| image.number).unwrap_or(0);
    let depth = match depth_source {
        DepthSource::Image => Some(images_in(&results, |name| name.starts_with("depth"))?),
        _ => None,
    };
    let images = Images { color, depth, color_folder: &results, depth_folder: &results, folder };
    let (entries, report, mut notes) = images.pair(options)?;
    let ground_truth = GroundTruthReader::matrix_list(folder.join("traj.txt"), first, options.fps());
    let mut calibration = None;
    if options.read_calibration && !has_camera_file(folder) {
        let (found, is_documented) = camera(folder, options.fps())?;
        calibration = Some(found);
        if is_documented {
            notes.push(format!("there is no {CAMERA_FILE}: the camera is that of the published rooms"));
        }
    }
    Ok(Listing { depth_source, entries, report, calibration, ground_truth, notes })
}

/// Reads the camera file in `folder` or beside it; the second value says that there is none.
fn camera(folder: &Path, fps: f64) -> Result<(Calibration, bool)> {
    let parent = folder.canonicalize().ok().and_then(|folder| folder.parent().map(Path::to_owned));
    let candidates = [Some(folder.to_owned()), parent].into_iter().flatten();
    let path = candidates.map(|folder| folder.join(CAMERA_FILE)).find(|path| path.is_file());
    match path {
        Some(path) => Ok((layout_camera(&path, DEPTH_FACTOR, fps)?, false)),
        None => {
            let (size, intrinsics) = CAMERA;
            Ok((rgbd_camera(size, intrinsics, DEPTH_FACTOR, fps, "Replica, as published".into())?, true))
        }
    }
}
