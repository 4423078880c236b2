//! A sequence in the layout of the TUM RGB-D benchmark (Sturm et al., IROS 2012), which the Bonn data set shares.
//!
//! In: a folder with `rgb.txt` and `depth.txt` or `right.txt`, or with `associations.txt`. Out: its frames.

use std::path::{Path, PathBuf};

use yfslam::config::DepthSource;

use super::layout::{Listing, missing_images};
use super::lists::parse_pair_list;
use super::pairs::{List, from_associations, from_lists};
use super::{GroundTruthReader, SequenceOptions, images};
use crate::error::{Error, Result};
use crate::text::{content_lines, read_text};

/// Names of text files that are no lists of pairs.
const OTHER_TEXTS: [&str; 7] =
    ["rgb.txt", "depth.txt", "right.txt", "groundtruth.txt", "accelerometer.txt", "imu.txt", "calibration.txt"];

/// Returns which lists of the benchmark `folder` holds.
pub fn lists(folder: &Path) -> Option<String> {
    let has = |name: &str| folder.join(name).is_file();
    if has("associations.txt") {
        return Some("associations.txt".into());
    }
    if has("rgb.txt") {
        let paired = ["depth.txt", "right.txt"].into_iter().find(|name| has(name));
        return Some(paired.map_or("rgb.txt".into(), |paired| format!("rgb.txt and {paired}")));
    }
    pair_lists(folder).first().map(|path| path.file_name().unwrap_or_default().to_string_lossy().into_owned())
}

/// Returns the lists of pairs of any name, such as `association.txt` or `fr3_walking_xyz.txt`.
fn pair_lists(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let is_candidate = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.ends_with(".txt") && !OTHER_TEXTS.contains(&name.as_ref())
    };
    let holds_pairs = |path: &PathBuf| {
        let Ok(text) = read_text(path) else { return false };
        let first: String = content_lines(&text).take(1).map(|(_, line)| line.to_owned()).collect();
        parse_pair_list(&first, path)
            .is_ok_and(|(pairs, _)| pairs.iter().flatten().any(|file| images::is_image(&file.path)))
    };
    let mut lists: Vec<_> =
        entries.flatten().map(|entry| entry.path()).filter(is_candidate).filter(holds_pairs).collect();
    lists.sort();
    lists
}

/// Returns the list of pairs that is read: the one of the user, `associations.txt`, or, without other lists, the only one of another name.
fn pair_list(folder: &Path, options: &SequenceOptions) -> Result<Option<PathBuf>> {
    if let Some(list) = &options.associations {
        let inside = folder.join(list);
        return Ok(Some(if list.is_file() { list.clone() } else { inside }));
    }
    let usual = folder.join("associations.txt");
    if usual.is_file() {
        return Ok(Some(usual));
    }
    if folder.join("rgb.txt").is_file() && ["depth.txt", "right.txt"].iter().any(|name| folder.join(name).is_file()) {
        return Ok(None);
    }
    let mut lists = pair_lists(folder);
    if lists.len() > 1 {
        let names: Vec<_> =
            lists.iter().filter_map(|path| path.file_name()).map(|name| name.to_string_lossy()).collect();
        let problem = format!("holds several lists of pairs: {}", names.join(", "));
        return Err(Error::content(folder, problem, "choose one with --associations FILE"));
    }
    Ok(lists.pop())
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let has = |name: &str| folder.join(name).is_file();
    let (associations, depth, right) = (pair_list(folder, options)?, has("depth.txt"), has("right.txt"));
    let wanted = options.depth_source.unwrap_or(match associations.is_some() || depth || !right {
        true => DepthSource::Image,
        false => DepthSource::Stereo,
    });
    let read = |name: &str| List::read(folder.join(name));
    let paired = |list: &str| {
        if !has("rgb.txt") || !has(list) {
            return Err(match options.depth_source {
                Some(wanted) if has("rgb.txt") => missing_images(folder, wanted),
                None if has("rgb.txt") => color_only(folder),
                _ => no_lists(folder, &["rgb.txt", list]),
            });
        }
        from_lists(folder, read("rgb.txt")?, Some(read(list)?), options.association_tolerance_ns)
    };
    let (entries, report) = match (wanted, &associations) {
        (DepthSource::Image, Some(list)) => from_associations(list)?,
        (DepthSource::Image, None) => paired("depth.txt")?,
        (DepthSource::Stereo, _) => paired("right.txt")?,
        (DepthSource::Motion, _) if has("rgb.txt") && options.associations.is_none() => {
            from_lists(folder, read("rgb.txt")?, None, 0)?
        }
        (DepthSource::Motion, Some(list)) => {
            let (mut entries, report) = from_associations(list)?;
            entries.iter_mut().for_each(|entry| entry.paired_image = None);
            (entries, report)
        }
        (DepthSource::Motion, None) => return Err(no_lists(folder, &["rgb.txt"])),
    };
    let usual = folder.join("associations.txt");
    let other = associations.filter(|list| report.from_associations_file && *list != usual);
    let notes = other.map(|list| format!("the pairs are those of {}", list.display())).into_iter().collect();
    let ground_truth = GroundTruthReader::tum(folder.join("groundtruth.txt"));
    Ok(Listing { depth_source: wanted, entries, report, calibration: None, ground_truth, notes })
}

/// Refuses a folder without depth.
fn color_only(folder: &Path) -> Error {
    let problem = "has colour images (rgb.txt), but no list of depth or right images (depth.txt, right.txt)";
    Error::content(folder, problem, "use the colour images alone with --sensor mono, or add depth.txt: 'stamp file'")
}

/// How to make a folder that can be read.
const HOW_TO: &str = "name a folder in TUM RGB-D layout (rgb.txt and depth.txt or right.txt, or associations.txt), or of another layout: \
    EuRoC (mav0/), KITTI odometry (times.txt, image_0/ or image_2/), ETH3D, ICL-NUIM, OpenLORIS (color.txt, aligned_depth.txt), VSLAM-LAB \
    (rgb.csv), 7-Scenes (frame-000000.color.png), Replica (results/frame000000.jpg), ScanNet (color/, depth/, pose/), color/ and depth/; \
    else name folders of images with --color DIR --depth DIR and their rate with --fps N, or write lists with one line 'stamp file' for \
    each image: rgb.txt and depth.txt";

/// Names the lists that are missing and, if a folder inside has them, that folder.
fn no_lists(folder: &Path, wanted: &[&str]) -> Error {
    if folder.is_file() {
        return Error::content(
            folder,
            "is a file, not a folder",
            "unpack an archive and name the folder that holds the images; a video whose name has an unusual ending is read with --layout video",
        );
    }
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(source) => return Error::read(folder, source),
    };
    let holds_lists = |path: &PathBuf| path.join("rgb.txt").is_file() || path.join("associations.txt").is_file();
    let nested = entries.flatten().map(|entry| entry.path()).filter(holds_lists).min();
    let missing: Vec<_> = wanted.iter().filter(|name| !folder.join(name).is_file()).copied().collect();
    let problem = format!("holds no {} and no associations.txt", missing.join(", no "));
    let cure = match nested {
        Some(path) => format!("did you mean {}?", path.display()),
        None => HOW_TO.into(),
    };
    Error::content(folder, problem, cure)
}
