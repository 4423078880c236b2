//! Where an image of a recording is stored: in a file of its own, in a message of a bag, or in a video.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::bag::MessageRef;
use crate::error::{Error, Result};
use crate::sequence::lists::ListedFile;
use crate::text::read_bytes;
use crate::video::VideoFrame;

/// Where an image is stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ImageRef {
    /// An image file, such as PNG or JPEG.
    File(PathBuf),
    /// A message of a bag.
    Message(MessageRef),
    /// A frame of a video.
    Video(VideoFrame),
}

/// An image and its time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ListedImage {
    /// Time stamp, ns.
    pub stamp_ns: i64,
    /// Where it is stored.
    pub image: ImageRef,
}

impl ImageRef {
    /// Returns the path of the image file; `None` for a message or a frame of a video.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Message(_) | Self::Video(_) => None,
        }
    }

    /// Replaces the path of an image file.
    pub(super) fn map_file(&mut self, map: impl Fn(&Path) -> PathBuf) {
        if let Self::File(path) = self {
            *path = map(path);
        }
    }

    /// Returns whether it is a file that does not exist.
    pub(super) fn is_missing(&self) -> bool {
        self.file().is_some_and(|path| !path.is_file())
    }

    /// Reads the file, the message, or the pixels of a frame of a video into `bytes` and drops their old content.
    ///
    /// # Errors
    /// The file or the bag cannot be read, or the message or frame is damaged.
    pub fn read(&self, bytes: &mut Vec<u8>) -> Result<()> {
        match self {
            Self::File(path) => read_bytes(path, bytes).map_err(|source| Error::read(path, source)),
            Self::Message(message) => message.read(bytes),
            Self::Video(frame) => frame.read(bytes).map(|_| ()),
        }
    }
}

impl fmt::Display for ImageRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Message(message) => message.fmt(f),
            Self::Video(frame) => frame.fmt(f),
        }
    }
}

impl From<PathBuf> for ImageRef {
    fn from(path: PathBuf) -> Self {
        Self::File(path)
    }
}

impl From<ListedFile> for ListedImage {
    fn from(file: ListedFile) -> Self {
        Self { stamp_ns: file.stamp_ns, image: file.path.into() }
    }
}
