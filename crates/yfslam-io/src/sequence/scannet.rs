//! Scenes of ScanNet (Dai et al., CVPR 2017) as its reader exports them.
//!
//! In: a folder with `color/0.jpg`, `depth/0.png` (millimetres), `pose/0.txt` and `intrinsic/intrinsic_color.txt`, `intrinsic_depth.txt`.
//! Out: its frames, the calibration of the colour camera, to which depth is resampled if it has another size, the ground truth.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use yfslam::Camera;
use yfslam::config::DepthSource;

use super::folders::Images;
use super::images::{color_size, depth_size, images_in};
use super::intrinsics::{has_camera_file, rgbd_camera};
use super::layout::{Calibration, Listing, rgbd_or_mono};
use super::{FrameEntry, GroundTruthReader, SequenceOptions};
use crate::depth_resampling::DepthResampling;
use crate::error::{Error, Result};
use crate::text::read_text;

/// Units of depth images per metre.
const DEPTH_FACTOR: f64 = 1000.0;

/// Largest distance of the principal point from the middle of the image, as a part of its size, for intrinsics that belong to it.
const MAX_OFF_CENTRE: f64 = 0.15;

/// Returns whether `folder` is such a scene.
pub fn is_sequence(folder: &Path) -> bool {
    ["color", "depth", "pose"].iter().all(|name| folder.join(name).is_dir())
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let depth_source = rgbd_or_mono(folder, options)?;
    let (color_folder, depth_folder) = (folder.join("color"), folder.join("depth"));
    let color = images_in(&color_folder, |_| true)?;
    let depth = match depth_source {
        DepthSource::Image => Some(images_in(&depth_folder, |_| true)?),
        _ => None,
    };
    let images = Images { color, depth, color_folder: &color_folder, depth_folder: &depth_folder, folder };
    let (entries, report, mut notes) = images.pair(options)?;
    let poses = folder.join("pose");
    let pose_file = |entry: &FrameEntry| {
        let mut name = entry.color.file()?.file_stem()?.to_owned();
        name.push(".txt");
        Some((entry.timestamp_ns, poses.join(name)))
    };
    let files: Vec<(i64, PathBuf)> = entries.iter().filter_map(pose_file).collect();
    let ground_truth = GroundTruthReader::pose_files(poses.clone(), files);
    let mut calibration = None;
    if options.read_calibration && !has_camera_file(folder) {
        let first = entries.first().ok_or_else(|| Error::content(folder, "has no frames", "export the scene again"))?;
        let found = read_calibration(folder, first, options.fps())?;
        if let Some(resampling) = &found.depth_resampling {
            let ([width, height], camera) = (resampling.from, &found.camera.camera);
            notes.push(format!(
                "depth images have {width}×{height} px and colour images {}×{}: each pixel of a colour image takes the depth of the nearest \
                 pixel, by the intrinsics of both cameras",
                camera.width, camera.height
            ));
        }
        calibration = Some(found);
    }
    Ok(Listing { depth_source, entries, report, calibration, ground_truth, notes })
}

/// Reads the calibration; the sizes are those of the images of `first`.
fn read_calibration(folder: &Path, first: &FrameEntry, fps: f64) -> Result<Calibration> {
    let color_size = color_size(&first.color)?;
    let depth_size = first.paired_image.as_ref().map_or(Ok(color_size), |paired| depth_size(&paired.image))?;
    let (color_path, color_intrinsics) = fitting(folder, color_size)?;
    let origin = color_path.display().to_string();
    let mut calibration = rgbd_camera(color_size, color_intrinsics, DEPTH_FACTOR, fps, origin)?;
    if depth_size != color_size {
        let (_, [fx, fy, cx, cy]) = fitting(folder, depth_size)?;
        let depth_camera = Camera::pinhole(depth_size[0], depth_size[1], fx, fy, cx, cy);
        let resampling = DepthResampling::new(&calibration.camera.camera, &depth_camera);
        calibration.depth_resampling = Some(Arc::new(resampling));
    }
    Ok(calibration)
}

/// Returns the intrinsics whose principal point is in the middle of an image of this size: exports may be scaled down to the depth.
fn fitting(folder: &Path, [width, height]: [usize; 2]) -> Result<(PathBuf, [f64; 4])> {
    let mut found = Vec::new();
    for name in ["intrinsic_color.txt", "intrinsic_depth.txt"] {
        let candidates = [folder.join("intrinsic").join(name), folder.join(name)];
        if let Some(path) = candidates.into_iter().find(|path| path.is_file()) {
            let intrinsics = intrinsics(&path)?;
            let [_, _, cx, cy] = intrinsics;
            let off = |center: f64, side: usize| (2.0 * center / side as f64 - 1.0).abs() / 2.0;
            if off(cx, width) < MAX_OFF_CENTRE && off(cy, height) < MAX_OFF_CENTRE {
                return Ok((path, intrinsics));
            }
            found.push(name);
        }
    }
    let problem = match found.as_slice() {
        [] => "has no intrinsic/intrinsic_color.txt and no intrinsic/intrinsic_depth.txt".to_owned(),
        found => format!("the intrinsics in {} do not belong to images of {width}×{height} px", found.join(" and ")),
    };
    Err(Error::content(folder, problem, "export the intrinsics with the images, or give --camera"))
}

/// Reads fx, fy, cx, cy from a 4 × 4 or 3 × 3 matrix.
fn intrinsics(path: &Path) -> Result<[f64; 4]> {
    let text = read_text(path)?;
    let numbers: Vec<f64> = text.split_whitespace().map_while(|word| word.parse().ok()).collect();
    match numbers.as_slice() {
        [fx, _, cx, _, _, fy, cy, _, _, _, _, _, _, _, _, _] | [fx, _, cx, _, fy, cy, _, _, _] => {
            Ok([*fx, *fy, *cx, *cy])
        }
        _ => Err(Error::content(path, "is not a matrix of intrinsics", "write its 16 numbers row by row")),
    }
}
