//! The OpenLORIS-Scene data set (Shi et al., "Are we ready for service robots?", ICRA 2020), its folders of images.
//!
//! In: a folder with `color.txt`, `aligned_depth.txt` (millimetres), `groundtruth.txt` and, optionally, `sensors.yaml`. Out: its frames.

use std::path::Path;

use yfslam::config::DepthSource;

use super::intrinsics::{has_camera_file, rgbd_camera};
use super::layout::{Calibration, Listing, rgbd_or_mono};
use super::pairs::{List, from_lists};
use super::{GroundTruthReader, SequenceOptions};
use crate::error::{Error, Result};
use crate::text::read_text;

/// Name of the calibration of all sensors.
pub const CALIBRATION: &str = "sensors.yaml";

/// Returns whether `folder` is such a sequence.
pub fn is_sequence(folder: &Path) -> bool {
    ["color.txt", "aligned_depth.txt"].iter().all(|name| folder.join(name).is_file())
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let depth_source = rgbd_or_mono(folder, options)?;
    let depth =
        (depth_source == DepthSource::Image).then(|| List::read(folder.join("aligned_depth.txt"))).transpose()?;
    let color = List::read(folder.join("color.txt"))?;
    let (entries, report) = from_lists(folder, color, depth, options.association_tolerance_ns)?;
    let ground_truth = GroundTruthReader::tum(folder.join("groundtruth.txt"));
    let path = folder.join(CALIBRATION);
    let mut calibration = None;
    if options.read_calibration && !has_camera_file(folder) && path.is_file() {
        calibration = Some(camera(&path)?);
    }
    Ok(Listing { depth_source, entries, report, calibration, ground_truth, notes: Vec::new() })
}

/// Reads the colour camera of the D435i.
fn camera(path: &Path) -> Result<Calibration> {
    let text = read_text(path)?;
    let cure = "use the original sensors.yaml, or give --camera";
    let missing = |what: &str| Error::content(path, format!("{what} is missing"), cure);
    let (_, section) = text.split_once("d400_color").ok_or_else(|| missing("d400_color_optical_frame"))?;
    // The next sensor begins in the first column.
    let section: String = section
        .lines()
        .take(1)
        .chain(section.lines().skip(1).take_while(|line| line.is_empty() || line.starts_with([' ', '\t', '#'])))
        .flat_map(|line| [line, "\n"])
        .collect();
    let number = |key: &str| -> Option<f64> {
        section.lines().find_map(|line| line.trim().strip_prefix(key)?.trim().strip_prefix(':')?.trim().parse().ok())
    };
    let (Some(width), Some(height)) = (number("width"), number("height")) else {
        return Err(missing("width or height"));
    };
    let after = section.split_once("intrinsics").map(|(_, after)| after);
    let inside = after.and_then(|after| after.split_once('[')?.1.split_once(']')).map(|(inside, _)| inside);
    let numbers: Vec<f64> =
        inside.unwrap_or_default().split([',', ' ', '\n']).filter_map(|word| word.trim().parse().ok()).collect();
    let [a, b, c, d] = numbers[..] else { return Err(missing("intrinsics with four numbers")) };
    // The order is fx, cx, fy, cy; the two focal lengths are nearly equal.
    let intrinsics = if (a - c).abs() <= (a - b).abs() { [a, c, b, d] } else { [a, b, c, d] };
    let fps = number("fps").unwrap_or(super::DEFAULT_FPS);
    rgbd_camera([width as usize, height as usize], intrinsics, 1000.0, fps, path.display().to_string())
}
