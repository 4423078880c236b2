//! A recorded RGB-D sequence: a folder in the layout of the TUM RGB-D benchmark, which the Bonn data set shares.
//!
//! In: the folder and [`SequenceOptions`]. Out: the frames to play, in order, and a report of what was left out and why.

mod associate;
mod info;
pub mod lists;
mod pairs;

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::time::TimeMirror;
pub use info::{ColorDepthOffset, SequenceInfo};
use pairs::{from_associations, from_lists};

/// How a sequence is read and which part of it is played.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SequenceOptions {
    /// Largest difference between the stamps of a colour and a depth image that belong together, ns.
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
        Self { association_tolerance_ns: 20_000_000, start: 0, end: None, reverse: false }
    }
}

/// One colour image and the depth image that belongs to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameEntry {
    /// Time of the colour image, ns; the time of the frame.
    pub timestamp_ns: i64,
    /// The colour image.
    pub color_path: PathBuf,
    /// Time of the depth image, ns.
    pub depth_timestamp_ns: i64,
    /// The depth image.
    pub depth_path: PathBuf,
}

/// What association found, before any part was cut out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AssociationReport {
    /// Whether the pairs come from an `associations.txt`, not from `rgb.txt` and `depth.txt`.
    pub from_associations_file: bool,
    /// Colour images listed.
    pub color_listed: usize,
    /// Depth images listed.
    pub depth_listed: usize,
    /// Pairs found.
    pub paired: usize,
    /// Colour images without a depth image within the tolerance.
    pub color_unmatched: usize,
    /// Depth images without a colour image within the tolerance.
    pub depth_unmatched: usize,
    /// Entries skipped because their stamp (or depth image) had been there already.
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
    /// The frames; stamps ascend strictly.
    pub entries: Vec<FrameEntry>,
    /// What was found and what was left out.
    pub report: AssociationReport,
    /// Set when the sequence is played backward.
    pub mirror: Option<TimeMirror>,
}

impl Sequence {
    /// Reads the lists of `folder`: `associations.txt` if it is there, else `rgb.txt` and `depth.txt`.
    ///
    /// # Errors
    /// A folder without lists, a malformed line, lists without a single pair, no image file at all, or a part beyond the end.
    pub fn open(folder: &Path, options: &SequenceOptions) -> Result<Self> {
        if options.association_tolerance_ns < 0 {
            let problem = format!("association tolerance {} ns is negative", options.association_tolerance_ns);
            return Err(Error::argument(problem, "give a time of 0 or more, such as 20 ms"));
        }
        let associations = folder.join("associations.txt");
        let (mut entries, mut report) = if associations.is_file() {
            from_associations(&associations)?
        } else {
            from_lists(folder, options.association_tolerance_ns)?
        };
        for entry in &mut entries {
            entry.color_path = folder.join(&entry.color_path);
            entry.depth_path = folder.join(&entry.depth_path);
        }
        report.paired = entries.len();
        report.missing_files = entries.iter().filter(|e| !e.color_path.is_file() || !e.depth_path.is_file()).count();
        if let Some(first) = entries.first().filter(|_| report.missing_files == report.paired) {
            let missing = if first.color_path.is_file() { &first.depth_path } else { &first.color_path };
            let problem = format!(
                "none of its {} frames has both image files; the first missing is {}",
                report.paired,
                missing.display()
            );
            return Err(Error::content(folder, problem, "unpack the images beside the lists"));
        }
        let (entries, mirror) = cut(folder, entries, options)?;
        Ok(Self { folder: folder.into(), entries, report, mirror })
    }

    /// The `groundtruth.txt` of the folder, if there is one.
    pub fn groundtruth_path(&self) -> Option<PathBuf> {
        Some(self.folder.join("groundtruth.txt")).filter(|path| path.is_file())
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
            entry.depth_timestamp_ns = mirror.apply(entry.depth_timestamp_ns);
        }
    }
    Ok((entries, mirror))
}
