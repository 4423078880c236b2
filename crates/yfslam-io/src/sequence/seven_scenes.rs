//! The 7-Scenes data set (Shotton et al., "Scene coordinate regression forests for camera relocalization in RGB-D images", CVPR 2013).
//!
//! In: a folder with `frame-000000.color.png`, `.depth.png` (millimetres, 65535 where nothing was measured) and `.pose.txt`. Out: its
//! frames, the documented calibration of the depth camera, the ground truth.

use std::path::{Path, PathBuf};

use yfslam::config::DepthSource;

use super::folders::Images;
use super::images::{IMAGE_ENDINGS, images_in};
use super::intrinsics::{has_camera_file, rgbd_camera};
use super::layout::{Listing, rgbd_or_mono};
use super::{GroundTruthReader, SequenceOptions};
use crate::error::Result;

/// Size and fx, fy, cx, cy of the Kinect, as the page of the data set states them for depth; colour is not calibrated.
const CAMERA: ([usize; 2], [f64; 4]) = ([640, 480], [585.0, 585.0, 320.0, 240.0]);

/// Returns whether `folder` is such a sequence.
pub fn is_sequence(folder: &Path) -> bool {
    let has = |number: &str| {
        IMAGE_ENDINGS.iter().any(|ending| folder.join(format!("frame-{number}.color.{ending}")).is_file())
    };
    has("000000") || has("000001") || images_in(folder, |name| is_of(name, "color")).is_ok_and(|i| !i.is_empty())
}

/// Returns whether `name` is that of a file such as `frame-000000.color.png`.
fn is_of(name: &str, kind: &str) -> bool {
    name.starts_with("frame-") && name.contains(&format!(".{kind}."))
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let depth_source = rgbd_or_mono(folder, options)?;
    let color = images_in(folder, |name| is_of(name, "color"))?;
    let depth = match depth_source {
        DepthSource::Image => Some(images_in(folder, |name| is_of(name, "depth"))?),
        _ => None,
    };
    let images = Images { color, depth, color_folder: folder, depth_folder: folder, folder };
    let (entries, report, mut notes) = images.pair(options)?;
    let frame = |entry: &super::FrameEntry| Some((entry.timestamp_ns, pose_file(entry.color.file()?)?));
    let poses: Vec<(i64, PathBuf)> = entries.iter().filter_map(frame).collect();
    let has_poses = poses.iter().any(|(_, path)| path.is_file());
    let ground_truth = GroundTruthReader::pose_files(folder.to_owned(), if has_poses { poses } else { Vec::new() });
    let mut calibration = None;
    if options.read_calibration && !has_camera_file(folder) {
        let (size, intrinsics) = CAMERA;
        let origin = "7-Scenes, as documented for its depth camera".to_owned();
        calibration = Some(rgbd_camera(size, intrinsics, 1000.0, options.fps(), origin)?);
        let note = "7-Scenes has no calibration of the colour camera, and depth is not registered to colour: the camera is rough; \
                    --camera replaces it";
        notes.push(note.into());
    }
    Ok(Listing { depth_source, entries, report, calibration, ground_truth, notes })
}

/// Returns the file of the pose that belongs to a colour image.
fn pose_file(color: &Path) -> Option<PathBuf> {
    let (frame, _) = color.file_name()?.to_str()?.split_once(".color.")?;
    Some(color.with_file_name(format!("{frame}.pose.txt")))
}
