//! The ETH3D SLAM benchmark (Schöps et al., "BAD SLAM: Bundle adjusted direct RGB-D SLAM", CVPR 2019): lists as in the TUM benchmark, and
//! a calibration of its own.
//!
//! In: a folder with `rgb.txt`, `depth.txt`, `calibration.txt` (`fx fy cx cy`) and `groundtruth.txt`. Out: its frames, the calibration.

use std::path::Path;

use yfslam::RgbImage;

use super::intrinsics::{has_camera_file, rgbd_camera};
use super::layout::Listing;
use super::{ImageRef, SequenceOptions, tum};
use crate::error::{Error, Result};
use crate::stream::open_color;
use crate::text::{content_lines, read_text};

/// Name of the calibration.
pub const CALIBRATION: &str = "calibration.txt";

/// Returns whether `folder` is such a sequence.
pub fn is_sequence(folder: &Path) -> bool {
    folder.join("rgb.txt").is_file()
        && read_text(&folder.join(CALIBRATION)).is_ok_and(|text| intrinsics(&text).is_some())
}

/// Returns fx, fy, cx, cy.
fn intrinsics(text: &str) -> Option<[f64; 4]> {
    let (_, line) = content_lines(text).next()?;
    let numbers: Vec<f64> = line.split_whitespace().map(str::parse).collect::<std::result::Result<_, _>>().ok()?;
    numbers.try_into().ok()
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let mut listing = tum::list(folder, options)?;
    if options.read_calibration && !has_camera_file(folder) {
        let path = folder.join(CALIBRATION);
        let intrinsics = intrinsics(&read_text(&path)?)
            .ok_or_else(|| Error::content(&path, "does not hold four numbers", "write 'fx fy cx cy'"))?;
        let first = listing.entries.iter().find_map(|entry| entry.color.file().map(|path| folder.join(path)));
        let (mut bytes, mut image) = (Vec::new(), RgbImage::default());
        let first = ImageRef::File(first.unwrap_or_else(|| folder.to_owned()));
        open_color(&first, None, &mut bytes, &mut image).map_err(|error| {
            Error::content(folder, error.to_string(), "unpack the sequence again, or give --camera")
        })?;
        let size = [image.width(), image.height()];
        listing.calibration = Some(rgbd_camera(size, intrinsics, 5000.0, options.fps(), path.display().to_string())?);
    }
    Ok(listing)
}
