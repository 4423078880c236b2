//! Frames decoded ahead of their use: one thread for colour, one for depth or right pictures, both held back by a bounded channel.
//!
//! In: the entries of a [`Sequence`] and its camera. Out: an iterator of frames, in order; a frame that cannot be used comes as a
//! [`FrameError`]. Dropping the stream ends the threads.

mod fault;
mod prefetch_queue;

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use yfslam::config::DepthSource;
use yfslam::image::{DepthImage, Image, RgbImage};
use yfslam::{Camera, RgbdFrame};

use crate::decode::{DecodeError, ImageSize, decode_color, decode_depth};
use crate::error::{Error, Result};
use crate::rectify::{Remap, StereoRectification};
use crate::sequence::{FrameEntry, Sequence};
use crate::text::read_bytes;
pub use fault::{FrameError, FrameFault};
use prefetch_queue::{Decoded, Lane};

/// Images that wait decoded for the caller unless told otherwise; each thread holds one more in its hands.
/// A 640×480 frame takes 1.5 MB.
pub const DEFAULT_LOOK_AHEAD: usize = 4;

/// Time spent on images so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecodeTimes {
    /// Reading and decoding colour images, on their thread.
    pub color: Duration,
    /// Reading and decoding depth images or right pictures, on their thread.
    pub companion: Duration,
    /// What the caller of the iterator waited.
    pub waited: Duration,
}

/// The frames of a sequence, decoded a few frames ahead.
pub struct FrameStream {
    entries: Arc<[FrameEntry]>,
    next: usize,
    color: Lane<RgbImage>,
    companions: Companions,
    times: DecodeTimes,
}

/// What comes with the colour images.
enum Companions {
    Depth(Lane<DepthImage>),
    /// Right pictures, and the depth image of a camera that has none.
    Right(Lane<RgbImage>, Arc<DepthImage>),
    None(Arc<DepthImage>),
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
        let rectification = sequence.calibration.as_ref().and_then(|calibration| calibration.rectification.clone());
        let mut read_left = PictureReader { size, bytes: Vec::new(), rectification };
        let mut read_right = PictureReader { bytes: Vec::new(), ..read_left.clone() };
        let color = Lane::start("yfslam-color", entries.clone(), look_ahead, move |entry| {
            read_left.read(&entry.color_path, StereoRectification::left)
        })?;
        let no_depth = || Arc::new(DepthImage { raw: Image::new(size.width, size.height), metres_per_unit });
        let mut bytes = Vec::new();
        let companions = match sequence.depth_source {
            DepthSource::Image => {
                let read = move |entry: &FrameEntry| read_depth(companion(entry), size, metres_per_unit, &mut bytes);
                Companions::Depth(Lane::start("yfslam-depth", entries.clone(), look_ahead, read)?)
            }
            DepthSource::Stereo => {
                let read = move |entry: &FrameEntry| read_right.read(companion(entry), StereoRectification::right);
                Companions::Right(Lane::start("yfslam-right", entries.clone(), look_ahead, read)?, no_depth())
            }
            DepthSource::Motion => Companions::None(no_depth()),
        };
        Ok(Self { entries, next: 0, color, companions, times: DecodeTimes::default() })
    }

    /// What comes with the colour images.
    pub fn companion(&self) -> DepthSource {
        match self.companions {
            Companions::Depth(_) => DepthSource::Image,
            Companions::Right(..) => DepthSource::Stereo,
            Companions::None(_) => DepthSource::Motion,
        }
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
        let color = self.color.next();
        let (companion, took) = self.companions.next();
        self.times.waited += asked.elapsed();
        self.times.color += color.took;
        self.times.companion += took;
        let frame = color.image.and_then(|color| {
            let (depth, right) = companion?;
            Ok(RgbdFrame { timestamp_ns, color, depth, right, detections: None, mask: None })
        });
        Some(frame.map_err(|fault| FrameError { index, timestamp_ns, fault }))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.entries.len() - self.next;
        (left, Some(left))
    }
}

impl ExactSizeIterator for FrameStream {}

/// A depth image, and a right picture if there is one.
type Companion = (Arc<DepthImage>, Option<Arc<RgbImage>>);

impl Companions {
    /// Waits for the next, and says what it took.
    fn next(&mut self) -> (std::result::Result<Companion, FrameFault>, Duration) {
        match self {
            Self::Depth(lane) => {
                let Decoded { image, took } = lane.next();
                (image.map(|depth| (depth, None)), took)
            }
            Self::Right(lane, no_depth) => {
                let Decoded { image, took } = lane.next();
                (image.map(|right| (no_depth.clone(), Some(right))), took)
            }
            Self::None(no_depth) => (Ok((no_depth.clone(), None)), Duration::ZERO),
        }
    }
}

/// Reads colour or grey pictures, and rectifies them where that is due.
#[derive(Clone)]
struct PictureReader {
    size: ImageSize,
    bytes: Vec<u8>,
    rectification: Option<Arc<StereoRectification>>,
}

impl PictureReader {
    fn read(
        &mut self,
        path: &Path,
        side: fn(&StereoRectification) -> &Remap,
    ) -> std::result::Result<RgbImage, FrameFault> {
        let mut image = RgbImage::default();
        read(path, &mut self.bytes)?;
        decode_color(&self.bytes, Some(self.size), &mut image).map_err(|error| image_fault(path, error))?;
        Ok(self.rectification.as_deref().map(|rectification| side(rectification).apply(&image)).unwrap_or(image))
    }
}

fn read_depth(
    path: &Path,
    size: ImageSize,
    metres_per_unit: f32,
    bytes: &mut Vec<u8>,
) -> std::result::Result<DepthImage, FrameFault> {
    let mut image = DepthImage { metres_per_unit, ..Default::default() };
    read(path, bytes)?;
    decode_depth(bytes, Some(size), &mut image.raw).map_err(|error| image_fault(path, error))?;
    if image.raw.data().iter().all(|&raw| raw == 0) {
        return Err(FrameFault::NoDepth { path: path.into() });
    }
    Ok(image)
}

/// The companion's file; where the sequence has none, reading it says so.
fn companion(entry: &FrameEntry) -> &Path {
    entry.companion.as_ref().map_or(Path::new(""), |companion| &companion.path)
}

fn read(path: &Path, bytes: &mut Vec<u8>) -> std::result::Result<(), FrameFault> {
    read_bytes(path, bytes).map_err(|source| FrameFault::Unreadable(Error::read(path, source)))
}

fn image_fault(path: &Path, source: DecodeError) -> FrameFault {
    FrameFault::Image { path: path.into(), source }
}
