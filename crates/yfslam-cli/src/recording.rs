//! The input of `yfslam run` for programs that are not the command line: a sequence with its camera, boxes and ground truth.
//!
//! In: [`Options`], the arguments of `yfslam run` that concern the input. Out: the frames that `yfslam run` would track, and no others.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use yfslam::Frame;
use yfslam::config::DepthSource;
use yfslam_eval::StampedPose;
use yfslam_io::CameraSource;
use yfslam_io::sequence::{Layout, TopicChoice};

use crate::input::source::{BagArgs, SensorArg, Source, SourceArgs};
use crate::stats::stages::Stages;
use crate::ui::terminal::Terminal;

/// Which sequence is read, and how; the fields are the options of `yfslam run` of these names.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Folder, bag or synthetic world.
    pub sequence: String,
    /// Name of the layout of a folder; `None` detects it.
    pub layout: Option<String>,
    /// List of the pairs of colour and depth images.
    pub associations: Option<PathBuf>,
    /// Folder of the colour images.
    pub color: Option<PathBuf>,
    /// Folder of the depth images.
    pub depth: Option<PathBuf>,
    /// Frames per second of images without time stamps.
    pub fps: Option<f64>,
    /// Preset or camera file; `None` takes that of the sequence.
    pub camera: Option<String>,
    /// What depth comes from; `None` takes what the sequence has.
    pub sensor: Option<DepthSource>,
    /// Depth units per metre; `None` takes those of the camera.
    pub depth_factor: Option<f64>,
    /// Largest difference between the time stamps of a colour image and its depth or right image, ms.
    pub association_tolerance_ms: Option<f64>,
    /// Folder with a mask for each colour image.
    pub masks: Option<PathBuf>,
    /// First frame, counted from 0.
    pub start: usize,
    /// Frame before which the sequence ends.
    pub end: Option<usize>,
    /// Whether the frames come in reverse order, with mirrored time stamps.
    pub reverse: bool,
    /// Injected faults, as `--fault` takes them.
    pub faults: Vec<String>,
    /// Topics of a bag.
    pub topics: TopicChoice,
    /// Classes of the boxes that frames carry where the sequence has boxes of its own; `None` leaves the boxes out.
    pub own_boxes: Option<Vec<String>>,
}

/// A sequence that is ready to be played, once.
pub struct Recording {
    source: Source,
    has_boxes: bool,
    stages: Stages,
}

impl Recording {
    /// Opens a sequence and starts to decode or render it.
    ///
    /// # Errors
    /// As `yfslam run`, with file, value and what to do.
    pub fn open(options: &Options) -> Result<Self> {
        let args = options.arguments()?;
        let has_boxes = options.own_boxes.is_some() && args.has_boxes();
        let own_boxes = options.own_boxes.as_deref().filter(|_| has_boxes);
        let source = Source::open(&args, DepthSource::Image, own_boxes)?;
        Ok(Self { source, has_boxes, stages: Stages::default() })
    }

    /// Returns the short name of the sequence.
    pub fn name(&self) -> &str {
        &self.source.name
    }

    /// Returns what the sequence was taken for, and what was assumed.
    pub fn notes(&self) -> &[String] {
        &self.source.notes
    }

    /// Returns what is probably a mistake.
    pub fn warnings(&self) -> &[String] {
        &self.source.warnings
    }

    /// Returns the camera.
    pub fn camera(&self) -> &CameraSource {
        &self.source.camera
    }

    /// Returns what depth comes from.
    pub fn depth_source(&self) -> DepthSource {
        self.source.depth_source
    }

    /// Returns whether frames carry boxes of the sequence, so that no detector is needed.
    pub fn has_boxes(&self) -> bool {
        self.has_boxes
    }

    /// Returns the time stamps of all frames, ns, also of those that will turn out to be unusable.
    pub fn stamps_ns(&self) -> &[i64] {
        &self.source.stamps_ns
    }

    /// Returns the ground truth: from `file`, else that of the sequence; `None` if it has none.
    ///
    /// # Errors
    /// The file cannot be read or holds values that are not a pose.
    pub fn truth(&self, file: Option<&Path>) -> Result<Option<Vec<StampedPose>>> {
        Ok(self.source.truth(file, Terminal::quiet())?.map(|truth| truth.poses))
    }
}

impl Iterator for Recording {
    /// A frame, or why it cannot be used.
    type Item = Result<Frame, String>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.source.frames.next(&mut self.stages)?.map_err(|skip| skip.message))
    }
}

impl Options {
    /// Returns the arguments of `yfslam run`.
    fn arguments(&self) -> Result<SourceArgs> {
        let options = self.clone();
        let layout = options.layout.map(|name| {
            let known = Layout::ALL.map(Layout::key).join(", ");
            let layout = Layout::ALL.into_iter().find(|layout| layout.key() == name);
            layout.with_context(|| format!("unknown layout '{name}'; give one of {known}"))
        });
        let faults = options.faults.iter().map(|fault| Ok(fault.parse()?)).collect::<Result<_>>()?;
        Ok(SourceArgs {
            sequence: options.sequence,
            layout: layout.transpose()?,
            associations: options.associations,
            color: options.color,
            depth: options.depth,
            fps: options.fps,
            camera: options.camera,
            sensor: options.sensor.map(|sensor| match sensor {
                DepthSource::Image => SensorArg::Rgbd,
                DepthSource::Stereo => SensorArg::Stereo,
                DepthSource::Motion => SensorArg::Mono,
            }),
            depth_factor: options.depth_factor,
            association_tolerance: options.association_tolerance_ms,
            masks: options.masks,
            start: options.start,
            end: options.end,
            reverse: options.reverse,
            faults,
            bag: BagArgs::of(options.topics),
        })
    }
}
