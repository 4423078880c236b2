//! Frames of a sequence in order, with injected faults.

use yfslam::config::DepthSource;
use yfslam::{DepthImage, Frame};
use yfslam_io::boxes::KnownDetections;
use yfslam_io::time::{TimeMirror, format_stamp};
use yfslam_io::{Delivery, FaultInjector, FrameStream};

use super::args::SourceArgs;
use super::folder;
use super::live::LivePlayer;
use super::masks::Masks;
use super::pipe::{self, Pipe};
use super::synth::Renderer;
use crate::stats::skip::Skip;
use crate::stats::stages::Stages;

/// Frames in order, with injected faults.
pub struct Frames {
    pub player: Player,
    faults: FaultInjector,
    depth_source: DepthSource,
}

/// Where frames come from.
pub enum Player {
    /// Files of a recording.
    Folder(Box<(FrameStream, FolderExtras)>),
    /// A synthetic world.
    Synth(Renderer),
    /// Another program, on standard input.
    Pipe(Box<Pipe>),
    /// Any of these, when it is time for its frames.
    Live(Box<LivePlayer>),
}

/// Boxes and masks that belong to the frames of a recording.
pub struct FolderExtras {
    pub boxes: Option<KnownDetections>,
    pub mirror: Option<TimeMirror>,
    pub masks: Option<Masks>,
}

impl Frames {
    pub fn new(player: Player, depth_source: DepthSource, args: &SourceArgs, stamps_ns: &[i64]) -> Self {
        let first_ns = stamps_ns.first().copied().unwrap_or(0);
        Self { player, faults: FaultInjector::new(args.faults.clone(), first_ns), depth_source }
    }

    /// Hands these frames to `start`, and plays what it delivers.
    ///
    /// # Errors
    /// As `start`.
    pub fn into_live(self, start: impl FnOnce(Self) -> anyhow::Result<LivePlayer>) -> anyhow::Result<Self> {
        let depth_source = self.depth_source;
        let player = Player::Live(Box::new(start(self)?));
        // Faults were injected before it was time for the frames.
        Ok(Self { player, faults: FaultInjector::new(Vec::new(), 0), depth_source })
    }

    /// Returns whether frames come when it is time for them.
    pub fn is_live(&self) -> bool {
        matches!(self.player, Player::Live(_))
    }

    /// Returns the next frame, or why it cannot be used; `None` at the end. Adds the durations of reading to `stages`.
    pub fn next(&mut self, stages: &mut Stages) -> Option<Result<Frame, Skip>> {
        loop {
            if let Some(delivery) = self.faults.pop() {
                return Some(usable(delivery, self.depth_source));
            }
            let frame = match &mut self.player {
                Player::Folder(recording) => folder::next(&mut recording.0, &recording.1, stages),
                Player::Synth(renderer) => renderer.next(stages).map(Ok),
                Player::Pipe(pipe) => pipe::next(pipe),
                Player::Live(live) => live.next(stages),
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

/// Refuses a frame without a time stamp, or with a depth image without any measurement.
fn usable(Delivery { frame, has_stamp }: Delivery, depth_source: DepthSource) -> Result<Frame, Skip> {
    let skip = |reason, problem: &str| {
        Err(Skip { reason, message: format!("the frame at t = {} {problem}", format_stamp(frame.timestamp_ns)) })
    };
    if !has_stamp {
        return skip("no time stamp", "came with a time stamp that is not a number");
    }
    let is_empty = |depth: &DepthImage| depth.raw.data().iter().all(|&raw| raw == 0);
    if depth_source == DepthSource::Image && frame.depth.as_deref().is_none_or(is_empty) {
        return skip("no depth in any pixel", "has no depth in any pixel");
    }
    Ok(frame)
}
