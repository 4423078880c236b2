//! The ETH3D SLAM benchmark (Schöps et al., "BAD SLAM: Bundle adjusted direct RGB-D SLAM", CVPR 2019): lists as in the TUM benchmark, and
//! a calibration of its own.
//!
//! In: a folder with `rgb.txt`, `depth.txt`, `calibration.txt` (`fx fy cx cy`) and `groundtruth.txt`. Out: its frames, the calibration.

use std::path::Path;

use super::images::color_size;
use super::intrinsics::{has_camera_file, layout_camera};
use super::layout::Listing;
use super::{ImageRef, SequenceOptions, tum};
use crate::camera::check_camera;
use crate::error::Result;
use crate::text::{content_lines, read_text};

/// Units of depth images per metre.
const DEPTH_FACTOR: f64 = 5000.0;

/// Name of the calibration.
pub const CALIBRATION: &str = "calibration.txt";

/// Returns whether `folder` is such a sequence.
pub fn is_sequence(folder: &Path) -> bool {
    folder.join("rgb.txt").is_file() && read_text(&folder.join(CALIBRATION)).is_ok_and(|text| is_calibration(&text))
}

/// Returns whether `text` is one line of four numbers.
fn is_calibration(text: &str) -> bool {
    let mut lines = content_lines(text).map(|(_, line)| line.split_whitespace().map(str::parse::<f64>));
    let first = lines.next().map(|words| words.collect::<std::result::Result<Vec<_>, _>>());
    matches!(first, Some(Ok(numbers)) if numbers.len() == 4) && lines.next().is_none()
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let mut listing = tum::list(folder, options)?;
    if options.read_calibration && !has_camera_file(folder) {
        let mut calibration = layout_camera(&folder.join(CALIBRATION), DEPTH_FACTOR, options.fps())?;
        let first = listing.entries.iter().find_map(|entry| entry.color.file().map(|path| folder.join(path)));
        let first = ImageRef::File(first.unwrap_or_else(|| folder.to_owned()));
        let size = color_size(&first)?;
        [calibration.camera.camera.width, calibration.camera.camera.height] = size;
        calibration.camera.missing.size = false;
        check_camera(&calibration.camera)?;
        listing.calibration = Some(calibration);
    }
    Ok(listing)
}
