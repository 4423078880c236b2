//! Takes a synthetic world through SLAM with a dense map.

use std::time::Instant;

use anyhow::Result;
use rayon::prelude::*;
use yfslam::dense::{DenseConfig, DenseMapper, Survey};
use yfslam::dynamic::Method;
use yfslam::{Config, Execution, RgbdFrame, Slam};
use yfslam_synth::{CLASS_NAMES, World};

/// Frames that are rendered at once.
const BATCH: usize = 32;

/// How a world is taken.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// What keeps moving things out.
    pub method: Method,
    /// Whether loops are closed.
    pub loops: bool,
}

/// What came of it.
pub struct Taken {
    pub survey: Survey,
    /// Wall time for each keyframe, ms: piece and volume.
    pub each_ms: f64,
    /// Memory of pieces and volume at the end.
    pub bytes: usize,
}

/// A system at work.
struct Taker {
    config: Config,
    slam: Slam,
    mapper: DenseMapper,
    seconds: f64,
    keyframes: usize,
    resets: usize,
}

/// The dense maps of a world taken in several ways, as `yfslam run --dense` makes them. Each frame is rendered once.
pub fn take(world: &World, ways: &[Way], dense: &DenseConfig) -> Result<Vec<Taken>> {
    let mut takers = ways.iter().map(|way| Taker::new(*way, world, dense)).collect::<Result<Vec<_>>>()?;
    for start in (0..world.len()).step_by(BATCH) {
        let shoot = |index| world.frame(index).frame;
        let frames: Vec<RgbdFrame> = (start..(start + BATCH).min(world.len())).into_par_iter().map(shoot).collect();
        for taker in &mut takers {
            frames.iter().try_for_each(|frame| taker.see(frame.clone()))?;
        }
    }
    Ok(takers.into_iter().map(Taker::finish).collect())
}

impl Taker {
    fn new(way: Way, world: &World, dense: &DenseConfig) -> Result<Self> {
        let mut config = Config::default();
        config.dynamic.method = way.method;
        config.loops.enabled = way.loops;
        let camera = &world.config().camera;
        let slam = Slam::new(config.clone(), camera, None)?;
        let mapper = DenseMapper::new(dense, camera, Execution::Inline)?;
        Ok(Self { config, slam, mapper, seconds: 0.0, keyframes: 0, resets: 0 })
    }

    fn see(&mut self, mut frame: RgbdFrame) -> Result<()> {
        let movable = |class: usize| self.config.dynamic.movable.iter().any(|name| name == CLASS_NAMES[class]);
        frame.detections.iter_mut().for_each(|boxes| boxes.retain(|b| movable(b.class)));
        let Self { slam, mapper, .. } = self;
        let tracked = slam.track(&frame)?;
        if slam.resets() > self.resets {
            self.resets = slam.resets();
            mapper.clear();
        }
        let Some(tie) = slam.last_frame().reference.filter(|_| tracked.is_keyframe) else { return Ok(()) };
        if mapper.is_due(frame.timestamp_ns, &slam.last_frame().t_cam_world.inverse()) {
            let started = Instant::now();
            let moving = slam.moving_mask(&frame.depth);
            let piece = mapper.cut(&frame.color, &frame.depth, |at, edge| moving.covers(&frame.depth, at, edge));
            mapper.hang(frame.timestamp_ns, tie, piece, slam.map());
            self.seconds += started.elapsed().as_secs_f64();
            self.keyframes += 1;
        }
        Ok(())
    }

    fn finish(mut self) -> Taken {
        let map = self.slam.map();
        let bytes = self.mapper.bytes() + self.mapper.volume(map).bytes();
        let each_ms = self.seconds * 1e3 / self.keyframes.max(1) as f64;
        Taken { survey: self.mapper.into_survey(map), each_ms, bytes }
    }
}
