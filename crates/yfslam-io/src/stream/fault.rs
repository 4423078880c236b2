//! Reasons why a frame cannot be used.

use std::path::PathBuf;

use crate::decode::DecodeError;
use crate::error::Error;
use crate::time::format_stamp;

/// A frame that cannot be used; the caller counts it and continues.
#[derive(Debug, thiserror::Error)]
#[error("frame {index} (t = {}): {fault}", format_stamp(*timestamp_ns))]
pub struct FrameError {
    /// Index into [`Sequence::entries`](crate::Sequence::entries).
    pub index: usize,
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// What is wrong with the frame.
    pub fault: FrameFault,
}

/// What is wrong with a frame.
#[derive(Debug, thiserror::Error)]
pub enum FrameFault {
    /// A file is missing or cannot be read.
    #[error(transparent)]
    Unreadable(Error),
    /// A file cannot be decoded as the image that is needed.
    #[error("{} {source}", path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: DecodeError,
    },
    /// Every pixel of the depth image is 0.
    #[error("{} has no depth in any pixel; check the depth sensor", path.display())]
    NoDepth {
        /// The depth image.
        path: PathBuf,
    },
    /// A decoder thread panicked, which is a defect of the decoder.
    #[error("the decoder stopped; please report this sequence as a defect")]
    DecoderStopped,
}
