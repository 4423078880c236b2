//! One frame of an open video.

use std::fmt;
use std::sync::Arc;

use super::Video;
use crate::decode::ImageSize;
use crate::error::Result;

/// One frame of an open video.
#[derive(Clone, Debug)]
pub struct VideoFrame {
    video: Arc<Video>,
    index: usize,
}

impl VideoFrame {
    /// Names the frame with this index, in the order of time.
    pub fn new(video: Arc<Video>, index: usize) -> Self {
        Self { video, index }
    }

    /// Reads the frame into `pixels` as red, green and blue bytes, and drops their old content.
    ///
    /// # Errors
    /// The frame cannot be decoded.
    pub fn read(&self, pixels: &mut Vec<u8>) -> Result<ImageSize> {
        self.video.read(self.index, pixels)
    }
}

impl PartialEq for VideoFrame {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.video, &other.video) && self.index == other.index
    }
}

impl Eq for VideoFrame {}

impl fmt::Display for VideoFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: frame {}", self.video.path().display(), self.index)
    }
}
