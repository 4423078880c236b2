//! Where frames come from: a recorded folder or the synthetic world, decoded or rendered ahead of their use.
//!
//! In: what the user named. Out: a [`Source`], which a SLAM system may see, and the truth, which it may not.

mod folder;
mod masks;
mod synth;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use clap::{Args, ValueEnum};
use yfslam::RgbdFrame;
use yfslam::config::DepthSource;
use yfslam_eval::StampedPose;
use yfslam_io::boxes::{BOXES_FILE, KnownDetections};
use yfslam_io::sequence::{AssociationReport, GroundTruthReader};
use yfslam_io::time::{TimeMirror, format_stamp};
use yfslam_io::trajectory::mirror_trajectory;
use yfslam_io::{CameraSource, Delivery, Fault, FaultInjector, FrameStream, TrajectoryFile, load_camera};
use yfslam_synth::{WorldConfig, default_camera, parse_with_camera};

use crate::accuracy::{checked_poses, to_eval};
use crate::pipeline::Stages;
use crate::terminal::Terminal;
pub use folder::open_sequence;
pub use masks::MaskTally;
use masks::Masks;
pub use synth::{Renderer, world_camera};

/// How far apart a colour and a depth image may be. Source: the tool of the TUM RGB-D benchmark.
const ASSOCIATION_TOLERANCE_MS: f64 = 20.0;

/// Which sequence, and how it is read.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Input")]
pub struct SourceArgs {
    /// A folder in TUM RGB-D, Bonn, EuRoC or KITTI odometry layout, or a synthetic world such as `synth:walking_xyz?seed=7`.
    #[arg(value_name = "SEQUENCE", help_heading = None)]
    pub sequence: String,
    /// The camera: tum1, tum2, tum3, bonn, or a settings file (ORB-SLAM's YAML or our TOML) [default: camera.toml or camera.yaml in
    /// the folder, or EuRoC's and KITTI's own calibration]. A synthetic world is rendered for it.
    #[arg(long, value_name = "PRESET|FILE")]
    pub camera: Option<String>,
    /// What the camera measures [default: what the sequence has]. `mono` leaves depth, or the right pictures, unused.
    #[arg(long, value_enum, value_name = "SENSOR")]
    pub sensor: Option<SensorArg>,
    /// Depth units per metre, instead of the camera's: 5000 for TUM and Bonn, 1000 for millimetres.
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    pub depth_factor: Option<f64>,
    /// How far apart a colour image and its depth image or right picture may be, ms.
    #[arg(long, value_name = "MS", default_value_t = ASSOCIATION_TOLERANCE_MS, allow_negative_numbers = true)]
    pub association_tolerance: f64,
    /// Masks of movable objects, a PNG for each colour image and named like it (or by its time, or listed in `masks.txt`): 0 where
    /// there is none. Methods `ds`, `dyna` and `full` use them, and then need no boxes.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// First frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    pub start: usize,
    /// Frame to stop before [default: the end].
    #[arg(long, value_name = "J")]
    pub end: Option<usize>,
    /// Play backward: frames in reverse order, time stamps mirrored.
    #[arg(long)]
    pub reverse: bool,
    /// Put a fault into the frames, from START seconds on for SECONDS: dropped, repeated, blank, black, frozen, late, depth-dropout,
    /// nan-stamp or covered; can be given several times.
    #[arg(long = "fault", value_name = "KIND@START+SECONDS")]
    pub faults: Vec<Fault>,
}

/// What a camera measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SensorArg {
    /// Colour and depth.
    Rgbd,
    /// Two pictures, left and right.
    Stereo,
    /// One picture; the scale of the trajectory is arbitrary.
    Mono,
}

/// A sequence ready to play.
pub struct Source {
    /// Short name, for folders and tables.
    pub name: String,
    /// The camera, checked.
    pub camera: CameraSource,
    /// Where depth comes from.
    pub depth_source: DepthSource,
    /// The frames, in order.
    pub frames: Frames,
    /// Stamps of all frames, also of those that will turn out unusable, ns.
    pub stamps_ns: Vec<i64>,
    /// What was left out when colour images and their companions were paired; `None` for synthetic worlds.
    pub association: Option<AssociationReport>,
    /// Which frames have a mask, where masks were asked for.
    pub masks: Option<MaskTally>,
    /// Reads ground truth in the format of the folder; `None` for synthetic worlds.
    pub truth_reader: Option<GroundTruthReader>,
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

/// Frames, one after another, with the faults that were asked for.
pub struct Frames {
    player: Player,
    faults: FaultInjector,
    depth_source: DepthSource,
}

/// What frames are made of.
enum Player {
    /// Files.
    Folder(FrameStream, Box<FolderKnowledge>),
    /// A world.
    Synth(Renderer),
}

/// What is known about the frames of a folder besides their images.
struct FolderKnowledge {
    boxes: Option<KnownDetections>,
    mirror: Option<TimeMirror>,
    masks: Option<Masks>,
}

impl Frames {
    fn new(player: Player, depth_source: DepthSource, args: &SourceArgs, stamps_ns: &[i64]) -> Self {
        let first_ns = stamps_ns.first().copied().unwrap_or(0);
        Self { player, faults: FaultInjector::new(args.faults.clone(), first_ns), depth_source }
    }

    /// The next frame, or why it cannot be used; `None` at the end. Notes in `stages` what it took to get it.
    pub fn next(&mut self, stages: &mut Stages) -> Option<Result<RgbdFrame, Skip>> {
        loop {
            if let Some(delivery) = self.faults.pop() {
                return Some(usable(delivery, self.depth_source));
            }
            let frame = match &mut self.player {
                Player::Folder(stream, known) => folder::next(stream, known, stages),
                Player::Synth(renderer) => renderer.next(stages).map(Ok),
            };
            match frame {
                Some(Ok(frame)) => self.faults.push(frame),
                Some(Err(skip)) => return Some(Err(skip)),
                None => {
                    self.faults.finish();
                    return self.faults.pop().map(|delivery| usable(delivery, self.depth_source));
                }
            }
        }
    }
}

/// Refuses a frame without a time, or without any depth where that comes from an image.
fn usable(Delivery { frame, has_stamp }: Delivery, depth_source: DepthSource) -> Result<RgbdFrame, Skip> {
    let skip = |reason, problem: &str| {
        Err(Skip { reason, message: format!("the frame at t = {} {problem}", format_stamp(frame.timestamp_ns)) })
    };
    if !has_stamp {
        return skip("no time stamp", "came with a time stamp that is not a number");
    }
    if depth_source == DepthSource::Image && frame.depth.raw.data().iter().all(|&raw| raw == 0) {
        return skip("no depth in any pixel", "has no depth in any pixel");
    }
    Ok(frame)
}

impl SourceArgs {
    /// Which frames of a recording have a mask, where masks were asked for.
    ///
    /// # Errors
    /// There is none, or the first cannot be used.
    pub fn mask_tally(&self, sequence: &yfslam_io::Sequence, camera: &yfslam::Camera) -> Result<Option<MaskTally>> {
        let masks = self.masks.as_deref().map(|folder| Masks::open(folder, sequence, camera)).transpose()?;
        Ok(masks.map(|masks| masks.tally))
    }

    /// All of a sequence, forward, with its own camera.
    pub fn new(sequence: String) -> Self {
        Self {
            sequence,
            camera: None,
            sensor: None,
            depth_factor: None,
            masks: None,
            association_tolerance: ASSOCIATION_TOLERANCE_MS,
            start: 0,
            end: None,
            reverse: false,
            faults: Vec::new(),
        }
    }

    /// Opens the sequence for what `configured` says of depth, if no flag does. Frames bring the boxes that the world or the folder
    /// knows, of the classes that `own_boxes` names.
    ///
    /// # Errors
    /// What cannot be read, with file, value and cure.
    pub fn open(&self, configured: DepthSource, own_boxes: Option<&[String]>) -> Result<Source> {
        if self.is_synthetic() {
            synth::open(self, configured, own_boxes)
        } else {
            folder::open(self, configured, own_boxes)
        }
    }

    /// Where depth is to come from: the flag wins over the configuration, and that, if it asks for anything special, over what the
    /// sequence has (`None`).
    fn wanted_depth_source(&self, configured: DepthSource) -> Option<DepthSource> {
        match self.sensor {
            Some(SensorArg::Rgbd) => Some(DepthSource::Image),
            Some(SensorArg::Stereo) => Some(DepthSource::Stereo),
            Some(SensorArg::Mono) => Some(DepthSource::Motion),
            None => Some(configured).filter(|configured| *configured != DepthSource::Image),
        }
    }

    /// Where depth comes from in a sequence that has what is `offered`.
    ///
    /// # Errors
    /// The sequence does not have what was asked for.
    fn depth_source(&self, configured: DepthSource, offered: DepthSource) -> Result<DepthSource> {
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

    /// The world that was named, for the camera that was asked for.
    ///
    /// # Errors
    /// The spec or the camera cannot be used.
    pub fn world(&self) -> Result<WorldConfig> {
        if self.depth_factor.is_some() {
            bail!("a synthetic world has the depth factor of its camera; leave out --depth-factor");
        }
        if self.masks.is_some() {
            bail!("masks belong to the images of a folder; write the world with `yfslam synth` to run it with --masks");
        }
        let camera = match &self.camera {
            Some(spec) => load_camera(spec, None)?.camera,
            None => default_camera(),
        };
        Ok(parse_with_camera(&self.sequence, camera)?)
    }

    /// Whether boxes are known without a detector: by a synthetic world, or from a `boxes.json`.
    pub fn knows_boxes(&self) -> bool {
        self.is_synthetic() || self.boxes_file().is_file()
    }

    fn boxes_file(&self) -> PathBuf {
        self.folder().join(BOXES_FILE)
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
        match &self.frames.player {
            Player::Synth(renderer) => Some(renderer.truth()),
            Player::Folder(..) => None,
        }
    }

    /// The truth to judge an estimate by: a file, the folder's own, or the synthetic world's.
    ///
    /// # Errors
    /// The file cannot be read or holds values that are no pose.
    pub fn truth(&self, file: Option<&Path>, terminal: Terminal) -> Result<Option<Truth>> {
        let reader = self.truth_reader.as_ref();
        let path = match (file, self.truth_of_world()) {
            (None, Some(truth)) => return Ok(Some(truth)),
            (Some(file), _) => file,
            (None, None) => match reader.and_then(GroundTruthReader::path) {
                Some(path) => path,
                None => return Ok(None),
            },
        };
        let read = reader.map_or_else(|| TrajectoryFile::read(path), |reader| reader.read(path))?;
        let mut poses = checked_poses(read, path, terminal);
        if let Some(mirror) = self.mirror {
            poses = mirror_trajectory(&poses, mirror);
        }
        Ok(Some(Truth { origin: path.display().to_string(), poses: to_eval(&poses) }))
    }
}
