//! How a folder is laid out, which says where its lists, its calibration and its ground truth are.
//!
//! In: a folder. Out: its frames, before any part is cut out, with paths relative to it.

use std::path::Path;
use std::sync::Arc;

use yfslam::config::DepthSource;

use super::{AssociationReport, FrameEntry, SequenceOptions, TruthReader, euroc, kitti, tum};
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
            Self::Tum => tum::list(folder, options),
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

/// Refuses a folder that does not have the images that were asked for.
pub fn lacks(folder: &Path, wanted: DepthSource) -> Error {
    let what = if wanted == DepthSource::Stereo { "right pictures" } else { "depth images" };
    Error::content(folder, format!("has no {what}"), "name what it has: --sensor rgbd, stereo or mono")
}
