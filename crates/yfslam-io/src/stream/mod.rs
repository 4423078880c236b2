//! Decodes frames ahead of their use: one thread for colour images, one for depth or right images, each with a bounded queue.
//!
//! In: the entries of a [`Sequence`] and its camera. Out: an iterator of frames, in order; a frame that cannot be used becomes a
//! [`FrameError`]. Dropping the stream ends the threads.

mod fault;
mod prefetch_queue;

use std::sync::Arc;
use std::time::{Duration, Instant};

use yfslam::config::DepthSource;
use yfslam::{DepthImage, Frame, RgbImage};

use crate::camera::CameraSource;
use crate::decode::{DecodeError, ImageSize, decode_color, decode_depth_image};
use crate::depth_resampling::DepthResampling;
use crate::error::Result;
use crate::message::wire::Wire;
use crate::message::{MessageType, decode_color_message, decode_depth_message};
use crate::rectify::{Remap, StereoRectification};
use crate::sequence::{FrameEntry, ImageRef, Sequence};
pub use fault::{FrameError, FrameFault};
use prefetch_queue::{Decoded, PrefetchQueue};

/// Default number of decoded images in each queue; each thread holds one more. A 640×480 frame takes 1.5 MB.
pub const DEFAULT_LOOK_AHEAD: usize = 4;

/// Time spent on images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecodeTimes {
    /// Reading and decoding colour images on their thread.
    pub color: Duration,
    /// Reading and decoding depth or right images on their thread.
    pub paired_image: Duration,
    /// Waiting of the caller.
    pub waited: Duration,
}

/// The frames of a sequence, decoded a few frames ahead.
pub struct FrameStream {
    entries: Arc<[FrameEntry]>,
    next: usize,
    color: PrefetchQueue<RgbImage>,
    paired_images: PairedImages,
    times: DecodeTimes,
}

/// The images that are paired with the colour images.
enum PairedImages {
    Depth(PrefetchQueue<DepthImage>),
    Right(PrefetchQueue<RgbImage>),
    None,
}

impl FrameStream {
    /// Starts to decode `sequence`; up to `look_ahead` decoded frames wait for the caller.
    ///
    /// # Errors
    /// A thread cannot be started.
    pub fn open(sequence: &Sequence, source: &CameraSource, look_ahead: usize) -> Result<Self> {
        let camera = &source.camera;
        let entries: Arc<[FrameEntry]> = sequence.entries.as_slice().into();
        let size = ImageSize { width: camera.width, height: camera.height };
        let calibration = sequence.calibration.as_ref();
        let own = || calibration.and_then(|calibration| calibration.rectification.clone());
        let rectification = source.rectification.clone().or_else(own);
        let resampling = calibration.and_then(|calibration| calibration.depth_resampling.clone());
        let mut read_left = ColorReader { size, bytes: Vec::new(), rectification };
        let mut read_right = ColorReader { bytes: Vec::new(), ..read_left.clone() };
        let color = PrefetchQueue::start("yfslam-color", entries.clone(), look_ahead, move |entry| {
            read_left.read(Some(&entry.color), StereoRectification::left)
        })?;
        let mut bytes = Vec::new();
        let paired_images = match sequence.depth_source {
            DepthSource::Image => {
                let depth_factor = source.depth_factor;
                let read = move |entry: &FrameEntry| {
                    read_depth(paired(entry), size, depth_factor, resampling.as_deref(), &mut bytes)
                };
                PairedImages::Depth(PrefetchQueue::start("yfslam-depth", entries.clone(), look_ahead, read)?)
            }
            DepthSource::Stereo => {
                let read = move |entry: &FrameEntry| read_right.read(paired(entry), StereoRectification::right);
                PairedImages::Right(PrefetchQueue::start("yfslam-right", entries.clone(), look_ahead, read)?)
            }
            DepthSource::Motion => PairedImages::None,
        };
        Ok(Self { entries, next: 0, color, paired_images, times: DecodeTimes::default() })
    }

    /// Returns the source of depth of the frames.
    pub fn depth_source(&self) -> DepthSource {
        match self.paired_images {
            PairedImages::Depth(_) => DepthSource::Image,
            PairedImages::Right(_) => DepthSource::Stereo,
            PairedImages::None => DepthSource::Motion,
        }
    }

    /// Returns the time spent on the frames delivered so far.
    pub fn times(&self) -> DecodeTimes {
        self.times
    }
}

impl Iterator for FrameStream {
    type Item = std::result::Result<Frame, FrameError>;

    fn next(&mut self) -> Option<Self::Item> {
        let index = self.next;
        let entry = self.entries.get(index)?;
        let timestamp_ns = entry.timestamp_ns;
        self.next += 1;
        let started = Instant::now();
        let color = self.color.next();
        let (paired, took) = self.paired_images.next();
        self.times.waited += started.elapsed();
        self.times.color += color.took;
        self.times.paired_image += took;
        let frame = color.image.and_then(|color| {
            let (depth, right) = paired?;
            let mut frame = Frame::mono(timestamp_ns, color);
            frame.depth_timestamp_ns =
                entry.paired_image.as_ref().filter(|_| depth.is_some()).map(|image| image.stamp_ns);
            (frame.depth, frame.right) = (depth, right);
            Ok(frame)
        });
        Some(frame.map_err(|fault| FrameError { index, timestamp_ns, fault }))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.entries.len() - self.next;
        (left, Some(left))
    }
}

impl ExactSizeIterator for FrameStream {}

/// A depth image, or the right image of a stereo camera.
type DepthAndRight = (Option<Arc<DepthImage>>, Option<Arc<RgbImage>>);

impl PairedImages {
    /// Returns the next image and the time for reading and decoding it; waits until it is decoded.
    fn next(&mut self) -> (std::result::Result<DepthAndRight, FrameFault>, Duration) {
        match self {
            Self::Depth(queue) => {
                let Decoded { image, took } = queue.next();
                (image.map(|depth| (Some(depth), None)), took)
            }
            Self::Right(queue) => {
                let Decoded { image, took } = queue.next();
                (image.map(|right| (None, Some(right))), took)
            }
            Self::None => (Ok((None, None)), Duration::ZERO),
        }
    }
}

/// Reads colour or grey images and rectifies them if necessary.
#[derive(Clone)]
struct ColorReader {
    size: ImageSize,
    bytes: Vec<u8>,
    rectification: Option<Arc<StereoRectification>>,
}

impl ColorReader {
    fn read(
        &mut self,
        image: Option<&ImageRef>,
        side: fn(&StereoRectification) -> &Remap,
    ) -> std::result::Result<RgbImage, FrameFault> {
        let mut color = RgbImage::default();
        open_color(image.ok_or(FrameFault::NotListed)?, Some(self.size), &mut self.bytes, &mut color)?;
        Ok(self.rectification.as_deref().map(|rectification| side(rectification).apply(&color)).unwrap_or(color))
    }
}

fn read_depth(
    image: Option<&ImageRef>,
    size: ImageSize,
    depth_factor: f64,
    resampling: Option<&DepthResampling>,
    bytes: &mut Vec<u8>,
) -> std::result::Result<DepthImage, FrameFault> {
    let image = image.ok_or(FrameFault::NotListed)?;
    let mut depth = DepthImage::default();
    let size =
        resampling.map_or(size, |resampling| ImageSize { width: resampling.from[0], height: resampling.from[1] });
    open_depth(image, Some(size), depth_factor, bytes, &mut depth)?;
    if depth.raw.data().iter().all(|&raw| raw == 0) {
        return Err(FrameFault::NoDepth { image: image.clone() });
    }
    if let Some(resampling) = resampling {
        depth.raw = resampling.apply(&depth.raw);
    }
    Ok(depth)
}

fn paired(entry: &FrameEntry) -> Option<&ImageRef> {
    entry.paired_image.as_ref().map(|paired| &paired.image)
}

/// Reads and decodes a colour image, as [`decode_color`] does. `bytes` is a buffer that may be reused.
///
/// # Errors
/// The file or message cannot be read, or is not such an image.
pub fn open_color(
    image: &ImageRef,
    expected: Option<ImageSize>,
    bytes: &mut Vec<u8>,
    into: &mut RgbImage,
) -> std::result::Result<(), FrameFault> {
    if let ImageRef::Video(frame) = image {
        let size = frame.read(bytes).map_err(FrameFault::Unreadable)?;
        return color_of_pixels(bytes, size, expected, into).map_err(|error| image_fault(image, error));
    }
    image.read(bytes).map_err(FrameFault::Unreadable)?;
    let decoded = match kind(image) {
        Some((kind, wire)) => decode_color_message(kind, wire, bytes, expected, into),
        None => decode_color(bytes, expected, into),
    };
    decoded.map_err(|error| image_fault(image, error))
}

/// Copies the pixels of a frame of a video into an image.
fn color_of_pixels(
    pixels: &[u8],
    size: ImageSize,
    expected: Option<ImageSize>,
    into: &mut RgbImage,
) -> std::result::Result<(), DecodeError> {
    if let Some(expected) = expected.filter(|expected| *expected != size) {
        let cure = "use the calibration of this camera at the size of the video, or scale the video with ffmpeg";
        return Err(DecodeError::WrongSize { found: size, expected, cure });
    }
    into.resize(size.width, size.height);
    into.data_mut().as_flattened_mut().copy_from_slice(pixels);
    Ok(())
}

/// Reads and decodes a depth image, as [`decode_depth_image`] does. `bytes` is a buffer that may be reused.
///
/// # Errors
/// The file or message cannot be read, or is not such an image.
pub fn open_depth(
    image: &ImageRef,
    expected: Option<ImageSize>,
    depth_factor: f64,
    bytes: &mut Vec<u8>,
    into: &mut DepthImage,
) -> std::result::Result<(), FrameFault> {
    image.read(bytes).map_err(FrameFault::Unreadable)?;
    let decoded = match kind(image) {
        Some((kind, wire)) => decode_depth_message(kind, wire, bytes, depth_factor, expected, into),
        None => decode_depth_image(bytes, expected, depth_factor, into),
    };
    decoded.map_err(|error| image_fault(image, error))
}

/// Returns how the bytes of a message are read; `None` for those of a file.
fn kind(image: &ImageRef) -> Option<(MessageType, Wire)> {
    match image {
        ImageRef::File(_) | ImageRef::Video(_) => None,
        ImageRef::Message(message) => message.kind(),
    }
}

fn image_fault(image: &ImageRef, source: DecodeError) -> FrameFault {
    FrameFault::Image { image: image.clone(), source }
}
