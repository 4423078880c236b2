//! Layouts of sequence folders: where the lists, the calibration and the ground truth are.
//!
//! In: a folder. Out: all its frames, with paths relative to it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use yfslam::config::DepthSource;

use super::{
    AssociationReport, FrameEntry, GroundTruthReader, SequenceOptions, bag, detect, eth3d, euroc, folders, icl_nuim,
    kitti, openloris, replica, scannet, seven_scenes, tum, video, vslam_lab,
};
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
    /// The ETH3D SLAM benchmark (Schöps et al., CVPR 2019): lists as of TUM, and `calibration.txt`.
    Eth3d,
    /// ICL-NUIM (Handa et al., ICRA 2014) in its form for TUM tools: frame numbers as stamps, y up.
    IclNuim,
    /// OpenLORIS-Scene (Shi et al., ICRA 2020): `color.txt` and `aligned_depth.txt`.
    OpenLoris,
    /// VSLAM-LAB (Fontan et al., 2025): `rgb.csv`, `calibration.yaml`, `groundtruth.csv`.
    VslamLab,
    /// 7-Scenes (Shotton et al., CVPR 2013): `frame-000000.color.png`, `.depth.png`, `.pose.txt`.
    SevenScenes,
    /// Replica as published with NICE-SLAM (Zhu et al., CVPR 2022): `results/frame000000.jpg`, `results/depth000000.png`, `traj.txt`.
    Replica,
    /// A scene of ScanNet (Dai et al., CVPR 2017), exported: `color/`, `depth/`, `pose/`, `intrinsic/`.
    ScanNet,
    /// Folders of colour and depth images without lists, as Open3D and RealSense recorders write them, or one folder of images.
    Folders,
    /// A bag of ROS 1, MCAP or rosbag2.
    Bag,
    /// A video of one camera, which `ffmpeg` decodes.
    Video,
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
    pub const ALL: [Self; 13] = [
        Self::Tum,
        Self::Euroc,
        Self::Kitti,
        Self::Eth3d,
        Self::IclNuim,
        Self::OpenLoris,
        Self::VslamLab,
        Self::SevenScenes,
        Self::Replica,
        Self::ScanNet,
        Self::Folders,
        Self::Bag,
        Self::Video,
    ];

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
            Self::Eth3d => "eth3d",
            Self::IclNuim => "icl-nuim",
            Self::OpenLoris => "openloris",
            Self::VslamLab => "vslam-lab",
            Self::SevenScenes => "7scenes",
            Self::Replica => "replica",
            Self::ScanNet => "scannet",
            Self::Folders => "folders",
            Self::Bag => "bag",
            Self::Video => "video",
        }
    }

    /// Returns the name of the layout.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tum => "TUM RGB-D",
            Self::Euroc => "EuRoC (ASL)",
            Self::Kitti => "KITTI odometry",
            Self::Eth3d => "ETH3D SLAM",
            Self::IclNuim => "ICL-NUIM",
            Self::OpenLoris => "OpenLORIS-Scene",
            Self::VslamLab => "VSLAM-LAB",
            Self::SevenScenes => "7-Scenes",
            Self::Replica => "Replica",
            Self::ScanNet => "ScanNet",
            Self::Folders => "folders of images",
            Self::Bag => "bag",
            Self::Video => "video",
        }
    }

    /// Reads the lists of `folder`.
    pub(super) fn list(self, folder: &Path, options: &SequenceOptions) -> Result<Listing> {
        match self {
            Self::Tum => tum::list(folder, options),
            Self::Euroc => euroc::list(folder, options),
            Self::Kitti => kitti::list(folder, options),
            Self::Eth3d => eth3d::list(folder, options),
            Self::IclNuim => icl_nuim::list(folder, options),
            Self::OpenLoris => openloris::list(folder, options),
            Self::VslamLab => vslam_lab::list(folder, options),
            Self::SevenScenes => seven_scenes::list(folder, options),
            Self::Replica => replica::list(folder, options),
            Self::ScanNet => scannet::list(folder, options),
            Self::Folders => folders::list(folder, options),
            Self::Bag => bag::list(folder, options),
            Self::Video => video::list(folder, options),
        }
    }

    /// Returns the calibration file that is part of the layout, if it exists.
    pub(super) fn calibration_file(self, folder: &Path) -> Option<PathBuf> {
        let names: &[&str] = match self {
            Self::Tum | Self::IclNuim | Self::SevenScenes | Self::Bag | Self::Video => &[],
            Self::Euroc => &["mav0/cam0/sensor.yaml", "cam0/sensor.yaml"],
            Self::Kitti => &["calib.txt"],
            Self::Eth3d => &[eth3d::CALIBRATION],
            Self::OpenLoris => &[openloris::CALIBRATION],
            Self::VslamLab => &[vslam_lab::CALIBRATION],
            Self::Replica => &[replica::CAMERA_FILE, "../cam_params.json"],
            Self::ScanNet => &["intrinsic/intrinsic_color.txt", "intrinsic/intrinsic_depth.txt"],
            Self::Folders => &["camera_intrinsic.json", "intrinsic.json"],
        };
        names.iter().map(|name| folder.join(name)).find(|path| path.is_file())
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

/// Chooses the source of depth in a folder of an RGB-D data set.
pub fn rgbd_or_mono(folder: &Path, options: &SequenceOptions) -> Result<DepthSource> {
    match options.depth_source {
        Some(DepthSource::Stereo) => Err(missing_images(folder, DepthSource::Stereo)),
        wanted => Ok(wanted.unwrap_or(DepthSource::Image)),
    }
}

/// Refuses a folder that does not have the images that were asked for.
pub fn missing_images(folder: &Path, wanted: DepthSource) -> Error {
    let what = if wanted == DepthSource::Stereo { "right images" } else { "depth images" };
    Error::content(folder, format!("has no {what}"), "choose the sensor with --sensor rgbd, stereo or mono")
}
