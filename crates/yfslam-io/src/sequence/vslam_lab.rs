//! The common form of sequences in VSLAM-LAB (Fontan et al., 2025).
//!
//! In: a folder with `rgb.csv`, whose header names the columns (`ts_rgb_0 (ns)`, `path_rgb_0`, `ts_depth_0 (ns)`, `path_depth_0`,
//! `path_rgb_1` …), `calibration.yaml` and `groundtruth.csv`. Out: its frames, the calibration, the ground truth.

use std::path::Path;

use yfslam::config::DepthSource;

use super::csv::{Table, TimeUnit};
use super::intrinsics::has_camera_file;
use super::layout::{Calibration, Listing, missing_images};
use super::lists::ListedFile;
use super::pairs::{List, from_lists};
use super::{GroundTruthReader, ListedImage, SequenceOptions};
use crate::camera::load_camera;
use crate::error::{Error, Result};
use crate::text::read_text;

/// Name of the list.
pub const LIST: &str = "rgb.csv";
/// Name of the calibration.
pub const CALIBRATION: &str = "calibration.yaml";

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let path = folder.join(LIST);
    let text = read_text(&path)?;
    let table = Table::parse(&text, &path)?;
    let color = images(&table, &path, "rgb_0")?.ok_or_else(|| {
        Error::content(
            &path,
            "has no column path_rgb_0",
            "name the columns in the first line: 'ts_rgb_0 (ns),path_rgb_0'",
        )
    })?;
    let (depth, right) = (images(&table, &path, "depth_0")?, images(&table, &path, "rgb_1")?);
    let depth_source = match options.depth_source {
        Some(DepthSource::Image) if depth.is_none() => return Err(missing_images(folder, DepthSource::Image)),
        Some(DepthSource::Stereo) if right.is_none() => return Err(missing_images(folder, DepthSource::Stereo)),
        Some(wanted) => wanted,
        None if depth.is_some() => DepthSource::Image,
        None if right.is_some() => DepthSource::Stereo,
        None => return Err(missing_images(folder, DepthSource::Image)),
    };
    let list = |images: Vec<ListedImage>| List { images, unstamped: 0, path: path.clone() };
    let (mut entries, mut report) = from_lists(folder, list(color), None, 0)?;
    let paired = match depth_source {
        DepthSource::Image => depth,
        DepthSource::Stereo => right,
        DepthSource::Motion => None,
    };
    if let Some(paired) = paired {
        // The images of one line belong together.
        let lines = images(&table, &path, "rgb_0")?.unwrap_or_default().into_iter().zip(paired);
        let by_color: std::collections::BTreeMap<i64, ListedImage> =
            lines.map(|(color, paired)| (color.stamp_ns, paired)).collect();
        report.paired_images_listed = by_color.len();
        for entry in &mut entries {
            entry.paired_image = by_color.get(&entry.timestamp_ns).cloned();
        }
    }
    let ground_truth = GroundTruthReader::csv(folder.join("groundtruth.csv"));
    let calibration = calibration(folder, options)?;
    Ok(Listing { depth_source, entries, report, calibration, ground_truth, notes: Vec::new() })
}

/// Reads the calibration, unless the folder has another camera file.
fn calibration(folder: &Path, options: &SequenceOptions) -> Result<Option<Calibration>> {
    let path = folder.join(CALIBRATION);
    if !options.read_calibration || has_camera_file(folder) || !path.is_file() {
        return Ok(None);
    }
    let camera = load_camera(&path.to_string_lossy(), None)?;
    Ok(Some(Calibration { camera, rectification: None, depth_resampling: None }))
}

/// Returns the images of one camera, such as `rgb_0`; `None` if the table has no such column.
fn images(table: &Table, path: &Path, camera: &str) -> Result<Option<Vec<ListedImage>>> {
    let short = camera.replace('_', "");
    let column = |kind: &str| {
        let names = [format!("{kind}_{camera}"), format!("{kind}_{short}")];
        names.iter().find_map(|name| table.column(name))
    };
    let Some(file) = column("path") else { return Ok(None) };
    let Some(time) = column("ts").or_else(|| table.column("ts_rgb_0")).or_else(|| table.column("ts_rgb0")) else {
        return Err(Error::content(
            path,
            format!("has no column ts_{camera}"),
            "add the time stamps, such as 'ts_rgb_0 (ns)'",
        ));
    };
    let unit = TimeUnit::of(table, time);
    let image = |row: &(usize, Vec<&str>)| {
        let (number, cells) = row;
        let stamp_ns = unit.parse(cells.get(time).copied().unwrap_or_default(), path, *number)?;
        let file = cells.get(file).copied().unwrap_or_default();
        Ok(ListedImage::from(ListedFile { stamp_ns, path: file.into() }))
    };
    table.rows.iter().map(image).collect::<Result<_>>().map(Some)
}
