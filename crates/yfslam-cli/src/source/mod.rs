//! Where frames come from: a recorded folder or the synthetic world, decoded or rendered ahead of their use.
//!
//! In: what the user named. Out: a [`Source`], which a SLAM system may see, and the truth, which it may not.

mod folder;
mod synth;

use std::path::Path;

use anyhow::{Result, bail};
use clap::Args;
use yfslam::RgbdFrame;
use yfslam_eval::StampedPose;
use yfslam_io::sequence::AssociationReport;
use yfslam_io::time::TimeMirror;
use yfslam_io::trajectory::mirror_trajectory;
use yfslam_io::{CameraSource, FrameStream};

use crate::accuracy::{read_poses, to_eval};
use crate::pipeline::Stages;
use crate::terminal::Terminal;
pub use folder::{camera, open_sequence};
pub use synth::{Renderer, world_camera};

/// How far apart a colour and a depth image may be. Source: the tool of the TUM RGB-D benchmark.
const ASSOCIATION_TOLERANCE_MS: f64 = 20.0;

/// Which sequence, and how it is read.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Input")]
pub struct SourceArgs {
    /// A folder in TUM RGB-D or Bonn layout, or a synthetic world such as `synth:walking_xyz?seed=7`.
    #[arg(value_name = "SEQUENCE", help_heading = None)]
    pub sequence: String,
    /// The camera: tum1, tum2, tum3, bonn, or a settings file (ORB-SLAM's YAML or our TOML) [default: camera.toml or camera.yaml in
    /// the folder].
    #[arg(long, value_name = "PRESET|FILE")]
    pub camera: Option<String>,
    /// Depth units per metre, instead of the camera's: 5000 for TUM and Bonn, 1000 for millimetres.
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    pub depth_factor: Option<f64>,
    /// How far apart a colour and a depth image may be, ms.
    #[arg(long, value_name = "MS", default_value_t = ASSOCIATION_TOLERANCE_MS, allow_negative_numbers = true)]
    pub association_tolerance: f64,
    /// First frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    pub start: usize,
    /// Frame to stop before [default: the end].
    #[arg(long, value_name = "J")]
    pub end: Option<usize>,
    /// Play backward: frames in reverse order, time stamps mirrored.
    #[arg(long)]
    pub reverse: bool,
}

/// A sequence ready to play.
pub struct Source {
    /// Short name, for folders and tables.
    pub name: String,
    /// The camera, checked.
    pub camera: CameraSource,
    /// The frames, in order.
    pub frames: Frames,
    /// Stamps of all frames, also of those that will turn out unusable, ns.
    pub stamps_ns: Vec<i64>,
    /// What was left out when colour and depth were paired; `None` for synthetic worlds.
    pub association: Option<AssociationReport>,
    /// Set when the sequence is played backward.
    pub mirror: Option<TimeMirror>,
}

/// Where the camera really was.
pub struct Truth {
    /// Where this is known from.
    pub origin: String,
    /// World from camera; stamps ascend strictly.
    pub poses: Vec<StampedPose>,
}

/// A frame that cannot be used.
#[derive(Clone, Debug)]
pub struct Skip {
    /// Kind of fault, for counting.
    pub reason: &'static str,
    /// Frame, file, fault and cure.
    pub message: String,
}

/// Frames, one after another.
pub enum Frames {
    /// Decoded from files.
    Folder(FrameStream),
    /// Rendered.
    Synth(Renderer),
}

impl Frames {
    /// The next frame, or why it cannot be used; `None` at the end. Notes in `stages` what it took to get it.
    pub fn next(&mut self, stages: &mut Stages) -> Option<Result<RgbdFrame, Skip>> {
        match self {
            Self::Folder(stream) => folder::next(stream, stages),
            Self::Synth(renderer) => renderer.next(stages).map(Ok),
        }
    }
}

impl SourceArgs {
    /// All of a sequence, forward, with its own camera.
    pub fn new(sequence: String) -> Self {
        Self {
            sequence,
            camera: None,
            depth_factor: None,
            association_tolerance: ASSOCIATION_TOLERANCE_MS,
            start: 0,
            end: None,
            reverse: false,
        }
    }

    /// Opens the sequence. A synthetic world brings its own boxes if `own_boxes` asks for them.
    ///
    /// # Errors
    /// What cannot be read, with file, value and cure.
    pub fn open(&self, own_boxes: bool) -> Result<Source> {
        if !self.is_synthetic() {
            return folder::open(self);
        }
        if self.camera.is_some() || self.depth_factor.is_some() {
            bail!("a synthetic world brings its own camera; leave out --camera and --depth-factor");
        }
        synth::open(self, own_boxes)
    }

    /// Whether a synthetic world was named.
    pub fn is_synthetic(&self) -> bool {
        yfslam_synth::is_spec(&self.sequence)
    }

    fn folder(&self) -> &Path {
        Path::new(&self.sequence)
    }
}

impl Source {
    /// The exact truth that a synthetic world knows.
    pub fn truth_of_world(&self) -> Option<Truth> {
        match &self.frames {
            Frames::Synth(renderer) => Some(renderer.truth()),
            Frames::Folder(_) => None,
        }
    }

    /// The truth to judge an estimate by: a file, the folder's own `groundtruth.txt`, or the synthetic world's.
    ///
    /// # Errors
    /// The file cannot be read or holds values that are no pose.
    pub fn truth(&self, args: &SourceArgs, file: Option<&Path>, terminal: Terminal) -> Result<Option<Truth>> {
        let beside = || Some(args.folder().join("groundtruth.txt")).filter(|path| path.is_file());
        let path = match (file, self.truth_of_world()) {
            (None, Some(truth)) => return Ok(Some(truth)),
            (Some(file), _) => file.to_owned(),
            (None, None) => match beside() {
                Some(path) => path,
                None => return Ok(None),
            },
        };
        let mut poses = read_poses(&path, terminal)?;
        if let Some(mirror) = self.mirror {
            poses = mirror_trajectory(&poses, mirror);
        }
        Ok(Some(Truth { origin: path.display().to_string(), poses: to_eval(&poses) }))
    }
}
