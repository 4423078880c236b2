//! Faults that cameras and their drivers have, put into a stream of frames on purpose, to see what a system makes of them.
//!
//! In: frames in the order of their stamps, and [`Fault`]s such as `black@2+0.5`. Out: [`Delivery`]s, as a faulty camera would send them.
//! Everything follows from the frames alone: the same frames and faults give the same deliveries.

use std::collections::VecDeque;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use yfslam::RgbdFrame;
use yfslam::image::{DepthImage, Image, RgbImage};

use crate::error::{Error, Result};
use crate::time::{format_stamp, parse_stamp_ns};

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The frame never comes.
    Dropped,
    /// The frame comes twice with one stamp.
    Repeated,
    /// The colour image is white.
    Blank,
    /// The colour image is black.
    Black,
    /// Colour and depth stay as they were when the fault began; stamps go on.
    Frozen,
    /// Every other frame comes after its successor.
    Late,
    /// No pixel has a depth.
    DepthDropout,
    /// The time stamp is not a number.
    NanStamp,
    /// Something lies on the camera: a dark, noisy picture without depth.
    Covered,
}

impl FaultKind {
    /// All kinds with their names and what they do.
    pub const ALL: [(&str, Self, &str); 9] = [
        ("dropped", Self::Dropped, "frames never come"),
        ("repeated", Self::Repeated, "frames come twice with one stamp"),
        ("blank", Self::Blank, "white colour images"),
        ("black", Self::Black, "black colour images"),
        ("frozen", Self::Frozen, "colour and depth stay, stamps go on"),
        ("late", Self::Late, "every other frame comes after its successor"),
        ("depth-dropout", Self::DepthDropout, "no depth in any pixel"),
        ("nan-stamp", Self::NanStamp, "time stamps that are not a number"),
        ("covered", Self::Covered, "dark, noisy colour and no depth"),
    ];
}

/// A fault and when it happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// When it begins, ns after the first frame.
    pub start_ns: i64,
    /// How long it lasts, ns.
    pub duration_ns: i64,
}

impl Fault {
    /// Whether a frame `elapsed_ns` after the first one is struck.
    pub fn strikes(&self, elapsed_ns: i64) -> bool {
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
    /// The frame; its stamp is the true one even where the camera does not tell it.
    pub frame: RgbdFrame,
    /// Whether the camera tells the stamp.
    pub has_stamp: bool,
}

/// Takes frames, gives deliveries.
#[derive(Debug)]
pub struct FaultInjector {
    faults: Vec<Fault>,
    first_ns: i64,
    frozen: Option<RgbdFrame>,
    held: Option<Delivery>,
    ready: VecDeque<Delivery>,
}

impl FaultInjector {
    /// Faults counted from `first_ns`, the stamp of the first frame.
    pub fn new(faults: Vec<Fault>, first_ns: i64) -> Self {
        Self { faults, first_ns, frozen: None, held: None, ready: VecDeque::new() }
    }

    /// Takes the next frame.
    pub fn push(&mut self, mut frame: RgbdFrame) {
        let elapsed_ns = frame.timestamp_ns.saturating_sub(self.first_ns);
        let mut delivery = Some(true);
        let (mut twice, mut late, mut frozen) = (false, false, false);
        for fault in self.faults.iter().filter(|fault| fault.strikes(elapsed_ns)) {
            match fault.kind {
                FaultKind::Dropped => delivery = None,
                FaultKind::NanStamp => delivery = delivery.map(|_| false),
                FaultKind::Repeated => twice = true,
                FaultKind::Late => late = true,
                FaultKind::Frozen => {
                    frozen = true;
                    let kept = self.frozen.get_or_insert_with(|| frame.clone());
                    frame = RgbdFrame { timestamp_ns: frame.timestamp_ns, ..kept.clone() };
                }
                FaultKind::Blank => show(&mut frame, |_| [255; 3]),
                FaultKind::Black => show(&mut frame, |_| [0; 3]),
                FaultKind::DepthDropout => hide_depth(&mut frame),
                FaultKind::Covered => {
                    let seed = frame.timestamp_ns as u64;
                    show(&mut frame, |pixel| dark_noise(seed, pixel));
                    hide_depth(&mut frame);
                }
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

    /// Lets go what is held back; to be called after the last frame.
    pub fn finish(&mut self) {
        self.ready.extend(self.held.take());
    }

    /// The next delivery, if one is ready.
    pub fn pop(&mut self) -> Option<Delivery> {
        self.ready.pop_front()
    }
}

/// Replaces the colour image, and the right picture, by one without anything that a detector could find.
fn show(frame: &mut RgbdFrame, color: impl Fn(usize) -> [u8; 3]) {
    let mut image = RgbImage::new(frame.color.width(), frame.color.height());
    image.data_mut().iter_mut().enumerate().for_each(|(pixel, rgb)| *rgb = color(pixel));
    frame.color = Arc::new(image);
    frame.right = frame.right.as_ref().map(|_| frame.color.clone());
    frame.detections = frame.detections.as_ref().map(|_| Vec::new());
}

fn hide_depth(frame: &mut RgbdFrame) {
    let (width, height) = (frame.depth.raw.width(), frame.depth.raw.height());
    frame.depth = Arc::new(DepthImage { raw: Image::new(width, height), metres_per_unit: frame.depth.metres_per_unit });
}

/// Grey levels from 4 to 19 without any structure (a draw of SplitMix64, Steele et al., OOPSLA 2014, for each pixel).
fn dark_noise(seed: u64, pixel: usize) -> [u8; 3] {
    let mut bits = (seed ^ (pixel as u64) << 32).wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    [0, 8, 16].map(|shift| 4 + ((bits >> shift) as u8 & 15))
}

#[cfg(test)]
mod tests;
