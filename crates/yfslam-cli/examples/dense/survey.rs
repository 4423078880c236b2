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

/// What came of it.
pub struct Taken {
    pub survey: Survey,
    /// Wall time for each keyframe, ms: piece and volume.
    pub each_ms: f64,
    /// Memory of pieces and volume at the end.
    pub bytes: usize,
}

/// The dense map of a world by a method, as `yfslam run --dense` makes it.
pub fn take(world: &World, method: Method, dense: &DenseConfig, loops: bool) -> Result<Taken> {
    let mut config = Config::default();
    config.dynamic.method = method;
    config.loops.enabled = loops;
    let mut slam = Slam::new(config.clone(), &world.config().camera, None)?;
    let mut mapper = DenseMapper::new(dense, &world.config().camera, Execution::Inline)?;
    let (mut seconds, mut keyframes, mut resets) = (0.0, 0usize, 0);
    let movable = |class: usize| config.dynamic.movable.iter().any(|name| name == CLASS_NAMES[class]);
    for start in (0..world.len()).step_by(BATCH) {
        let shoot = |index| {
            let mut frame: RgbdFrame = world.frame(index).frame;
            frame.detections.iter_mut().for_each(|boxes| boxes.retain(|b| movable(b.class)));
            frame
        };
        let frames: Vec<RgbdFrame> = (start..(start + BATCH).min(world.len())).into_par_iter().map(shoot).collect();
        for frame in &frames {
            let tracked = slam.track(frame)?;
            if slam.resets() > resets {
                resets = slam.resets();
                mapper.clear();
            }
            let Some(tie) = slam.last_frame().reference.filter(|_| tracked.is_keyframe) else { continue };
            if !mapper.is_due(frame.timestamp_ns, &slam.last_frame().t_cam_world.inverse()) {
                continue;
            }
            let started = Instant::now();
            let moving = slam.moving_mask(&frame.depth);
            let piece = mapper.cut(&frame.color, &frame.depth, |at, edge| moving.covers(&frame.depth, at, edge));
            mapper.hang(frame.timestamp_ns, tie, piece, slam.map());
            seconds += started.elapsed().as_secs_f64();
            keyframes += 1;
        }
    }
    let bytes = mapper.bytes() + mapper.volume(slam.map()).bytes();
    Ok(Taken { survey: mapper.into_survey(slam.map()), each_ms: seconds * 1e3 / keyframes.max(1) as f64, bytes })
}
