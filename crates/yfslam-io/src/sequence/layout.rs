//! Layouts of sequence folders: where the lists, the calibration and the ground truth are.
//!
//! In: a folder. Out: all its frames, with paths relative to it.

use std::path::Path;
use std::sync::Arc;

use yfslam::config::DepthSource;

use super::{AssociationReport, FrameEntry, GroundTruthReader, SequenceOptions, detect, euroc, folders, kitti, tum};
use crate::camera::CameraSource;
use crate::depth_resampling::DepthResampling;
use crate::error::{Error, Result};
use crate::rectify::StereoRectification;

/// Layout of a recorded sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// The TUM RGB-D benchmark (Sturm et al., IROS 2012): `rgb.txt` with `depth.txt` or, from a stereo camera, `right.txt`.
    Tum,
    /// The EuRoC MAV data set in ASL format (Burri et al., IJRR 2016): `mav0/cam0/data.csv` and so on; images are not rectified.
    Euroc,
    /// The KITTI odometry benchmark (Geiger et al., CVPR 2012): `times.txt`, `calib.txt`, `image_2/` or `image_0/`.
    Kitti,
    /// Folders of colour and depth images without lists, as Open3D and RealSense recorders write them, or one folder of images.
    Folders,
}

/// The calibration that a layout brings along.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The camera of the frames, after rectification.
    pub camera: CameraSource,
    /// Rectification of the images, unless they are rectified already.
    pub rectification: Option<Arc<StereoRectification>>,
    /// Resampling of the depth images to the colour images, unless both have the same size.
    pub depth_resampling: Option<Arc<DepthResampling>>,
}

/// Content of a sequence folder.
pub struct Listing {
    pub depth_source: DepthSource,
    pub entries: Vec<FrameEntry>,
    pub report: AssociationReport,
    pub calibration: Option<Calibration>,
    pub ground_truth: GroundTruthReader,
    /// What was assumed, one sentence each.
    pub notes: Vec<String>,
}

impl Layout {
    /// All layouts.
    pub const ALL: [Self; 4] = [Self::Tum, Self::Euroc, Self::Kitti, Self::Folders];

    /// Detects the layout of `folder`; the default is that of TUM.
    pub fn of(folder: &Path) -> Self {
        detect::layout(folder, &SequenceOptions::default()).0
    }

    /// Returns the short name of the layout, for the command line.
    pub fn key(self) -> &'static str {
        match self {
            Self::Tum => "tum",
            Self::Euroc => "euroc",
            Self::Kitti => "kitti",
            Self::Folders => "folders",
        }
    }

    /// Returns the name of the layout.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tum => "TUM RGB-D",
            Self::Euroc => "EuRoC (ASL)",
            Self::Kitti => "KITTI odometry",
            Self::Folders => "folders of images",
        }
    }

    /// Reads the lists of `folder`.
    pub(super) fn list(self, folder: &Path, options: &SequenceOptions) -> Result<Listing> {
        match self {
            Self::Tum => tum::list(folder, options),
            Self::Euroc => euroc::list(folder, options),
            Self::Kitti => kitti::list(folder, options),
            Self::Folders => folders::list(folder, options),
        }
    }
}

/// Chooses the source of depth in a folder of a stereo benchmark.
pub fn stereo_or_mono(folder: &Path, options: &SequenceOptions, has_right: bool) -> Result<DepthSource> {
    match options.depth_source {
        Some(DepthSource::Image) => Err(missing_images(folder, DepthSource::Image)),
        Some(DepthSource::Stereo) if !has_right => Err(missing_images(folder, DepthSource::Stereo)),
        Some(wanted) => Ok(wanted),
        None if has_right => Ok(DepthSource::Stereo),
        None => Err(missing_images(folder, DepthSource::Stereo)),
    }
}

/// Refuses a folder that does not have the images that were asked for.
pub fn missing_images(folder: &Path, wanted: DepthSource) -> Error {
    let what = if wanted == DepthSource::Stereo { "right images" } else { "depth images" };
    Error::content(folder, format!("has no {what}"), "choose the sensor with --sensor rgbd, stereo or mono")
}
