//! Pairs the images of the lists of a folder and counts those that are skipped.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::associate::associate;
use super::lists::{ListedFile, color_is_second, names_depth, parse_file_list, parse_pair_list};
use super::{AssociationReport, FrameEntry, ListedImage};
use crate::error::{Error, Result};
use crate::text::read_text;
use crate::time::format_stamp;
use crate::timestamp_order::keep_ascending;

/// Reads the pairs of an `associations.txt`, colour and depth; the paths are relative to its folder.
pub fn from_associations(path: &Path) -> Result<(Vec<FrameEntry>, AssociationReport)> {
    let (pairs, unstamped_skipped) = parse_pair_list(&read_text(path)?, path)?;
    // Where the names do not decide, colour comes first, as is customary.
    let swapped = color_is_second(&pairs).unwrap_or(false);
    let listed = pairs.len() + unstamped_skipped;
    let entry = |[a, b]: [ListedFile; 2]| {
        if swapped { frame_entry(b.into(), a.into()) } else { frame_entry(a.into(), b.into()) }
    };
    let all: Vec<FrameEntry> = pairs.into_iter().map(entry).collect();
    let mut report = AssociationReport {
        from_associations_file: true,
        color_listed: listed,
        paired_images_listed: listed,
        unstamped_skipped,
        ..Default::default()
    };
    let kept = in_order(all, |e| e.timestamp_ns, path, &mut report)?;
    let ascending = kept.len();
    let mut depth_seen = HashSet::new();
    let mut is_first = |depth: &ListedImage| depth.image.file().is_none_or(|path| depth_seen.insert(path.to_owned()));
    let is_new = |e: &FrameEntry| e.paired_image.as_ref().is_none_or(&mut is_first);
    let entries: Vec<_> = kept.into_iter().filter(is_new).collect();
    report.duplicates_skipped += ascending - entries.len();
    Ok((entries, report))
}

/// A list of images: its entries, the number of lines without a time, and its path.
pub struct List {
    pub images: Vec<ListedImage>,
    pub unstamped: usize,
    pub path: PathBuf,
}

impl List {
    /// Reads a list of the TUM benchmark; the paths are relative to its folder.
    pub fn read(path: PathBuf) -> Result<Self> {
        let (files, unstamped) = parse_file_list(&read_text(&path)?, &path)?;
        Ok(Self { images: files.into_iter().map(ListedImage::from).collect(), unstamped, path })
    }

    /// Returns the entries whose stamps ascend and counts all others in `report`.
    fn in_order(self, report: &mut AssociationReport) -> Result<Vec<ListedImage>> {
        report.unstamped_skipped += self.unstamped;
        in_order(self.images, |image| image.stamp_ns, &self.path, report)
    }
}

/// Pairs the images of two lists by time; without a second list each image is a frame by itself.
pub fn from_lists(
    folder: &Path,
    color: List,
    paired: Option<List>,
    tolerance_ns: i64,
) -> Result<(Vec<FrameEntry>, AssociationReport)> {
    let listed = |list: &List| list.images.len() + list.unstamped;
    let mut report = AssociationReport {
        color_listed: listed(&color),
        paired_images_listed: paired.as_ref().map_or(0, listed),
        ..Default::default()
    };
    let color = color.in_order(&mut report)?;
    let Some(paired) = paired else {
        let alone =
            |color: ListedImage| FrameEntry { timestamp_ns: color.stamp_ns, color: color.image, paired_image: None };
        return Ok((color.into_iter().map(alone).collect(), report));
    };
    let what = if paired.path.file_name().is_some_and(|name| names_depth(name.as_ref()) == Some(true)) {
        "depth image"
    } else {
        "right image"
    };
    let paired = paired.in_order(&mut report)?;
    let stamps = |images: &[ListedImage]| images.iter().map(|image| image.stamp_ns).collect::<Vec<_>>();
    let pairs = associate(&stamps(&color), &stamps(&paired), tolerance_ns);
    if pairs.is_empty() {
        let first = |images: &[ListedImage]| images.first().map_or(String::new(), |image| format_stamp(image.stamp_ns));
        let tolerance_ms = tolerance_ns as f64 * 1e-6;
        let problem = format!(
            "no colour image has a {what} within {tolerance_ms:.1} ms; the first stamps are {} and {}",
            first(&color),
            first(&paired)
        );
        return Err(Error::content(
            folder,
            problem,
            "check that both lists use the same clock, or allow a larger tolerance",
        ));
    }
    report.color_unmatched = color.len() - pairs.len();
    report.paired_images_unmatched = paired.len() - pairs.len();
    Ok((pairs.into_iter().map(|(c, d)| frame_entry(color[c].clone(), paired[d].clone())).collect(), report))
}

/// Refuses an empty list; drops the entries whose stamps do not ascend and counts them.
fn in_order<T>(
    items: Vec<T>,
    stamp: impl Fn(&T) -> i64,
    path: &Path,
    report: &mut AssociationReport,
) -> Result<Vec<T>> {
    if items.is_empty() {
        return Err(Error::content(path, "lists no image with a time stamp", "record or unpack the sequence again"));
    }
    let kept = keep_ascending(items, stamp, path)?;
    report.duplicates_skipped += kept.duplicates;
    report.backward_skipped += kept.backward;
    Ok(kept.items)
}

fn frame_entry(color: ListedImage, paired: ListedImage) -> FrameEntry {
    FrameEntry { timestamp_ns: color.stamp_ns, color: color.image, paired_image: Some(paired) }
}
