//! From the lists of a folder to pairs of images, with a count of what is left out.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::associate::associate;
use super::lists::{ListedFile, color_is_second, parse_file_list, parse_pair_list};
use super::{AssociationReport, FrameEntry};
use crate::ascending::keep_ascending;
use crate::error::{Error, Result};
use crate::text::read_text;
use crate::time::format_stamp;

/// Takes the pairs of an `associations.txt`; the paths are still relative to its folder.
pub fn from_associations(path: &Path) -> Result<(Vec<FrameEntry>, AssociationReport)> {
    let (pairs, unstamped_skipped) = parse_pair_list(&read_text(path)?, path)?;
    // Names decide; where they are silent the customary order holds: colour first.
    let swapped = color_is_second(&pairs).unwrap_or(false);
    let listed = pairs.len() + unstamped_skipped;
    let entry = |[a, b]: [ListedFile; 2]| if swapped { frame_entry(b, a) } else { frame_entry(a, b) };
    let all: Vec<FrameEntry> = pairs.into_iter().map(entry).collect();
    let mut report = AssociationReport {
        from_associations_file: true,
        color_listed: listed,
        depth_listed: listed,
        unstamped_skipped,
        ..Default::default()
    };
    let kept = in_order(all, |e| e.timestamp_ns, path, &mut report)?;
    let ascending = kept.len();
    let mut depth_seen = BTreeSet::new();
    let entries: Vec<_> = kept.into_iter().filter(|e| depth_seen.insert(e.depth_path.clone())).collect();
    report.duplicates_skipped += ascending - entries.len();
    Ok((entries, report))
}

/// Pairs the images of `rgb.txt` and `depth.txt` by time; the paths are still relative to `folder`.
pub fn from_lists(folder: &Path, tolerance_ns: i64) -> Result<(Vec<FrameEntry>, AssociationReport)> {
    let (color_path, depth_path) = (folder.join("rgb.txt"), folder.join("depth.txt"));
    if !color_path.is_file() || !depth_path.is_file() {
        return Err(no_lists(folder));
    }
    let (color, color_unstamped) = parse_file_list(&read_text(&color_path)?, &color_path)?;
    let (depth, depth_unstamped) = parse_file_list(&read_text(&depth_path)?, &depth_path)?;
    let mut report = AssociationReport {
        color_listed: color.len() + color_unstamped,
        depth_listed: depth.len() + depth_unstamped,
        unstamped_skipped: color_unstamped + depth_unstamped,
        ..Default::default()
    };
    let color = in_order(color, |f| f.stamp_ns, &color_path, &mut report)?;
    let depth = in_order(depth, |f| f.stamp_ns, &depth_path, &mut report)?;
    let stamps = |files: &[ListedFile]| files.iter().map(|f| f.stamp_ns).collect::<Vec<_>>();
    let pairs = associate(&stamps(&color), &stamps(&depth), tolerance_ns);
    if pairs.is_empty() {
        let first = |files: &[ListedFile]| files.first().map_or(String::new(), |file| format_stamp(file.stamp_ns));
        let tolerance_ms = tolerance_ns as f64 * 1e-6;
        let problem = format!(
            "no colour image has a depth image within {tolerance_ms:.1} ms; the first stamps are {} and {}",
            first(&color),
            first(&depth)
        );
        return Err(Error::content(
            folder,
            problem,
            "check that both lists use the same clock, or allow a larger tolerance",
        ));
    }
    report.color_unmatched = color.len() - pairs.len();
    report.depth_unmatched = depth.len() - pairs.len();
    Ok((pairs.into_iter().map(|(c, d)| frame_entry(color[c].clone(), depth[d].clone())).collect(), report))
}

/// Refuses an empty list, drops what does not ascend in time and counts it.
fn in_order<T>(
    items: Vec<T>,
    stamp: impl Fn(&T) -> i64,
    path: &Path,
    report: &mut AssociationReport,
) -> Result<Vec<T>> {
    if items.is_empty() {
        return Err(Error::content(
            path,
            "lists no image that has a time stamp",
            "record or unpack the sequence again",
        ));
    }
    let kept = keep_ascending(items, stamp, path)?;
    report.duplicates_skipped += kept.duplicates;
    report.backward_skipped += kept.backward;
    Ok(kept.items)
}

fn frame_entry(color: ListedFile, depth: ListedFile) -> FrameEntry {
    FrameEntry {
        timestamp_ns: color.stamp_ns,
        color_path: color.path,
        depth_timestamp_ns: depth.stamp_ns,
        depth_path: depth.path,
    }
}

/// Says which lists are missing and, where it can, which folder was meant.
fn no_lists(folder: &Path) -> Error {
    if folder.is_file() {
        return Error::content(
            folder,
            "is a file, not a folder",
            "unpack the archive and name the folder that holds rgb.txt",
        );
    }
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(source) => return Error::read(folder, source),
    };
    let holds_lists = |path: &PathBuf| path.join("rgb.txt").is_file() || path.join("associations.txt").is_file();
    let nested = entries.flatten().map(|entry| entry.path()).filter(holds_lists).min();
    let missing: Vec<_> = ["rgb.txt", "depth.txt"].into_iter().filter(|name| !folder.join(name).is_file()).collect();
    let problem = format!("holds no {} and no associations.txt", missing.join(", no "));
    let cure = match nested {
        Some(path) => format!("did you mean {}?", path.display()),
        None => "name a folder in TUM RGB-D layout: rgb.txt and depth.txt, or associations.txt".into(),
    };
    Error::content(folder, problem, cure)
}
