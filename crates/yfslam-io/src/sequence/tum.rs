//! A sequence in the layout of the TUM RGB-D benchmark (Sturm et al., IROS 2012), which the Bonn data set shares.
//!
//! In: a folder with `rgb.txt` and `depth.txt` or `right.txt`, or with `associations.txt`. Out: its frames.

use std::path::{Path, PathBuf};

use yfslam::config::DepthSource;

use super::layout::{Listing, missing_images};
use super::pairs::{List, from_associations, from_lists};
use super::{GroundTruthReader, SequenceOptions};
use crate::error::{Error, Result};

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let has = |name: &str| folder.join(name).is_file();
    let (associations, depth, right) = (has("associations.txt"), has("depth.txt"), has("right.txt"));
    let wanted = options.depth_source.unwrap_or(match associations || depth || !right {
        true => DepthSource::Image,
        false => DepthSource::Stereo,
    });
    let read = |name: &str| List::read(folder.join(name));
    let paired = |list: &str| {
        if !has("rgb.txt") || !has(list) {
            return Err(match options.depth_source.filter(|_| has("rgb.txt")) {
                Some(wanted) => missing_images(folder, wanted),
                None => no_lists(folder, &["rgb.txt", list]),
            });
        }
        from_lists(folder, read("rgb.txt")?, Some(read(list)?), options.association_tolerance_ns)
    };
    let (entries, report) = match wanted {
        DepthSource::Image if associations => from_associations(&folder.join("associations.txt"))?,
        DepthSource::Image => paired("depth.txt")?,
        DepthSource::Stereo => paired("right.txt")?,
        DepthSource::Motion if has("rgb.txt") => from_lists(folder, read("rgb.txt")?, None, 0)?,
        DepthSource::Motion if associations => {
            let (mut entries, report) = from_associations(&folder.join("associations.txt"))?;
            entries.iter_mut().for_each(|entry| entry.paired_image = None);
            (entries, report)
        }
        DepthSource::Motion => return Err(no_lists(folder, &["rgb.txt"])),
    };
    let ground_truth = GroundTruthReader::tum(folder.join("groundtruth.txt"));
    Ok(Listing { depth_source: wanted, entries, report, calibration: None, ground_truth, notes: Vec::new() })
}

/// Names the lists that are missing and, if a folder inside has them, that folder.
fn no_lists(folder: &Path, wanted: &[&str]) -> Error {
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
    let missing: Vec<_> = wanted.iter().filter(|name| !folder.join(name).is_file()).copied().collect();
    let problem = format!("holds no {} and no associations.txt", missing.join(", no "));
    let cure = match nested {
        Some(path) => format!("did you mean {}?", path.display()),
        None => "name a folder in TUM RGB-D layout (rgb.txt and depth.txt or right.txt, or associations.txt), in EuRoC layout (mav0/) or in \
             KITTI odometry layout (times.txt, image_0/ or image_2/)"
            .into(),
    };
    Error::content(folder, problem, cure)
}
