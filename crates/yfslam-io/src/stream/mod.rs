//! Frames decoded ahead of their use: one thread for colour, one for depth, both held back by a bounded channel.
//!
//! In: the entries of a [`Sequence`] and its camera. Out: an iterator of frames, in order; a frame that cannot be used comes as a
//! [`FrameError`]. Dropping the stream ends the threads.

mod fault;
mod lane;

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use yfslam::image::{DepthImage, RgbImage};
use yfslam::{Camera, RgbdFrame};

use crate::decode::{DecodeError, ImageSize, decode_color, decode_depth};
use crate::error::{Error, Result};
use crate::sequence::{FrameEntry, Sequence};
use crate::text::read_bytes;
pub use fault::{FrameError, FrameFault};
use lane::Lane;

/// Images that wait decoded for the caller unless told otherwise; each thread holds one more in its hands.
/// A 640×480 frame takes 1.5 MB.
pub const DEFAULT_LOOK_AHEAD: usize = 4;

/// Time spent on images so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecodeTimes {
    /// Reading and decoding colour images, on their thread.
    pub color: Duration,
    /// Reading and decoding depth images, on their thread.
    pub depth: Duration,
    /// What the caller of the iterator waited.
    pub waited: Duration,
}

/// The frames of a sequence, decoded a few frames ahead.
pub struct FrameStream {
    entries: Arc<[FrameEntry]>,
    next: usize,
    color: Lane<RgbImage>,
    depth: Lane<DepthImage>,
    times: DecodeTimes,
}

impl FrameStream {
    /// Starts to decode `sequence`; up to `look_ahead` frames wait for the caller.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn open(sequence: &Sequence, camera: &Camera, look_ahead: usize) -> Result<Self> {
        let entries: Arc<[FrameEntry]> = sequence.entries.as_slice().into();
        let size = ImageSize { width: camera.width, height: camera.height };
        let metres_per_unit = (1.0 / camera.depth_factor) as f32;
        let mut bytes = Vec::new();
        let color = Lane::start("yfslam-color", entries.clone(), look_ahead, move |entry| {
            let mut image = RgbImage::default();
            read(&entry.color_path, &mut bytes)?;
            decode_color(&bytes, Some(size), &mut image).map_err(|error| image_fault(&entry.color_path, error))?;
            Ok(image)
        })?;
        let mut bytes = Vec::new();
        let depth = Lane::start("yfslam-depth", entries.clone(), look_ahead, move |entry| {
            let mut image = DepthImage { metres_per_unit, ..Default::default() };
            read(&entry.depth_path, &mut bytes)?;
            decode_depth(&bytes, Some(size), &mut image.raw).map_err(|error| image_fault(&entry.depth_path, error))?;
            if image.raw.data().iter().all(|&raw| raw == 0) {
                return Err(FrameFault::NoDepth { path: entry.depth_path.clone() });
            }
            Ok(image)
        })?;
        Ok(Self { entries, next: 0, color, depth, times: DecodeTimes::default() })
    }

    /// Time spent on the frames delivered so far.
    pub fn times(&self) -> DecodeTimes {
        self.times
    }
}

impl Iterator for FrameStream {
    type Item = std::result::Result<RgbdFrame, FrameError>;

    fn next(&mut self) -> Option<Self::Item> {
        let index = self.next;
        let entry = self.entries.get(index)?;
        let timestamp_ns = entry.timestamp_ns;
        self.next += 1;
        let asked = Instant::now();
        let (color, depth) = (self.color.next(), self.depth.next());
        self.times.waited += asked.elapsed();
        self.times.color += color.took;
        self.times.depth += depth.took;
        let frame = color.image.and_then(|color| Ok((color, depth.image?)));
        Some(match frame {
            Ok((color, depth)) => {
                Ok(RgbdFrame { timestamp_ns, color, depth, right: None, detections: None, mask: None })
            }
            Err(fault) => Err(FrameError { index, timestamp_ns, fault }),
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.entries.len() - self.next;
        (left, Some(left))
    }
}

impl ExactSizeIterator for FrameStream {}

fn read(path: &Path, bytes: &mut Vec<u8>) -> std::result::Result<(), FrameFault> {
    read_bytes(path, bytes).map_err(|source| FrameFault::Unreadable(Error::read(path, source)))
}

fn image_fault(path: &Path, source: DecodeError) -> FrameFault {
    FrameFault::Image { path: path.into(), source }
}
