//! Reasons why a frame cannot be used.

use crate::decode::DecodeError;
use crate::error::Error;
use crate::sequence::ImageRef;
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
    /// A file or a message is missing or cannot be read.
    #[error(transparent)]
    Unreadable(Error),
    /// A file or a message cannot be decoded as the image that is needed.
    #[error("{image} {source}")]
    Image {
        /// Where it is stored.
        image: ImageRef,
        /// What is wrong with it.
        source: DecodeError,
    },
    /// Every pixel of the depth image is 0.
    #[error("{image} has no depth in any pixel; check the depth sensor")]
    NoDepth {
        /// Where the depth image is stored.
        image: ImageRef,
    },
    /// The frame has no depth or right image, although the sequence has them.
    #[error("has no depth or right image; check the lists of the sequence")]
    NotListed,
    /// A decoder thread panicked, which is a defect of the decoder.
    #[error("the decoder stopped; please report this sequence as a defect")]
    DecoderStopped,
}
