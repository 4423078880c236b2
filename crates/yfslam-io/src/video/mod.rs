//! Videos: files such as MP4, whose frames the programs `ffmpeg` and `ffprobe` decode.
//!
//! ```text
//! file ──ffprobe──► times of all frames, without decoding them
//!      ──ffmpeg───► pixels through a pipe, and the time of each frame, by which it is found in the list
//! ```
//!
//! One process decodes, from the first frame on; it waits while its frames are not needed, so that memory does not grow with the length of
//! the video, and ends when the [`Video`] is dropped. Reading an earlier frame starts it anew.

mod decoder;
mod frame_ref;
mod probe;

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::decode::ImageSize;
use crate::error::{Error, Result};
use decoder::Decoder;
pub use frame_ref::VideoFrame;
use probe::Probe;

/// Extensions of the files of videos.
const EXTENSIONS: [&str; 19] = [
    "mp4", "m4v", "mov", "mkv", "webm", "avi", "mpg", "mpeg", "ts", "mts", "m2ts", "wmv", "3gp", "flv", "ogv", "mxf",
    "y4m", "h264", "hevc",
];

/// What to do without the programs.
const INSTALL: &str = "install them (Debian, Ubuntu: apt install ffmpeg; macOS: brew install ffmpeg; Windows: winget install ffmpeg), or extract \
     the frames elsewhere (ffmpeg -i VIDEO FOLDER/%06d.png) and give --color FOLDER --sensor mono --fps N";

/// Returns whether `path` is a file that is named like a video.
pub fn is_video(path: &Path) -> bool {
    let named = |extension: &str| EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known));
    path.extension().and_then(|extension| extension.to_str()).is_some_and(named) && path.is_file()
}

/// A video that is open for reading.
#[derive(Debug)]
pub struct Video {
    path: PathBuf,
    probe: Probe,
    decoder: Mutex<Option<Decoder>>,
}

impl Video {
    /// Lists the frames of a video without decoding them.
    ///
    /// # Errors
    /// `ffmpeg` or `ffprobe` is not installed, or the file is no video.
    pub fn open(path: &Path) -> Result<Self> {
        if !path.is_file() {
            let source = std::io::Error::other("not a regular file");
            return Err(Error::read(path, source));
        }
        Ok(Self { path: path.into(), probe: Probe::of(path)?, decoder: Mutex::default() })
    }

    /// Returns the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of frames.
    pub fn frames(&self) -> usize {
        self.probe.frames
    }

    /// Returns the times of the frames, ns; `None` if the file does not have them.
    pub fn stamps_ns(&self) -> Option<Vec<i64>> {
        self.probe.stamps_ns()
    }

    /// Reads a frame into `pixels` as red, green and blue bytes, and drops their old content.
    ///
    /// # Errors
    /// `ffmpeg` ends before this frame, or does not decode it.
    pub fn read(&self, frame: usize, pixels: &mut Vec<u8>) -> Result<ImageSize> {
        let mut decoder = self.decoder.lock().unwrap_or_else(PoisonError::into_inner);
        if decoder.as_ref().is_none_or(|running| !running.can_read(frame)) {
            // The old process ends first.
            *decoder = None;
            *decoder = Some(Decoder::start(&self.path, &self.probe)?);
        }
        let Some(running) = decoder.as_mut() else { return Err(Error::content(&self.path, "is not read", INSTALL)) };
        running.read(&self.path, &self.probe, frame, pixels)
    }
}
