//! A recorded sequence: a folder in the layout of the TUM RGB-D benchmark, which the Bonn data set shares, or one of the stereo
//! benchmarks EuRoC and KITTI.
//!
//! In: the folder and [`SequenceOptions`]. Out: the frames to play, in order, and a report of what was left out and why.

mod associate;
pub(crate) mod euroc;
mod ground_truth;
mod info;
pub(crate) mod kitti;
mod layout;
pub mod lists;
mod pairs;
mod tum;

use std::path::{Path, PathBuf};

use yfslam::config::DepthSource;

use crate::error::{Error, Result};
use crate::time::TimeMirror;
pub use ground_truth::TruthReader;
pub use info::{CompanionOffset, SequenceInfo};
pub use layout::{Calibration, Layout};
use lists::ListedFile;

/// How a sequence is read and which part of it is played.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SequenceOptions {
    /// What is read of the folder; `None` reads what it has, depth before right pictures.
    pub depth_source: Option<DepthSource>,
    /// Largest difference between the stamps of a colour image and its companion, ns.
    /// 20 ms is the default of the TUM RGB-D benchmark. An `associations.txt` is taken at its word.
    pub association_tolerance_ns: i64,
    /// First frame to play, counted from 0 after association.
    pub start: usize,
    /// The frame to stop before; `None` plays to the end.
    pub end: Option<usize>,
    /// Plays the part backward, with mirrored stamps; see [`TimeMirror`].
    pub reverse: bool,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self { depth_source: None, association_tolerance_ns: 20_000_000, start: 0, end: None, reverse: false }
    }
}

/// One colour image and what belongs to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameEntry {
    /// Time of the colour image, ns; the time of the frame.
    pub timestamp_ns: i64,
    /// The colour image.
    pub color_path: PathBuf,
    /// The depth image or the right picture, whichever [`Sequence::depth_source`] says; `None` for a monocular camera.
    pub companion: Option<ListedFile>,
}

/// What association found, before any part was cut out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AssociationReport {
    /// Whether the pairs come from an `associations.txt`, not from `rgb.txt` and `depth.txt`.
    pub from_associations_file: bool,
    /// Colour images listed.
    pub color_listed: usize,
    /// Companions listed: depth images or right pictures.
    pub companions_listed: usize,
    /// Pairs found.
    pub paired: usize,
    /// Colour images without a companion within the tolerance.
    pub color_unmatched: usize,
    /// Companions without a colour image within the tolerance.
    pub companions_unmatched: usize,
    /// Entries skipped because their stamp (or companion) had been there already.
    pub duplicates_skipped: usize,
    /// Entries skipped because their stamps run backward.
    pub backward_skipped: usize,
    /// Entries skipped because their stamp is `nan`.
    pub unstamped_skipped: usize,
    /// Frames of which a file does not exist; they are played as errors.
    pub missing_files: usize,
}

/// The frames of a recorded sequence, in the order in which they are played.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// The folder.
    pub folder: PathBuf,
    /// How it is laid out.
    pub layout: Layout,
    /// Where depth comes from, which is what the companions are.
    pub depth_source: DepthSource,
    /// The frames; stamps ascend strictly.
    pub entries: Vec<FrameEntry>,
    /// What was found and what was left out.
    pub report: AssociationReport,
    /// Set when the sequence is played backward.
    pub mirror: Option<TimeMirror>,
    /// The calibration that a layout brings along; TUM folders have a camera file instead ([`detect_camera`](crate::detect_camera)).
    pub calibration: Option<Calibration>,
    /// Reads its ground truth.
    pub truth: TruthReader,
}

impl Sequence {
    /// Reads the lists of `folder`. In TUM layout: `associations.txt` if it is there, else `rgb.txt` with `depth.txt` or `right.txt`.
    ///
    /// # Errors
    /// A folder without lists, a malformed line, lists without a single pair, no image file at all, or a part beyond the end.
    pub fn open(folder: &Path, options: &SequenceOptions) -> Result<Self> {
        if options.association_tolerance_ns < 0 {
            let problem = format!("association tolerance {} ns is negative", options.association_tolerance_ns);
            return Err(Error::argument(problem, "give a time of 0 or more, such as 20 ms"));
        }
        let layout = Layout::of(folder);
        let layout::Listing { depth_source, mut entries, mut report, calibration, truth } =
            layout.list(folder, options)?;
        for entry in &mut entries {
            entry.color_path = folder.join(&entry.color_path);
            if let Some(companion) = &mut entry.companion {
                companion.path = folder.join(&companion.path);
            }
        }
        report.paired = entries.len();
        report.missing_files = entries.iter().filter(|entry| entry.missing().is_some()).count();
        if let Some(first) = entries.first().filter(|_| report.missing_files == report.paired) {
            let missing = first.missing().unwrap_or(&first.color_path);
            let problem = format!(
                "none of its {} frames has all its image files; the first missing is {}",
                report.paired,
                missing.display()
            );
            return Err(Error::content(folder, problem, "unpack the images beside the lists"));
        }
        let (entries, mirror) = cut(folder, entries, options)?;
        let folder = folder.into();
        Ok(Self { folder, layout, depth_source, entries, report, mirror, calibration, truth })
    }
}

impl FrameEntry {
    /// The first of its files that does not exist.
    fn missing(&self) -> Option<&Path> {
        let companion = self.companion.iter().map(|companion| companion.path.as_path());
        std::iter::once(self.color_path.as_path()).chain(companion).find(|path| !path.is_file())
    }
}

/// Takes `start..end` and turns it round if asked to.
fn cut(
    folder: &Path,
    mut entries: Vec<FrameEntry>,
    options: &SequenceOptions,
) -> Result<(Vec<FrameEntry>, Option<TimeMirror>)> {
    let end = options.end.unwrap_or(entries.len()).min(entries.len());
    if options.start >= end {
        let asked = options.end.map_or("the end".to_owned(), |end| end.to_string());
        let problem = format!("frames {} to {asked} of its {} frames are none", options.start, entries.len());
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
            if let Some(companion) = &mut entry.companion {
                companion.stamp_ns = mirror.apply(companion.stamp_ns);
            }
        }
    }
    Ok((entries, mirror))
}
