//! A recorded sequence: a folder in the layout of a data set, such as TUM RGB-D, EuRoC or ScanNet, or as recorders write it.
//!
//! In: the folder and [`SequenceOptions`]. Out: the frames in order, and a report of what was skipped and why.

mod associate;
mod bag;
mod csv;
mod detect;
mod eth3d;
pub(crate) mod euroc;
mod folders;
mod ground_truth;
mod icl_nuim;
mod image_ref;
mod images;
mod info;
mod intrinsics;
pub(crate) mod kitti;
mod layout;
pub mod lists;
mod matrices;
mod openloris;
mod pairs;
mod replica;
mod scannet;
mod seven_scenes;
mod tum;
mod video;
mod vslam_lab;

use std::path::{Path, PathBuf};

use yfslam::config::DepthSource;

use crate::error::{Error, Result};
use crate::time::TimeMirror;
pub use bag::{TopicChoice, camera_of_topic};
pub use ground_truth::GroundTruthReader;
pub use image_ref::{ImageRef, ListedImage};
pub use info::{SequenceInfo, TimeOffset};
pub use layout::{Calibration, Layout};

/// Options for reading a sequence, and the part of it that is played.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceOptions {
    /// The images that are read; `None` reads those that exist, depth images before right images.
    pub depth_source: Option<DepthSource>,
    /// Largest difference between the stamps of paired images, ns. 20 ms is the default of the TUM RGB-D benchmark. The pairs of an
    /// `associations.txt` are used as they are.
    pub association_tolerance_ns: i64,
    /// First frame to play, counted from 0 after association.
    pub start: usize,
    /// End of the part (exclusive); `None` plays to the end.
    pub end: Option<usize>,
    /// Plays the part backward, with mirrored stamps; see [`TimeMirror`].
    pub reverse: bool,
    /// The layout; `None` detects it.
    pub layout: Option<Layout>,
    /// Frames per second of images without time stamps; `None` takes [`DEFAULT_FPS`].
    pub fps: Option<f64>,
    /// List of pairs that is read instead of the lists in the folder.
    pub associations: Option<PathBuf>,
    /// Folder of the colour images, where there is no list.
    pub color_folder: Option<PathBuf>,
    /// Folder of the depth images, where there is no list.
    pub depth_folder: Option<PathBuf>,
    /// Whether the calibration that is part of a layout is read; a caller with a camera of its own leaves it out.
    pub read_calibration: bool,
    /// Topics of a bag.
    pub topics: TopicChoice,
}

/// Rates that a camera can have, frames per second.
const FPS_RANGE: std::ops::RangeInclusive<f64> = 0.01..=10_000.0;

/// Frames per second of images without time stamps: that of most RGB-D cameras.
pub const DEFAULT_FPS: f64 = 30.0;

impl Default for SequenceOptions {
    fn default() -> Self {
        Self {
            depth_source: None,
            association_tolerance_ns: 20_000_000,
            start: 0,
            end: None,
            reverse: false,
            layout: None,
            fps: None,
            associations: None,
            color_folder: None,
            depth_folder: None,
            read_calibration: true,
            topics: TopicChoice::default(),
        }
    }
}

impl SequenceOptions {
    /// Returns the frames per second of images without time stamps.
    fn fps(&self) -> f64 {
        self.fps.unwrap_or(DEFAULT_FPS)
    }
}

/// The images of one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameEntry {
    /// Time of the colour image and the frame, ns.
    pub timestamp_ns: i64,
    /// The colour image.
    pub color: ImageRef,
    /// The depth image or the right image, depending on [`Sequence::depth_source`]; `None` for a monocular camera.
    pub paired_image: Option<ListedImage>,
}

/// Result of the association, for the whole sequence.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AssociationReport {
    /// Whether the pairs come from an `associations.txt`, not from `rgb.txt` and `depth.txt`.
    pub from_associations_file: bool,
    /// Number of colour images in the list.
    pub color_listed: usize,
    /// Number of depth or right images in the list.
    pub paired_images_listed: usize,
    /// Number of pairs.
    pub paired: usize,
    /// Colour images without a depth or right image within the tolerance.
    pub color_unmatched: usize,
    /// Depth or right images without a colour image within the tolerance.
    pub paired_images_unmatched: usize,
    /// Entries skipped because their stamp or their depth image occurred before.
    pub duplicates_skipped: usize,
    /// Entries skipped because their stamps run backward.
    pub backward_skipped: usize,
    /// Entries skipped because their stamp is `nan`.
    pub unstamped_skipped: usize,
    /// Frames with a file that does not exist; they are played as errors.
    pub missing_files: usize,
}

/// The frames of a recorded sequence, in the order in which they are played.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// The folder.
    pub folder: PathBuf,
    /// Layout of the folder.
    pub layout: Layout,
    /// Source of depth.
    pub depth_source: DepthSource,
    /// The frames; stamps ascend strictly.
    pub entries: Vec<FrameEntry>,
    /// Result of the association.
    pub report: AssociationReport,
    /// Mirror of the time stamps if the sequence is played backward.
    pub mirror: Option<TimeMirror>,
    /// Calibration that is part of the layout; TUM folders have a camera file instead ([`detect_camera`](crate::detect_camera)).
    pub calibration: Option<Calibration>,
    /// Reader of the ground truth.
    pub ground_truth: GroundTruthReader,
    /// File of the calibration that was not read because the caller has a camera of its own.
    pub unread_calibration: Option<PathBuf>,
    /// Why the folder was taken for this layout.
    pub because: String,
    /// What was assumed or changed when the sequence was read, one sentence each.
    pub notes: Vec<String>,
}

impl Sequence {
    /// Reads the lists of `folder`. In TUM layout: `associations.txt` if it exists, else `rgb.txt` with `depth.txt` or `right.txt`.
    ///
    /// # Errors
    /// The folder has no lists, a line is malformed, no images can be paired, no image file exists, or the part is empty.
    pub fn open(folder: &Path, options: &SequenceOptions) -> Result<Self> {
        if options.association_tolerance_ns < 0 {
            let problem = format!("association tolerance {} ns is negative", options.association_tolerance_ns);
            return Err(Error::argument(problem, "give a time of 0 or more, such as 20 ms"));
        }
        if let Some(fps) = options.fps.filter(|fps| !FPS_RANGE.contains(fps)) {
            return Err(Error::argument(format!("{fps} frames per second are out of range"), "give a rate such as 30"));
        }
        let (layout, because) = detect::layout(folder, options);
        let layout::Listing { depth_source, mut entries, mut report, calibration, ground_truth, notes } =
            layout.list(folder, options)?;
        for entry in &mut entries {
            entry.color.map_file(|path| folder.join(path));
            if let Some(paired) = &mut entry.paired_image {
                paired.image.map_file(|path| folder.join(path));
            }
        }
        report.paired = entries.len();
        report.missing_files = entries.iter().filter(|entry| entry.missing().is_some()).count();
        if let Some(first) = entries.first().filter(|_| report.missing_files == report.paired) {
            let missing = first.missing().unwrap_or(&first.color);
            let problem =
                format!("none of its {} frames has all its image files; the first missing is {missing}", report.paired);
            return Err(Error::content(folder, problem, "unpack the images beside the lists"));
        }
        let unread_calibration = layout.calibration_file(folder).filter(|_| !options.read_calibration);
        let (entries, mirror) = cut(folder, entries, options)?;
        let folder = folder.into();
        Ok(Self {
            unread_calibration,
            folder,
            layout,
            depth_source,
            entries,
            report,
            mirror,
            calibration,
            ground_truth,
            because,
            notes,
        })
    }
}

/// The topics of a bag that are in use.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct UsedTopics {
    /// Topic of the colour or left images.
    pub color: String,
    /// Topic of the depth images.
    pub depth: Option<String>,
    /// Topic of the right images.
    pub right: Option<String>,
    /// Topic of the ground truth; with two frames if it is a chain of transforms.
    pub ground_truth: Option<String>,
}

impl Sequence {
    /// Returns the topics that are in use; `None` unless it is a bag.
    pub fn topics(&self) -> Option<UsedTopics> {
        let topic = |image: &ImageRef| match image {
            ImageRef::Message(message) => Some(message.topic().to_owned()),
            ImageRef::File(_) | ImageRef::Video(_) => None,
        };
        let first = self.entries.first()?;
        let paired = first.paired_image.as_ref().and_then(|paired| topic(&paired.image));
        let is_stereo = self.depth_source == DepthSource::Stereo;
        Some(UsedTopics {
            color: topic(&first.color)?,
            depth: paired.clone().filter(|_| !is_stereo),
            right: paired.filter(|_| is_stereo),
            ground_truth: self.ground_truth.topic().map(str::to_owned),
        })
    }
}

impl FrameEntry {
    /// Returns the first of its files that does not exist.
    fn missing(&self) -> Option<&ImageRef> {
        let paired = self.paired_image.iter().map(|paired| &paired.image);
        std::iter::once(&self.color).chain(paired).find(|image| image.is_missing())
    }
}

/// Cuts out `start..end` and reverses it if requested.
fn cut(
    folder: &Path,
    mut entries: Vec<FrameEntry>,
    options: &SequenceOptions,
) -> Result<(Vec<FrameEntry>, Option<TimeMirror>)> {
    let end = options.end.unwrap_or(entries.len()).min(entries.len());
    if options.start >= end {
        let end_text = options.end.map_or("the end".to_owned(), |end| end.to_string());
        let problem =
            format!("the part from frame {} to {end_text} of its {} frames is empty", options.start, entries.len());
        return Err(Error::content(folder, problem, "choose a smaller start or a larger end"));
    }
    entries.truncate(end);
    entries.drain(..options.start);
    let span = entries.first().zip(entries.last()).filter(|_| options.reverse);
    let mirror = span.map(|(first, last)| TimeMirror { first_ns: first.timestamp_ns, last_ns: last.timestamp_ns });
    if let Some(mirror) = mirror {
        entries.reverse();
        for entry in &mut entries {
            entry.timestamp_ns = mirror.apply(entry.timestamp_ns);
            if let Some(paired) = &mut entry.paired_image {
                paired.stamp_ns = mirror.apply(paired.stamp_ns);
            }
        }
    }
    Ok((entries, mirror))
}
