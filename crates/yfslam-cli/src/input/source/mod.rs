//! Where frames come from: a recording or a synthetic world, decoded or rendered ahead of their use.
//!
//! In: options of the user. Out: a [`Source`] for the SLAM system, and the ground truth, which the system does not get.

mod args;
mod bag;
mod folder;
mod frames;
mod live;
mod masks;
mod pipe;
mod synth;

use std::path::Path;

use anyhow::Result;
use yfslam::Camera;
use yfslam::config::DepthSource;
use yfslam_eval::StampedPose;
use yfslam_io::sequence::{AssociationReport, GroundTruthReader, UsedTopics};
use yfslam_io::time::TimeMirror;
use yfslam_io::trajectory::mirror_trajectory;
use yfslam_io::{CameraSource, TrajectoryFile};

use crate::input::trajectory::checked_poses;
use crate::ui::interrupt::Interrupt;
use crate::ui::terminal::Terminal;
pub use args::{SensorArg, SourceArgs};
pub use bag::{BagArgs, describe as describe_bag};
pub use folder::open_sequence;
use frames::{Frames, Player};
use live::LivePlayer;
pub use masks::MaskTally;
pub use synth::world_camera;

/// A sequence that is ready to be played.
pub struct Source {
    /// Short name, for folders and tables.
    pub name: String,
    /// What the sequence was taken for, and what was assumed, one sentence each.
    pub notes: Vec<String>,
    /// What is probably a mistake, one sentence each.
    pub warnings: Vec<String>,
    /// The camera, checked.
    pub camera: CameraSource,
    /// Where depth comes from.
    pub depth_source: DepthSource,
    /// The frames, in order.
    pub frames: Frames,
    /// Time stamps of all frames, also of those that will turn out to be unusable, ns.
    pub stamps_ns: Vec<i64>,
    /// Result of pairing colour images with depth or right images; `None` for synthetic worlds.
    pub association: Option<AssociationReport>,
    /// The topics in use; `None` unless the sequence is a bag.
    pub topics: Option<UsedTopics>,
    /// Which frames have a mask; `None` without `--masks`.
    pub masks: Option<MaskTally>,
    /// Reads ground truth in the format of the folder; `None` for synthetic worlds.
    pub truth_reader: Option<GroundTruthReader>,
    /// Mirrors time stamps if the sequence is played in reverse.
    pub mirror: Option<TimeMirror>,
}

/// Turns the shutter of a camera around: when time runs backward, the row that was read last comes first.
pub fn reverse_readout(camera: &mut Camera) {
    for ms in [&mut camera.readout_ms, &mut camera.depth_readout_ms, &mut camera.depth_delay_ms] {
        // Not the negative value, which would make -0 of 0.
        *ms = ms.map(|ms| 0.0 - ms);
    }
}

/// The true trajectory.
pub struct Truth {
    /// File, or synthetic world.
    pub origin: String,
    /// World from camera; time stamps ascend strictly.
    pub poses: Vec<StampedPose>,
}

impl Source {
    /// Opens a sequence; depth comes from `configured` unless a flag says otherwise. Frames carry the boxes of the synthetic world or of
    /// the folder for the classes `own_boxes`.
    ///
    /// # Errors
    /// Input that cannot be read, with file, value and what to do.
    pub fn open(args: &SourceArgs, configured: DepthSource, own_boxes: Option<&[String]>) -> Result<Self> {
        let mut source = if args.is_synthetic() {
            synth::open(args, configured, own_boxes)?
        } else if args.is_pipe() {
            pipe::open(args, configured)?
        } else {
            folder::open(args, configured, own_boxes)?
        };
        if source.mirror.is_some() {
            reverse_readout(&mut source.camera.camera);
        }
        Ok(source)
    }

    /// Plays the frames when it is time for them; see [`LivePlayer::start`]. Frames of a pipe come as they are sent.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn play_live(mut self, rate: f64, interrupt: &Interrupt, terminal: Terminal) -> Result<Self> {
        let rate = if matches!(self.frames.player, Player::Pipe(..)) { None } else { Some(rate) };
        self.frames = self.frames.into_live(|frames| LivePlayer::start(frames, rate, interrupt.clone(), terminal))?;
        Ok(self)
    }

    /// Returns the exact trajectory of a synthetic world.
    fn truth_of_world(&self) -> Option<Truth> {
        match &self.frames.player {
            Player::Synth(renderer) => Some(renderer.truth()),
            Player::Folder(..) | Player::Pipe(..) | Player::Live(..) => None,
        }
    }

    /// Returns the ground truth: from `file`, else from the folder or the synthetic world.
    ///
    /// # Errors
    /// The file cannot be read or holds values that are not a pose.
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
        Ok(Some(Truth { origin: path.display().to_string(), poses }))
    }
}
