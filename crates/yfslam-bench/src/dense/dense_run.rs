//! SLAM with a dense map on a rendered world.

use std::time::Instant;

use anyhow::Result;
use rayon::prelude::*;
use yfslam::dense::{DenseConfig, DenseMapper, Survey};
use yfslam::dynamic::Method;
use yfslam::{Config, Execution, RgbdFrame, Slam};
use yfslam_synth::{CLASS_NAMES, World};

/// Frames that are rendered at once.
const BATCH: usize = 32;

/// The settings of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    pub method: Method,
    /// Whether loops are closed.
    pub loops: bool,
}

/// The dense map of a run and what it took.
pub struct DenseRun {
    pub survey: Survey,
    /// Wall time for each keyframe that became a keyframe patch, ms.
    pub ms_per_keyframe: f64,
    /// Memory of keyframe patches and volume at the end.
    pub bytes: usize,
}

/// A run under way.
struct Runner {
    config: Config,
    slam: Slam,
    mapper: DenseMapper,
    seconds: f64,
    keyframes: usize,
    resets: usize,
}

/// Takes a world through SLAM with several settings, as `yfslam run --dense` does. Each frame is rendered once.
pub fn run_all(world: &World, options: &[RunOptions], dense: &DenseConfig) -> Result<Vec<DenseRun>> {
    let mut runners = options.iter().map(|options| Runner::new(*options, world, dense)).collect::<Result<Vec<_>>>()?;
    for start in (0..world.len()).step_by(BATCH) {
        let render = |index| world.frame(index).frame;
        let frames: Vec<RgbdFrame> = (start..(start + BATCH).min(world.len())).into_par_iter().map(render).collect();
        for runner in &mut runners {
            frames.iter().try_for_each(|frame| runner.track(frame.clone()))?;
        }
    }
    Ok(runners.into_iter().map(Runner::finish).collect())
}

impl Runner {
    fn new(options: RunOptions, world: &World, dense: &DenseConfig) -> Result<Self> {
        let mut config = Config::default();
        config.dynamic.method = options.method;
        config.loops.enabled = options.loops;
        let camera = &world.config().camera;
        let slam = Slam::new(config.clone(), camera, None)?;
        let mapper = DenseMapper::new(dense, camera, Execution::Inline)?;
        Ok(Self { config, slam, mapper, seconds: 0.0, keyframes: 0, resets: 0 })
    }

    fn track(&mut self, mut frame: RgbdFrame) -> Result<()> {
        let movable = |class: usize| self.config.dynamic.movable.iter().any(|name| name == CLASS_NAMES[class]);
        frame.detections.iter_mut().for_each(|boxes| boxes.retain(|b| movable(b.class)));
        let Self { slam, mapper, .. } = self;
        let tracked = slam.track(&frame)?;
        if slam.resets() > self.resets {
            self.resets = slam.resets();
            mapper.clear();
        }
        let Some(anchor) = slam.last_frame().reference.filter(|_| tracked.is_keyframe) else { return Ok(()) };
        if mapper.is_due(frame.timestamp_ns, &slam.last_frame().t_cam_world.inverse()) {
            let started = Instant::now();
            let moving = slam.moving_mask(&frame.depth);
            let patch = mapper.cut(&frame.color, &frame.depth, |at, edge| moving.covers(&frame.depth, at, edge));
            mapper.hang(frame.timestamp_ns, anchor, patch, slam.map());
            self.seconds += started.elapsed().as_secs_f64();
            self.keyframes += 1;
        }
        Ok(())
    }

    fn finish(mut self) -> DenseRun {
        let map = self.slam.map();
        let bytes = self.mapper.bytes() + self.mapper.volume(map).bytes();
        let ms_per_keyframe = self.seconds * 1e3 / self.keyframes.max(1) as f64;
        DenseRun { survey: self.mapper.into_survey(map), ms_per_keyframe, bytes }
    }
}
