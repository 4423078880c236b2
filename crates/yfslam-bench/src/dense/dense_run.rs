//! SLAM with a dense map on a rendered world.

use anyhow::Result;
use rayon::prelude::*;
use yfslam::dense::{DenseConfig, DenseMap};
use yfslam::{Config, Frame, Method, Slam};
use yfslam_synth::{CLASS_NAMES, World};

/// Frames that are rendered at once.
const BATCH: usize = 32;

/// The settings of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// The dynamic filter.
    pub method: Method,
    /// Whether loops are closed.
    pub loops: bool,
}

/// The dense map of a run and what it took.
pub struct DenseRun {
    /// The dense map.
    pub map: DenseMap,
    /// Wall time for each keyframe that has a patch, ms.
    pub ms_per_keyframe: f64,
    /// Memory of keyframe patches and volume at the end.
    pub bytes: usize,
}

/// A run under way.
struct Runner {
    config: Config,
    slam: Slam,
    seconds: f64,
    keyframes: usize,
}

/// Takes a world through SLAM with several settings, as `yfslam run --dense` does. Each frame is rendered once.
///
/// # Errors
/// The system cannot be built, or refuses a frame.
pub fn run_all(world: &World, options: &[RunOptions], dense: &DenseConfig) -> Result<Vec<DenseRun>> {
    let mut runners = options.iter().map(|options| Runner::new(*options, world, dense)).collect::<Result<Vec<_>>>()?;
    for start in (0..world.len()).step_by(BATCH) {
        let render = |index| world.frame(index).frame;
        let frames: Vec<Frame> = (start..(start + BATCH).min(world.len())).into_par_iter().map(render).collect();
        for runner in &mut runners {
            frames.iter().try_for_each(|frame| runner.track(frame.clone()))?;
        }
    }
    runners.into_iter().map(Runner::finish).collect()
}

impl Runner {
    fn new(options: RunOptions, world: &World, dense: &DenseConfig) -> Result<Self> {
        let mut config = Config::default();
        config.dynamic.method = options.method;
        config.loops.enabled = options.loops;
        let camera = world.config().camera.clone();
        let slam = Slam::builder(camera).config(config.clone()).dense(dense.clone()).build()?;
        Ok(Self { config, slam, seconds: 0.0, keyframes: 0 })
    }

    fn track(&mut self, mut frame: Frame) -> Result<()> {
        let movable = |class: usize| self.config.dynamic.movable.iter().any(|name| name == CLASS_NAMES[class]);
        frame.detections.iter_mut().for_each(|boxes| boxes.retain(|b| movable(b.class)));
        let times = self.slam.track(&frame)?.times;
        if !times.dense_map.is_zero() {
            self.seconds += (times.dense_patch + times.dense_map).as_secs_f64();
            self.keyframes += 1;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<DenseRun> {
        let patches = self.slam.statistics().dense_bytes;
        let ms_per_keyframe = self.seconds * 1e3 / self.keyframes.max(1) as f64;
        let mut dense = self.slam.dense()?;
        Ok(DenseRun { bytes: patches + dense.volume().bytes(), map: dense.snapshot(), ms_per_keyframe })
    }
}
