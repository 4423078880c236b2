//! Frames decoded ahead of their use: one thread for colour, one for depth, both held back by a bounded channel.
//!
//! In: the entries of a [`Sequence`] and its camera. Out: an iterator of frames, in order; a frame that cannot be used comes as a
//! [`FrameError`]. Dropping the stream ends the threads.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use yfslam::image::{DepthImage, RgbImage};
use yfslam::{Camera, RgbdFrame};

use crate::decode::{DecodeError, ImageSize, decode_color, decode_depth};
use crate::error::{Error, Result};
use crate::sequence::{FrameEntry, Sequence};
use crate::text::read_bytes;
use crate::time::format_stamp;

/// Images that wait decoded for the caller unless told otherwise; each thread holds one more in its hands. A 640×480 frame takes 1.5 MB.
pub const DEFAULT_LOOK_AHEAD: usize = 4;

/// A frame that cannot be used; the caller counts it and goes on.
#[derive(Debug, thiserror::Error)]
#[error("frame {index} (t = {}): {fault}", format_stamp(*timestamp_ns))]
pub struct FrameError {
    /// Index into [`Sequence::entries`].
    pub index: usize,
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// What is wrong.
    pub fault: FrameFault,
}

/// What is wrong with a frame.
#[derive(Debug, thiserror::Error)]
pub enum FrameFault {
    /// A file is missing or cannot be read.
    #[error(transparent)]
    Unreadable(Error),
    /// A file is not the image that is needed.
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
    /// A decoder thread ended early, which is a defect of the decoder.
    #[error("the decoder stopped; please report this sequence as a defect")]
    DecoderStopped,
}

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
            Ok((color, depth)) => Ok(RgbdFrame { timestamp_ns, color, depth, detections: None }),
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

/// One image as its thread hands it over.
struct Decoded<T> {
    image: std::result::Result<Arc<T>, FrameFault>,
    took: Duration,
}

/// A thread that decodes one kind of image, in order.
struct Lane<T> {
    /// `None` only while dropping.
    images: Option<Receiver<Decoded<T>>>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + Sync + 'static> Lane<T> {
    fn start(
        name: &str,
        entries: Arc<[FrameEntry]>,
        look_ahead: usize,
        mut decode: impl FnMut(&FrameEntry) -> std::result::Result<T, FrameFault> + Send + 'static,
    ) -> Result<Self> {
        let (sender, images) = sync_channel(look_ahead);
        let run = move || {
            for entry in entries.iter() {
                let started = Instant::now();
                let image = decode(entry).map(Arc::new);
                // The receiver is gone: the stream was dropped.
                if sender.send(Decoded { image, took: started.elapsed() }).is_err() {
                    return;
                }
            }
        };
        let thread = Builder::new().name(name.into()).spawn(run).map_err(|error| {
            Error::argument(
                format!("cannot start a decoder thread: {error}"),
                "raise the limit of threads of this user",
            )
        })?;
        Ok(Self { images: Some(images), thread: Some(thread) })
    }

    fn next(&mut self) -> Decoded<T> {
        let received = self.images.as_ref().and_then(|images| images.recv().ok());
        received.unwrap_or(Decoded { image: Err(FrameFault::DecoderStopped), took: Duration::ZERO })
    }
}

impl<T> Drop for Lane<T> {
    fn drop(&mut self) {
        self.images = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the decoder has been reported as `DecoderStopped` already.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn entries(count: i64) -> Arc<[FrameEntry]> {
        let entry =
            |t| FrameEntry { timestamp_ns: t, color_path: "c".into(), depth_timestamp_ns: t, depth_path: "d".into() };
        (0..count).map(entry).collect()
    }

    #[test]
    fn no_more_is_decoded_than_the_look_ahead_allows_and_a_drop_ends_the_thread() {
        let decoded = Arc::new(AtomicUsize::new(0));
        let count = decoded.clone();
        let mut lane = Lane::start("test", entries(1000), 3, move |entry| {
            count.fetch_add(1, Ordering::SeqCst);
            Ok(entry.timestamp_ns)
        })
        .unwrap();
        for expected in 0..10 {
            assert_eq!(*lane.next().image.unwrap(), expected);
        }
        // Ten taken, three waiting, one in the hands of the thread.
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(decoded.load(Ordering::SeqCst), 14);
        drop(lane);
        assert_eq!(Arc::strong_count(&decoded), 1, "the thread and its decoder are gone");
    }

    #[test]
    fn a_panic_of_a_decoder_becomes_a_fault_of_every_frame_left() {
        let mut lane = Lane::start("test", entries(3), 1, |entry| match entry.timestamp_ns {
            0 => Ok(()),
            _ => panic!("a defect of the decoder"),
        })
        .unwrap();
        assert!(lane.next().image.is_ok());
        assert!(matches!(lane.next().image, Err(FrameFault::DecoderStopped)));
        assert!(matches!(lane.next().image, Err(FrameFault::DecoderStopped)));
    }
}
