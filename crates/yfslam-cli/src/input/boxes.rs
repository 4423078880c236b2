//! Where the boxes of movable objects come from, and one detector for several methods.
//!
//! In: what the user named. Out: for one method the detector itself, which then runs beside feature extraction; for several the frames
//! with their boxes, found once.

use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;

use anyhow::{Result, bail};
use serde::Serialize;
use yfslam::dynamic::Method;
use yfslam::image::Image;
use yfslam::{Config, Detection, Detector, RgbdFrame, SetupError, Upright, mask_of_classes};

use crate::input::detector::{self, DetectorArgs, LoadedDetector, ModelIdentity, Took};
use crate::input::settings::describe;
use crate::input::source::SourceArgs;
use crate::stats::cpu;
use crate::stats::stages::Stages;
use crate::ui::terminal::Terminal;

/// Where the boxes of movable objects come from.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BoxOrigin {
    /// The method needs none.
    None,
    /// The synthetic world knows them.
    Renderer,
    /// The `boxes.json` of the folder.
    Folder,
    /// None: masks tell what can move.
    Masks,
    /// A network.
    Detector(ModelIdentity),
}

impl BoxOrigin {
    /// Whether they come with the frames.
    pub fn is_source(&self) -> bool {
        matches!(self, Self::Renderer | Self::Folder)
    }
}

impl fmt::Display for BoxOrigin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::None => f.write_str("none needed"),
            Self::Renderer => f.write_str("exact, from the renderer"),
            Self::Folder => f.write_str("exact, from the recording's boxes.json"),
            Self::Masks => f.write_str("none; masks tell what can move"),
            Self::Detector(model) => model.fmt(f),
        }
    }
}

/// The origin of the boxes that `methods` need, and the detector if it is one.
///
/// # Errors
/// The detector cannot be used, or there are masks alone and a method cannot use them.
pub fn choose(
    args: &DetectorArgs,
    source: &SourceArgs,
    config: &Config,
    methods: &[Method],
    terminal: Terminal,
) -> Result<(BoxOrigin, Option<LoadedDetector>)> {
    if !methods.iter().any(|method| method.needs_boxes()) {
        return Ok((BoxOrigin::None, None));
    }
    if args.detector.is_none() && source.masks.is_some() {
        if let Some(method) = methods.iter().find(|method| matches!(method, Method::Boxes | Method::Yf)) {
            let (name, _) = describe(*method);
            bail!(
                "method {name} works on boxes alone; add --detector embedded to find them, or leave it out of --method"
            );
        }
        terminal.note("no --detector: the masks alone tell what can move");
        return Ok((BoxOrigin::Masks, None));
    }
    if args.detector.is_none() && source.is_synthetic() {
        terminal.note("no --detector: the boxes of people come from the renderer, which knows them exactly");
        return Ok((BoxOrigin::Renderer, None));
    }
    if args.detector.is_none() && source.knows_boxes() {
        terminal.note("no --detector: the boxes of people come from the folder's boxes.json");
        return Ok((BoxOrigin::Folder, None));
    }
    let loaded = detector::load_for(args, config)?;
    if args.detector.is_none() {
        terminal.note("no --detector: people are found by the network in this program");
    }
    Ok((BoxOrigin::Detector(loaded.identity.clone()), Some(loaded)))
}

/// A detector that sees each frame once, for several methods; where these disagree on how far the camera is rolled, once each.
pub struct SharedDetector {
    detector: Box<dyn Detector>,
    upright: Upright,
    times: Receiver<Took>,
    /// Indices of the classes that can move.
    movable: Vec<usize>,
    /// What was found in the current frame, with a camera rolled by so many degrees; `None` if no boxes are due.
    found: Option<Vec<(i32, Found)>>,
    /// As `dynamic.detect_every`.
    every: usize,
    /// Frames that no method refuses for their time, and the time of the last of them, ns.
    frames: usize,
    last_ns: Option<i64>,
    tally: DetectionTally,
}

/// What can move in a frame.
#[derive(Clone, Debug, Default)]
struct Found {
    boxes: Vec<Detection>,
    /// From a detector that segments.
    mask: Option<Arc<Image<u8>>>,
}

/// What it took to find boxes for several methods at once.
#[derive(Clone, Debug)]
pub struct DetectionTally {
    pub stages: Stages,
    /// Processor time; `None` where the system does not tell.
    pub cpu: Option<Duration>,
    /// Frames on which the detector failed; they count as frames without boxes.
    pub failures: usize,
}

impl Default for DetectionTally {
    fn default() -> Self {
        Self { stages: Stages::default(), cpu: cpu::thread_time().map(|_| Duration::ZERO), failures: 0 }
    }
}

impl SharedDetector {
    /// Takes over a detector that is to report the classes of `dynamic.movable`.
    ///
    /// # Errors
    /// It does not know one of them.
    pub fn new(LoadedDetector { detector, times, .. }: LoadedDetector, config: &Config) -> Result<Self, SetupError> {
        let known = detector.class_names();
        let index = |name: &String| {
            let unknown = || SetupError::UnknownClass { name: name.clone(), known: known.join(", ") };
            known.iter().position(|k| k == name).ok_or_else(unknown)
        };
        let movable = config.dynamic.movable.iter().map(index).collect::<Result<_, _>>()?;
        Ok(Self {
            detector,
            upright: Upright::default(),
            times,
            movable,
            found: None,
            every: config.dynamic.detect_every,
            frames: 0,
            last_ns: None,
            tally: DetectionTally::default(),
        })
    }

    /// Comes to the next frame.
    pub fn begin(&mut self, frame: &RgbdFrame) {
        let refused = self.last_ns.is_some_and(|last_ns| last_ns >= frame.timestamp_ns);
        let due = !refused && self.frames.is_multiple_of(self.every);
        self.found = due.then(Vec::new);
        if !refused {
            self.last_ns = Some(frame.timestamp_ns);
            self.frames += 1;
        }
    }

    /// The frame with its boxes, or with none where none are due, for a method that knows its camera rolled by `roll_deg`.
    pub fn see(&mut self, frame: &RgbdFrame, roll_deg: i32) -> RgbdFrame {
        let Found { boxes, mask } = match &self.found {
            None => Found::default(),
            Some(found) => match found.iter().find(|(roll, _)| *roll == roll_deg) {
                Some((_, found)) => found.clone(),
                None => self.look(frame, roll_deg),
            },
        };
        RgbdFrame { detections: Some(boxes), mask: frame.mask.clone().or(mask), ..frame.clone() }
    }

    fn look(&mut self, frame: &RgbdFrame, roll_deg: i32) -> Found {
        let mut boxes = Vec::new();
        if let Err(error) = self.upright.detect(&mut *self.detector, &frame.color, roll_deg, &mut boxes) {
            tracing::warn!(timestamp_ns = frame.timestamp_ns, %error, "frame without boxes");
            boxes.clear();
            self.tally.failures += 1;
        }
        boxes.retain(|detection| self.movable.contains(&detection.class));
        let mask = self.upright.mask(&*self.detector).map(|mask| Arc::new(mask_of_classes(mask, &self.movable)));
        for took in self.times.try_iter() {
            self.tally.stages.push("detector", took.wall);
            self.tally.cpu = self.tally.cpu.zip(took.cpu).map(|(sum, took)| sum + took);
        }
        let found = Found { boxes, mask };
        if let Some(earlier) = &mut self.found {
            earlier.push((roll_deg, found.clone()));
        }
        found
    }

    /// What it took.
    pub fn into_tally(self) -> DetectionTally {
        self.tally
    }
}
