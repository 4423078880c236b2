//! Faults of cameras and their drivers, injected into a stream of frames to test a system with them.
//!
//! In: frames in the order of their stamps, and [`Fault`]s such as `black@2+0.5`. Out: [`Delivery`]s, as a faulty camera would send them.
//! The same frames and faults always give the same deliveries.

mod false_boxes;
mod images;

use std::collections::VecDeque;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use yfslam::{DepthImage, Frame, Image, RgbImage};

use self::false_boxes::FalseBoxes;
use crate::error::{Error, Result};
use crate::time::{format_stamp, parse_stamp_ns};

/// Error of a clock, ns.
const CLOCK_ERROR_NS: i64 = 10_000_000_000;
/// Number of frames by which depth is late.
const LATE_FRAMES: usize = 3;

/// Kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The frame is not delivered.
    Dropped,
    /// The frame is delivered twice with the same stamp.
    Repeated,
    /// The colour image is white.
    Blank,
    /// The colour image is black.
    Black,
    /// Colour and depth stay as they were when the fault began; stamps continue.
    Frozen,
    /// Every other frame is delivered after its successor.
    Late,
    /// No pixel has depth.
    DepthDropout,
    /// The time stamp is not a number.
    NanStamp,
    /// The camera is covered: a dark, noisy image without depth.
    Covered,
    /// The detector reports people where nobody is. Another begin gives other boxes.
    FalseBoxes,
    /// The detector reports nothing.
    NoBoxes,
    /// The images are four times too bright.
    OverExposed,
    /// The images are blurred along their rows.
    Blurred,
    /// The brightness changes from frame to frame.
    Flicker,
    /// Spots on the lens cover a quarter of the image.
    Dirt,
    /// The dots of an infrared projector are in the image.
    IrPattern,
    /// The images have half the size.
    WrongSize,
    /// Depth has a noise of up to a fifth.
    DepthNoise,
    /// Depth is 1.5 times as large.
    DepthScale,
    /// The upper half of the depth image has the largest reading.
    DepthSaturated,
    /// The depth image is that of three frames earlier.
    DepthLate,
    /// The clock of the camera is ten seconds ahead, and goes back afterwards.
    ClockAhead,
    /// The clock of the camera is ten seconds behind, and is right again afterwards.
    ClockBehind,
}

impl FaultKind {
    /// All kinds with their names and descriptions.
    pub const ALL: [(&str, Self, &str); 23] = [
        ("dropped", Self::Dropped, "frames are not delivered"),
        ("repeated", Self::Repeated, "frames are delivered twice with the same stamp"),
        ("blank", Self::Blank, "white colour images"),
        ("black", Self::Black, "black colour images"),
        ("frozen", Self::Frozen, "colour and depth stay the same while stamps continue"),
        ("late", Self::Late, "every other frame is delivered after its successor"),
        ("depth-dropout", Self::DepthDropout, "no depth in any pixel"),
        ("nan-stamp", Self::NanStamp, "time stamps that are not a number"),
        ("covered", Self::Covered, "dark, noisy colour and no depth"),
        (
            "false-boxes",
            Self::FalseBoxes,
            "up to three boxes of people who are not there, instead of those of the detector",
        ),
        ("no-boxes", Self::NoBoxes, "a detector that finds nothing"),
        ("over-exposed", Self::OverExposed, "images that are four times too bright"),
        ("blurred", Self::Blurred, "images that are blurred along their rows"),
        ("flicker", Self::Flicker, "a brightness that changes from frame to frame"),
        ("dirt", Self::Dirt, "spots on the lens, which cover a quarter of the image"),
        ("ir-pattern", Self::IrPattern, "the dots of an infrared projector in the image"),
        ("wrong-size", Self::WrongSize, "images of half the size"),
        ("depth-noise", Self::DepthNoise, "a noise of depth of up to a fifth"),
        ("depth-scale", Self::DepthScale, "depth that is 1.5 times as large"),
        ("depth-saturated", Self::DepthSaturated, "the largest reading in the upper half of the depth image"),
        ("depth-late", Self::DepthLate, "the depth image of three frames earlier"),
        ("clock-ahead", Self::ClockAhead, "a clock that is ten seconds ahead, and goes back afterwards"),
        ("clock-behind", Self::ClockBehind, "a clock that is ten seconds behind, and is right again afterwards"),
    ];
}

/// A fault and its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Kind.
    pub kind: FaultKind,
    /// Begin, ns after the first frame.
    pub start_ns: i64,
    /// Duration, ns.
    pub duration_ns: i64,
}

impl Fault {
    /// Returns whether the fault affects a frame `elapsed_ns` after the first one.
    pub fn affects(&self, elapsed_ns: i64) -> bool {
        elapsed_ns >= self.start_ns && elapsed_ns < self.start_ns.saturating_add(self.duration_ns)
    }
}

impl FromStr for Fault {
    type Err = Error;

    /// Reads `KIND@START+SECONDS`, such as `covered@4+1.5`.
    fn from_str(text: &str) -> Result<Self> {
        let refuse = |problem: String| {
            let kinds: Vec<&str> = FaultKind::ALL.iter().map(|(name, ..)| *name).collect();
            let cure = format!(
                "write KIND@START+SECONDS, such as black@2+0.5 (from 2 s after the first frame, for half a second), with one of the \
                 kinds {}",
                kinds.join(", ")
            );
            Error::argument(format!("fault '{text}': {problem}"), cure)
        };
        let parts = text.split_once('@').and_then(|(kind, when)| Some((kind, when.split_once('+')?)));
        let (name, (start, duration)) = parts.ok_or_else(|| refuse("has no '@' and '+'".into()))?;
        let kind = FaultKind::ALL.iter().find(|(known, ..)| *known == name);
        let (_, kind, _) = *kind.ok_or_else(|| refuse(format!("unknown kind '{name}'")))?;
        let time = |what: &str, value: &str| match parse_stamp_ns(value) {
            Ok(ns) if ns >= 0 => Ok(ns),
            Ok(_) => Err(refuse(format!("{what} '{value}' is negative"))),
            Err(error) => Err(refuse(format!("{what} '{value}' {error}"))),
        };
        Ok(Self { kind, start_ns: time("start", start)?, duration_ns: time("duration", duration)? })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = FaultKind::ALL.iter().find(|(_, kind, _)| *kind == self.kind).map_or("", |(name, ..)| name);
        write!(f, "{name}@{}+{}", format_stamp(self.start_ns), format_stamp(self.duration_ns))
    }
}

/// A frame as the faulty camera sends it.
#[derive(Clone, Debug)]
pub struct Delivery {
    /// The frame, always with its true stamp.
    pub frame: Frame,
    /// Whether the camera delivers the stamp.
    pub has_stamp: bool,
}

/// Turns frames into deliveries.
#[derive(Debug)]
pub struct FaultInjector {
    faults: Vec<Fault>,
    first_ns: i64,
    frozen: Option<Frame>,
    held: Option<Delivery>,
    /// The depth images of the last frames, the oldest first, if depth will be late.
    depths: VecDeque<Option<Arc<DepthImage>>>,
    false_boxes: FalseBoxes,
    ready: VecDeque<Delivery>,
}

impl FaultInjector {
    /// Creates an injector; the times of the faults are relative to `first_ns`, the stamp of the first frame.
    pub fn new(faults: Vec<Fault>, first_ns: i64) -> Self {
        let first = faults.iter().find(|fault| fault.kind == FaultKind::FalseBoxes);
        let false_boxes = FalseBoxes::new(first.map_or(0, |fault| fault.start_ns as u64));
        Self {
            faults,
            first_ns,
            frozen: None,
            held: None,
            depths: VecDeque::new(),
            false_boxes,
            ready: VecDeque::new(),
        }
    }

    /// Adds the next frame.
    pub fn push(&mut self, mut frame: Frame) {
        let elapsed_ns = frame.timestamp_ns.saturating_sub(self.first_ns);
        let mut delivery = Some(true);
        let (mut twice, mut late, mut frozen) = (false, false, false);
        let late_depth = self.late_depth(&frame);
        for fault in self.faults.iter().filter(|fault| fault.affects(elapsed_ns)) {
            match fault.kind {
                FaultKind::Dropped => delivery = None,
                FaultKind::NanStamp => delivery = delivery.map(|_| false),
                FaultKind::Repeated => twice = true,
                FaultKind::Late => late = true,
                FaultKind::Frozen => {
                    frozen = true;
                    let kept = self.frozen.get_or_insert_with(|| frame.clone());
                    let stamps = (frame.timestamp_ns, frame.depth_timestamp_ns);
                    frame = kept.clone();
                    (frame.timestamp_ns, frame.depth_timestamp_ns) = stamps;
                }
                FaultKind::Blank => repaint(&mut frame, |_| [255; 3]),
                FaultKind::Black => repaint(&mut frame, |_| [0; 3]),
                FaultKind::DepthDropout => remove_depth(&mut frame),
                FaultKind::Covered => {
                    let seed = frame.timestamp_ns as u64;
                    repaint(&mut frame, |pixel| dark_noise(seed, pixel));
                    remove_depth(&mut frame);
                }
                FaultKind::FalseBoxes => {
                    let boxes = self.false_boxes.next(frame.color.width(), frame.color.height());
                    frame.detections.get_or_insert_default().extend_from_slice(boxes);
                }
                FaultKind::NoBoxes => frame.detections = Some(Vec::new()),
                FaultKind::OverExposed => images::over_expose(&mut frame),
                FaultKind::Blurred => images::blur(&mut frame),
                FaultKind::Flicker => images::flicker(&mut frame),
                FaultKind::Dirt => images::cover_with_dirt(&mut frame),
                FaultKind::IrPattern => images::add_dots(&mut frame),
                FaultKind::WrongSize => images::halve(&mut frame),
                FaultKind::DepthNoise => images::add_depth_noise(&mut frame),
                FaultKind::DepthScale => images::scale_depth(&mut frame),
                FaultKind::DepthSaturated => images::saturate_depth(&mut frame),
                FaultKind::DepthLate => frame.depth = late_depth.clone(),
                FaultKind::ClockAhead => shift_clock(&mut frame, CLOCK_ERROR_NS),
                FaultKind::ClockBehind => shift_clock(&mut frame, -CLOCK_ERROR_NS),
            }
        }
        if !frozen {
            self.frozen = None;
        }
        let Some(has_stamp) = delivery else { return };
        let delivery = Delivery { frame, has_stamp };
        if late && self.held.is_none() {
            self.held = Some(delivery);
            return;
        }
        if twice {
            self.ready.push_back(delivery.clone());
        }
        self.ready.push_back(delivery);
        self.finish();
    }

    /// Keeps the depth image of a frame if depth will be late, and returns the one of some frames earlier.
    fn late_depth(&mut self, frame: &Frame) -> Option<Arc<DepthImage>> {
        if !self.faults.iter().any(|fault| fault.kind == FaultKind::DepthLate) {
            return None;
        }
        self.depths.push_back(frame.depth.clone());
        if self.depths.len() > LATE_FRAMES + 1 {
            self.depths.pop_front();
        }
        self.depths.front().cloned().flatten()
    }

    /// Releases a frame that is held back; to be called after the last frame.
    pub fn finish(&mut self) {
        self.ready.extend(self.held.take());
    }

    /// Returns the next delivery, if one is ready.
    pub fn pop(&mut self) -> Option<Delivery> {
        self.ready.pop_front()
    }
}

/// Replaces the colour image and the right image by `color` of each pixel, and removes all detections.
fn repaint(frame: &mut Frame, color: impl Fn(usize) -> [u8; 3]) {
    let mut image = RgbImage::new(frame.color.width(), frame.color.height());
    image.data_mut().iter_mut().enumerate().for_each(|(pixel, rgb)| *rgb = color(pixel));
    frame.color = Arc::new(image);
    frame.right = frame.right.as_ref().map(|_| frame.color.clone());
    frame.detections = frame.detections.as_ref().map(|_| Vec::new());
}

fn shift_clock(frame: &mut Frame, by_ns: i64) {
    frame.timestamp_ns = frame.timestamp_ns.saturating_add(by_ns);
    frame.depth_timestamp_ns = frame.depth_timestamp_ns.map(|ns| ns.saturating_add(by_ns));
}

fn remove_depth(frame: &mut Frame) {
    if let Some(depth) = &frame.depth {
        let raw = Image::new(depth.raw.width(), depth.raw.height());
        frame.depth = Some(Arc::new(DepthImage { raw, metres_per_unit: depth.metres_per_unit }));
    }
}

/// Returns grey levels from 4 to 19 without structure.
fn dark_noise(seed: u64, pixel: usize) -> [u8; 3] {
    let bits = mixed(seed ^ (pixel as u64) << 32);
    [0, 8, 16].map(|shift| 4 + ((bits >> shift) as u8 & 15))
}

/// Returns bits without structure that depend on all bits of the argument: one draw of SplitMix64 (Steele et al., OOPSLA 2014).
fn mixed(bits: u64) -> u64 {
    let mut bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}

#[cfg(test)]
mod tests;
