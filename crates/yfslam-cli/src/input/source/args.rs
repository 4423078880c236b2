//! Which sequence is read, and how.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use yfslam::config::DepthSource;
use yfslam_io::boxes::BOXES_FILE;
use yfslam_io::sequence::Layout;
use yfslam_io::{Fault, load_camera};
use yfslam_synth::{WorldConfig, default_camera, parse_with_camera};

use super::bag::BagArgs;
use super::masks::{MaskTally, Masks};

/// Largest difference between the time stamps of a colour and a depth image, ms. Source: the tool of the TUM RGB-D benchmark.
pub const ASSOCIATION_TOLERANCE_MS: f64 = 20.0;

/// Which sequence is read, and how.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Input")]
pub struct SourceArgs {
    /// Folder of a recording in any of the layouts of --layout, a bag (.bag, .mcap, .db3 or folder), a video of one camera (.mp4, .mkv, …, through ffmpeg), a synthetic world such as `synth:walking_xyz?seed=7`, or - for frames on standard input.
    #[arg(
        value_name = "SEQUENCE",
        help_heading = None,
        required_unless_present = "color",
        default_value = "",
        hide_default_value = true
    )]
    pub sequence: String,
    /// Layout of the folder [default: detected; `yfslam info SEQUENCE` explains it].
    #[arg(long, value_name = "NAME", value_parser = layout_parser())]
    pub layout: Option<Layout>,
    /// List of the pairs of colour and depth images: `stamp rgb-file stamp depth-file` [default: the list in the folder].
    #[arg(long, value_name = "FILE")]
    pub associations: Option<PathBuf>,
    /// Folder of the colour images, where there is no list [default: color, rgb and similar names in the folder].
    #[arg(long, value_name = "DIR")]
    pub color: Option<PathBuf>,
    /// Folder of the depth images, where there is no list [default: depth and similar names in the folder].
    #[arg(long, value_name = "DIR")]
    pub depth: Option<PathBuf>,
    /// Frames per second of images without time stamps [default: 30]; for a video, in place of its own time stamps.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub fps: Option<f64>,
    /// Camera: a preset such as tum1, bonn or d435i, or a camera file of any common kind [default: the camera file in the folder].
    #[arg(long, value_name = "PRESET|FILE")]
    pub camera: Option<String>,
    /// Type of the camera [default: what the sequence has].
    #[arg(long, value_enum, value_name = "SENSOR")]
    pub sensor: Option<SensorArg>,
    /// Depth units per metre [default: those of the camera; TUM and Bonn have 5000, images in millimetres have 1000].
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    pub depth_factor: Option<f64>,
    /// Largest difference between the time stamps of a colour image and its depth or right image, ms [default: 20].
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    pub association_tolerance: Option<f64>,
    /// Folder with a mask of movable objects for each colour image, for the methods ds, dyna and full.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// First frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    pub start: usize,
    /// Frame before which the run stops [default: the end].
    #[arg(long, value_name = "J")]
    pub end: Option<usize>,
    /// Play the frames in reverse order, with mirrored time stamps.
    #[arg(long)]
    pub reverse: bool,
    /// Inject a fault from START seconds on for SECONDS; the option can be given several times.
    #[arg(long = "fault", value_name = "KIND@START+SECONDS")]
    pub faults: Vec<Fault>,
    #[command(flatten)]
    pub bag: BagArgs,
}

/// Parses the name of a layout.
fn layout_parser() -> impl TypedValueParser<Value = Layout> {
    PossibleValuesParser::new(Layout::ALL.map(Layout::key)).try_map(|name| {
        Layout::ALL.into_iter().find(|layout| layout.key() == name).ok_or_else(|| format!("unknown layout {name}"))
    })
}

/// Types of cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SensorArg {
    /// Colour and depth images.
    Rgbd,
    /// Left and right images.
    Stereo,
    /// Images of one camera; depth or right images are ignored, and the scale of the trajectory is arbitrary.
    Mono,
}

impl SourceArgs {
    /// Returns which frames of a recording have a mask; `None` without `--masks`.
    ///
    /// # Errors
    /// No frame has a mask, or the first mask cannot be used.
    pub fn mask_tally(&self, sequence: &yfslam_io::Sequence, camera: &yfslam::Camera) -> Result<Option<MaskTally>> {
        let masks = self.masks.as_deref().map(|folder| Masks::open(folder, sequence, camera)).transpose()?;
        Ok(masks.map(|masks| masks.tally))
    }

    /// Selects a whole sequence, forward, with its own camera.
    pub fn new(sequence: String) -> Self {
        Self {
            sequence,
            camera: None,
            sensor: None,
            depth_factor: None,
            masks: None,
            layout: None,
            associations: None,
            color: None,
            depth: None,
            fps: None,
            association_tolerance: None,
            start: 0,
            end: None,
            reverse: false,
            faults: Vec::new(),
            bag: BagArgs::default(),
        }
    }

    /// Returns the requested source of depth: the flag overrides the configuration; `None` leaves the choice to the sequence.
    pub fn wanted_depth_source(&self, configured: DepthSource) -> Option<DepthSource> {
        match self.sensor {
            Some(SensorArg::Rgbd) => Some(DepthSource::Image),
            Some(SensorArg::Stereo) => Some(DepthSource::Stereo),
            Some(SensorArg::Mono) => Some(DepthSource::Motion),
            None => Some(configured).filter(|configured| *configured != DepthSource::Image),
        }
    }

    /// Returns the source of depth in a sequence that offers `offered`.
    ///
    /// # Errors
    /// The sequence does not have the requested images.
    pub fn depth_source(&self, configured: DepthSource, offered: DepthSource) -> Result<DepthSource> {
        let wanted = self.wanted_depth_source(configured).unwrap_or(offered);
        ensure!(
            wanted == offered || wanted == DepthSource::Motion,
            "{} has no {}; leave out --sensor {} (or depth.source in --config), or use `mono`",
            self.sequence,
            if wanted == DepthSource::Stereo { "right images" } else { "depth images" },
            if wanted == DepthSource::Stereo { "stereo" } else { "rgbd" }
        );
        Ok(wanted)
    }

    /// Returns the synthetic world with the requested camera.
    ///
    /// # Errors
    /// The name of the world or the camera cannot be used.
    pub fn world(&self) -> Result<WorldConfig> {
        if self.depth_factor.is_some() {
            bail!("a synthetic world has the depth factor of its camera; leave out --depth-factor");
        }
        if self.masks.is_some() {
            bail!("masks belong to the images of a folder; write the world with `yfslam synth` to run it with --masks");
        }
        if !self.bag.choice().is_empty() {
            bail!("a synthetic world has no topics; leave out --color-topic and the like");
        }
        let (camera, depth_factor) = match &self.camera {
            Some(spec) => load_camera(spec, None).map(|source| (source.camera, source.depth_factor))?,
            None => (default_camera(), WorldConfig::default().depth_factor),
        };
        Ok(parse_with_camera(&self.sequence, camera, depth_factor)?)
    }

    /// Returns whether boxes come with the sequence: from a synthetic world, or from a `boxes.json`.
    pub fn has_boxes(&self) -> bool {
        self.is_synthetic() || self.boxes_file().is_file()
    }

    pub fn boxes_file(&self) -> PathBuf {
        self.folder().join(BOXES_FILE)
    }

    /// Returns whether frames come from standard input.
    pub fn is_pipe(&self) -> bool {
        self.sequence == "-"
    }

    /// Returns whether the sequence is a synthetic world.
    pub fn is_synthetic(&self) -> bool {
        yfslam_synth::is_spec(&self.sequence)
    }

    /// Returns the folder of the sequence: the one that the user named, else that in which the folder of colour images is.
    pub fn folder(&self) -> &Path {
        let parent = self.color.as_deref().and_then(Path::parent).filter(|_| self.sequence.is_empty());
        let parent = parent.map(|parent| if parent.as_os_str().is_empty() { Path::new(".") } else { parent });
        parent.unwrap_or(Path::new(&self.sequence))
    }
}
