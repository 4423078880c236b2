//! How a folder is laid out, which says where its lists, its calibration and its ground truth are.
//!
//! In: a folder. Out: its frames, before any part is cut out, with paths relative to it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use yfslam::config::DepthSource;

use super::pairs::{List, from_associations, from_lists};
use super::{AssociationReport, FrameEntry, SequenceOptions, TruthReader, euroc, kitti};
use crate::camera::CameraSource;
use crate::error::{Error, Result};
use crate::rectify::StereoRectification;

/// How a recorded sequence is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// The TUM RGB-D benchmark (Sturm et al., IROS 2012): `rgb.txt` with `depth.txt` or, from a stereo camera, `right.txt`.
    Tum,
    /// The EuRoC MAV data set in ASL format (Burri et al., IJRR 2016): `mav0/cam0/data.csv` and so on; pictures are not rectified.
    Euroc,
    /// The KITTI odometry benchmark (Geiger et al., CVPR 2012): `times.txt`, `calib.txt`, `image_2/` or `image_0/`.
    Kitti,
}

/// The calibration that a layout brings along.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The camera of the frames, after rectification.
    pub camera: CameraSource,
    /// How the pictures are rectified, where they are not yet.
    pub rectification: Option<Arc<StereoRectification>>,
}

/// What a folder lists.
pub struct Listing {
    pub depth_source: DepthSource,
    pub entries: Vec<FrameEntry>,
    pub report: AssociationReport,
    pub calibration: Option<Calibration>,
    pub truth: TruthReader,
}

impl Layout {
    /// The layout of `folder`; one that is none of the others is taken for TUM's.
    pub fn of(folder: &Path) -> Self {
        if euroc::root(folder).is_some() {
            Self::Euroc
        } else if kitti::is_sequence(folder) {
            Self::Kitti
        } else {
            Self::Tum
        }
    }

    /// Its name, and whose it is.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tum => "TUM RGB-D",
            Self::Euroc => "EuRoC (ASL)",
            Self::Kitti => "KITTI odometry",
        }
    }

    /// Reads the lists of `folder`.
    pub(super) fn list(self, folder: &Path, options: &SequenceOptions) -> Result<Listing> {
        match self {
            Self::Tum => list_tum(folder, options),
            Self::Euroc => euroc::list(folder, options),
            Self::Kitti => kitti::list(folder, options),
        }
    }
}

/// The source of depth that was asked for, or that a stereo benchmark has.
pub fn stereo_or_mono(folder: &Path, options: &SequenceOptions, has_right: bool) -> Result<DepthSource> {
    match options.depth_source {
        Some(DepthSource::Image) => Err(lacks(folder, DepthSource::Image)),
        Some(DepthSource::Stereo) if !has_right => Err(lacks(folder, DepthSource::Stereo)),
        Some(wanted) => Ok(wanted),
        None if has_right => Ok(DepthSource::Stereo),
        None => Err(lacks(folder, DepthSource::Stereo)),
    }
}

fn lacks(folder: &Path, wanted: DepthSource) -> Error {
    let what = if wanted == DepthSource::Stereo { "right pictures" } else { "depth images" };
    Error::content(folder, format!("has no {what}"), "name what it has: --sensor rgbd, stereo or mono")
}

fn list_tum(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let has = |name: &str| folder.join(name).is_file();
    let (associations, depth, right) = (has("associations.txt"), has("depth.txt"), has("right.txt"));
    let wanted = options.depth_source.unwrap_or(match associations || depth || !right {
        true => DepthSource::Image,
        false => DepthSource::Stereo,
    });
    let read = |name: &str| List::read(folder.join(name));
    let paired = |companions: &str| {
        if !has("rgb.txt") || !has(companions) {
            return Err(match options.depth_source.filter(|_| has("rgb.txt")) {
                Some(wanted) => lacks(folder, wanted),
                None => no_lists(folder, &["rgb.txt", companions]),
            });
        }
        from_lists(folder, read("rgb.txt")?, Some(read(companions)?), options.association_tolerance_ns)
    };
    let (entries, report) = match wanted {
        DepthSource::Image if associations => from_associations(&folder.join("associations.txt"))?,
        DepthSource::Image => paired("depth.txt")?,
        DepthSource::Stereo => paired("right.txt")?,
        DepthSource::Motion if has("rgb.txt") => from_lists(folder, read("rgb.txt")?, None, 0)?,
        DepthSource::Motion if associations => {
            let (mut entries, report) = from_associations(&folder.join("associations.txt"))?;
            entries.iter_mut().for_each(|entry| entry.companion = None);
            (entries, report)
        }
        DepthSource::Motion => return Err(no_lists(folder, &["rgb.txt"])),
    };
    let truth = TruthReader::tum(folder.join("groundtruth.txt"));
    Ok(Listing { depth_source: wanted, entries, report, calibration: None, truth })
}

/// Says which lists are missing and, where it can, which folder was meant.
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
