//! Where received messages wait for the node.
//!
//! In: messages, on the thread of the transport. Out: the newest pair of images, and everything else in order. Memory is bounded whatever
//! comes: of pairs the newest wins, and of other messages so many wait.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use yfslam::{Camera, DepthImage, Frame, RgbImage};
use yfslam_io::decode::{DecodeError, ImageSize};
use yfslam_io::message::types::{CompressedImage, Header, Image};
use yfslam_io::message::{decode_color_image, decode_compressed_color, decode_compressed_depth, decode_depth_image};
use yfslam_live::{Arrival, LiveSource, NewestReceiver, NewestSender, Taken, newest_queue};

use crate::sync::PairSync;
use crate::transport::{Incoming, Picture};

/// Messages that wait, beside images.
const EVENTS: usize = 1024;

/// A pair of images, and when the later one came.
struct Pair {
    color: Picture,
    depth: Picture,
    stamp_ns: i64,
    depth_ns: i64,
    arrival: Instant,
}

/// Counts of what was received.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Received {
    pub color: u64,
    pub depth: u64,
    pub pairs: u64,
    /// Colour and depth images without a partner.
    pub unpaired: [u64; 2],
    /// Messages that could not be read.
    pub damaged: u64,
    /// Messages for which there was no room.
    pub overflowed: u64,
}

/// The side of the transport.
pub struct Inbox {
    sync: PairSync<Picture, Picture>,
    pairs: NewestSender<Pair>,
    events: SyncSender<Incoming>,
    received: Arc<Mutex<Received>>,
}

/// The side of the node.
pub struct Outbox {
    /// The images.
    pub pairs: PairSource,
    events: Receiver<Incoming>,
    received: Arc<Mutex<Received>>,
}

/// Pairs of images as live frames. They are decoded when they are taken: a pair that is dropped costs nothing.
pub struct PairSource {
    pairs: NewestReceiver<Pair>,
    camera: Option<Camera>,
    depth_units: f64,
}

/// Makes an inbox for images whose stamps differ by no more than `tolerance_ns`, with so many depth units per metre.
pub fn inbox(tolerance_ns: i64, depth_units: f64) -> (Inbox, Outbox) {
    let (pairs, newest) = newest_queue();
    let (events, waiting) = sync_channel(EVENTS);
    let received = Arc::new(Mutex::new(Received::default()));
    let inbox = Inbox { sync: PairSync::new(tolerance_ns), pairs, events, received: received.clone() };
    let pairs = PairSource { pairs: newest, camera: None, depth_units };
    (inbox, Outbox { pairs, events: waiting, received })
}

impl Inbox {
    /// Takes a message that came at `now`; returns whether the node is there to receive it.
    pub fn deliver(&mut self, message: Incoming, now: Instant) -> bool {
        let mut received = *self.received.lock().unwrap_or_else(PoisonError::into_inner);
        let pairs = match message {
            Incoming::Color(picture) => {
                received.color += 1;
                self.sync.push_first(picture.stamp_ns(), picture)
            }
            Incoming::Depth(picture) => {
                received.depth += 1;
                self.sync.push_second(picture.stamp_ns(), picture)
            }
            other => {
                received.damaged += u64::from(matches!(other, Incoming::Damaged(_)));
                // A node that is busy for long misses transforms and clocks, but no more memory is taken.
                received.overflowed += u64::from(matches!(self.events.try_send(other), Err(TrySendError::Full(_))));
                Vec::new()
            }
        };
        for (stamp_ns, color, depth_ns, depth) in pairs {
            received.pairs += 1;
            self.pairs.put(Pair { color, depth, stamp_ns, depth_ns, arrival: now });
        }
        received.unpaired = self.sync.unpaired();
        *self.received.lock().unwrap_or_else(PoisonError::into_inner) = received;
        self.pairs.is_open()
    }
}

impl Outbox {
    /// Returns the next message that is no image.
    pub fn event(&self) -> Option<Incoming> {
        self.events.try_recv().ok()
    }

    /// Returns the counts so far.
    pub fn received(&self) -> Received {
        *self.received.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Picture {
    fn stamp_ns(&self) -> i64 {
        match self {
            Self::Raw(image) => image.header.stamp.to_ns(),
            Self::Compressed(image) => image.header.stamp.to_ns(),
        }
    }

    fn decode_color(&self, size: ImageSize, into: &mut RgbImage) -> Result<(), DecodeError> {
        match self {
            Self::Raw(image) => decode_color_image(&borrowed(image), Some(size), into),
            Self::Compressed(image) => decode_compressed_color(&borrowed_file(image), Some(size), into),
        }
    }

    fn decode_depth(&self, units: f64, size: ImageSize, into: &mut DepthImage) -> Result<(), DecodeError> {
        match self {
            Self::Raw(image) => decode_depth_image(&borrowed(image), units, Some(size), into),
            Self::Compressed(image) => decode_compressed_depth(&borrowed_file(image), units, Some(size), into),
        }
    }
}

fn borrowed(image: &crate::messages::Image) -> Image<'_> {
    Image {
        header: Header { stamp_ns: image.header.stamp.to_ns(), frame_id: &image.header.frame_id },
        height: image.height,
        width: image.width,
        encoding: &image.encoding,
        is_bigendian: image.is_bigendian != 0,
        step: image.step,
        data: &image.data.0,
    }
}

fn borrowed_file(image: &crate::messages::CompressedImage) -> CompressedImage<'_> {
    let header = Header { stamp_ns: image.header.stamp.to_ns(), frame_id: &image.header.frame_id };
    CompressedImage { header, format: image.format.trim(), data: &image.data.0 }
}

impl PairSource {
    /// Sets the camera, without which nothing is decoded.
    pub fn set_camera(&mut self, camera: Camera) {
        self.camera = Some(camera);
    }

    fn decode(&self, pair: &Pair, camera: &Camera) -> Result<Frame, String> {
        let size = ImageSize { width: camera.width, height: camera.height };
        let (mut color, mut depth) = (RgbImage::default(), DepthImage::default());
        pair.color.decode_color(size, &mut color).map_err(|error| format!("the colour image {error}"))?;
        pair.depth
            .decode_depth(self.depth_units, size, &mut depth)
            .map_err(|error| format!("the depth image {error}"))?;
        if depth.raw.data().iter().all(|&raw| raw == 0) {
            return Err("the depth image has no depth in any pixel".into());
        }
        let mut frame = Frame::rgbd(pair.stamp_ns, color, depth);
        frame.depth_timestamp_ns = Some(pair.depth_ns);
        Ok(frame)
    }
}

impl LiveSource for PairSource {
    fn next(&mut self, timeout: Duration) -> Arrival {
        let pair = match self.pairs.take(timeout) {
            Taken::Item(pair) => pair,
            Taken::TimedOut => return Arrival::Nothing,
            Taken::Ended => return Arrival::Ended,
        };
        let Some(camera) = &self.camera else { return Arrival::Unusable("no camera_info has come yet".into()) };
        match self.decode(&pair, camera) {
            Ok(frame) => Arrival::Frame { frame, arrival: pair.arrival },
            Err(reason) => Arrival::Unusable(reason),
        }
    }

    fn dropped(&self) -> u64 {
        self.pairs.dropped()
    }
}
