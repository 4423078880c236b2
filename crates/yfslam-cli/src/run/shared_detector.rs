//! One detector for several methods: each frame goes through the network once.
//!
//! In: frames. Out: the frames with their boxes.

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use anyhow::Result;
use yfslam::{Config, Detection, Detector, Frame, Image, RollCompensation, SetupError, mask_of_classes};

use crate::input::detector::{DetectorTime, LoadedDetector};
use crate::stats::process::{Part, Parts};
use crate::stats::stages::Stages;

/// A detector that processes each frame once for several methods; once for each roll angle where the methods estimate different ones.
pub struct SharedDetector {
    detector: Box<dyn Detector>,
    upright: RollCompensation,
    times: Receiver<DetectorTime>,
    /// Indices of the classes that can move.
    movable: Vec<usize>,
    /// Detections in the current frame by roll angle, degrees; `None` if the detector skips this frame.
    detections: Option<Vec<(i32, FrameDetections)>>,
    /// As `dynamic.detect_every`.
    every: usize,
    /// Frames whose time stamps ascend, and the last of these stamps, ns.
    frames: usize,
    last_ns: Option<i64>,
    tally: DetectionTally,
}

/// The movable objects in a frame.
#[derive(Clone, Debug, Default)]
struct FrameDetections {
    boxes: Vec<Detection>,
    /// Only from a detector that segments.
    mask: Option<Arc<Image<u8>>>,
}

/// The cost of detection for several methods.
#[derive(Clone, Debug, Default)]
pub struct DetectionTally {
    pub stages: Stages,
    pub parts: Parts,
    /// Frames on which the detector failed; they count as frames without boxes.
    pub failures: usize,
}

impl SharedDetector {
    /// Uses `detector` for the classes of `dynamic.movable`.
    ///
    /// # Errors
    /// The detector does not know one of them.
    pub fn new(LoadedDetector { detector, times, .. }: LoadedDetector, config: &Config) -> Result<Self, SetupError> {
        let known = detector.class_names();
        let index = |name: &String| {
            let unknown = || SetupError::UnknownClass { name: name.clone(), known: known.join(", ") };
            known.iter().position(|k| k == name).ok_or_else(unknown)
        };
        let movable = config.dynamic.movable.iter().map(index).collect::<Result<_, _>>()?;
        Ok(Self {
            detector,
            upright: RollCompensation::default(),
            times,
            movable,
            detections: None,
            every: config.dynamic.detect_every,
            frames: 0,
            last_ns: None,
            tally: DetectionTally::default(),
        })
    }

    /// Starts the next frame.
    pub fn begin(&mut self, frame: &Frame) {
        let refused = self.last_ns.is_some_and(|last_ns| last_ns >= frame.timestamp_ns);
        let due = !refused && self.frames.is_multiple_of(self.every);
        self.detections = due.then(Vec::new);
        if !refused {
            self.last_ns = Some(frame.timestamp_ns);
            self.frames += 1;
        }
    }

    /// Returns the frame with its boxes for a method whose camera is rolled by `roll_deg`; without boxes if the detector skips it. A frame that
    /// brings its own boxes keeps them.
    pub fn detect(&mut self, frame: &Frame, roll_deg: i32) -> Frame {
        if frame.detections.is_some() {
            return frame.clone();
        }
        let FrameDetections { boxes, mask } = match &self.detections {
            None => FrameDetections::default(),
            Some(known) => match known.iter().find(|(roll, _)| *roll == roll_deg) {
                Some((_, detections)) => detections.clone(),
                None => self.run_network(frame, roll_deg),
            },
        };
        let mut frame = frame.clone();
        frame.detections = Some(boxes);
        frame.mask = frame.mask.or(mask);
        frame
    }

    fn run_network(&mut self, frame: &Frame, roll_deg: i32) -> FrameDetections {
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
            self.tally.parts.add(Part::Detector, took.cpu.unwrap_or_default());
        }
        let detections = FrameDetections { boxes, mask };
        if let Some(known) = &mut self.detections {
            known.push((roll_deg, detections.clone()));
        }
        detections
    }

    /// Returns the cost.
    pub fn into_tally(self) -> DetectionTally {
        self.tally
    }
}
