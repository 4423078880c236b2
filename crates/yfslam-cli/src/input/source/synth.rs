//! The synthetic world, rendered on threads of its own, a few frames ahead of their use.

use std::ops::Range;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use yfslam::Frame;
use yfslam::config::DepthSource;
use yfslam_eval::StampedPose;
use yfslam_io::CameraSource;
use yfslam_io::time::TimeMirror;
use yfslam_synth::{CLASS_NAMES, World, WorldConfig};

use super::args::SourceArgs;
use super::frames::{Frames, Player};
use super::{Source, Truth};
use crate::stats::stages::Stages;

/// Frames that are rendered ahead.
const LOOK_AHEAD: usize = 4;

/// Plays a part of a world, forward or in reverse.
pub struct Renderer {
    world: Arc<World>,
    part: Part,
    /// `None` only while dropping.
    frames: Option<Receiver<(Frame, Duration)>>,
    thread: Option<JoinHandle<()>>,
}

/// The frames that are played, and in which direction.
#[derive(Clone)]
struct Part {
    range: Range<usize>,
    mirror: Option<TimeMirror>,
}

/// Builds the world and starts to render it.
pub fn open(args: &SourceArgs, configured: DepthSource, own_boxes: Option<&[String]>) -> Result<Source> {
    let mut config = args.world()?;
    let offered = if config.stereo_m > 0.0 { DepthSource::Stereo } else { DepthSource::Image };
    let depth_source = args.depth_source(configured, offered)?;
    config.detections = own_boxes.is_some();
    let count = config.frames;
    let range = args.start..args.end.unwrap_or(count).min(count);
    ensure!(
        !range.is_empty(),
        "{}: there are no frames from {} to {}, for it has {count} frames; choose a smaller start or a larger end",
        args.sequence,
        args.start,
        args.end.map_or("the end".to_owned(), |end| end.to_string())
    );
    name_render_threads();
    let world = Arc::new(World::new(&config)?);
    let span = TimeMirror { first_ns: world.timestamp_ns(range.start), last_ns: world.timestamp_ns(range.end - 1) };
    let part = Part { range, mirror: args.reverse.then_some(span) };
    let stamps_ns: Vec<i64> = part.indices().map(|index| part.stamp_ns(&world, index)).collect();
    let (name, _) = yfslam_synth::split(&args.sequence);
    let wanted = own_boxes.unwrap_or_default();
    let classes =
        (0..CLASS_NAMES.len()).filter(|&class| wanted.iter().any(|name| name == CLASS_NAMES[class])).collect();
    let renderer = Renderer::start(world, part.clone(), classes)?;
    Ok(Source {
        name: name.into(),
        notes: Vec::new(),
        warnings: Vec::new(),
        camera: world_camera(&config),
        mirror: part.mirror,
        depth_source,
        frames: Frames::new(Player::Synth(renderer), depth_source, args, &stamps_ns),
        stamps_ns,
        topics: None,
        association: None,
        truth_reader: None,
        masks: None,
    })
}

/// Names the threads that render, so that their processor time can be measured apart from that of other threads.
fn name_render_threads() {
    // Fails only if the threads exist already, and then they stay as they are.
    let _ = rayon::ThreadPoolBuilder::new().thread_name(|index| format!("yfslam-render-{index}")).build_global();
}

/// Returns the camera of a world.
pub fn world_camera(config: &WorldConfig) -> CameraSource {
    CameraSource::new(config.camera.clone(), config.depth_factor, "synthetic world")
}

impl Part {
    /// Returns the indices of frames in the order in which they are played.
    fn indices(&self) -> impl Iterator<Item = usize> + use<> {
        let Range { start, end } = self.range;
        let reverse = self.mirror.is_some();
        self.range.clone().map(move |index| if reverse { end - 1 - (index - start) } else { index })
    }

    fn stamp_ns(&self, world: &World, index: usize) -> i64 {
        self.played_ns(world.timestamp_ns(index))
    }

    /// Returns the time at which what happens in the world at `stamp_ns` is played.
    fn played_ns(&self, stamp_ns: i64) -> i64 {
        self.mirror.map_or(stamp_ns, |mirror| mirror.apply(stamp_ns))
    }
}

impl Renderer {
    /// Starts to render; only boxes of `classes` are kept.
    fn start(world: Arc<World>, part: Part, classes: Vec<usize>) -> Result<Self> {
        let (sender, frames) = sync_channel(LOOK_AHEAD);
        let (rendered, played) = (world.clone(), part.clone());
        let render = move || {
            for index in played.indices() {
                let started = Instant::now();
                let mut frame = rendered.frame(index).frame;
                frame.detections.iter_mut().for_each(|boxes| boxes.retain(|b| classes.contains(&b.class)));
                frame.timestamp_ns = played.played_ns(frame.timestamp_ns);
                frame.depth_timestamp_ns = frame.depth_timestamp_ns.map(|stamp_ns| played.played_ns(stamp_ns));
                // The receiver is gone because the run has ended.
                if sender.send((frame, started.elapsed())).is_err() {
                    return;
                }
            }
        };
        let thread = std::thread::Builder::new()
            .name("yfslam-render".into())
            .spawn(render)
            .context("cannot start the thread of the renderer; raise the limit of threads of this user")?;
        Ok(Self { world, part, frames: Some(frames), thread: Some(thread) })
    }

    /// Waits for the next frame.
    pub fn next(&mut self, stages: &mut Stages) -> Option<Frame> {
        let requested = Instant::now();
        let (frame, took) = self.frames.as_ref()?.recv().ok()?;
        stages.push("render", took);
        stages.push("render wait", requested.elapsed());
        Some(frame)
    }

    /// Returns the exact poses of all frames that are played.
    pub fn truth(&self) -> Truth {
        let pose = |index| StampedPose::new(self.part.stamp_ns(&self.world, index), self.world.pose(index));
        Truth { origin: "the synthetic world".into(), poses: self.part.indices().map(pose).collect() }
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        self.frames = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the renderer has been reported by its thread.
            let _ = thread.join();
        }
    }
}
