//! The dense map of a run: a patch for each keyframe, which follows every correction of the map.
//!
//! In: frames and the system that has just tracked them. Out: the dense map, from which `yfslam map` makes its products.

use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use serde::Serialize;
use yfslam::dense::persist::encode;
use yfslam::dense::{DenseConfig, DenseMapper, Survey};
use yfslam::{Camera, Execution, RgbdFrame, Slam};

use crate::run::pipeline::Pipeline;
use crate::stats::cpu;

/// Builds the dense map while frames are tracked.
pub struct DenseRun {
    mapper: DenseMapper,
    /// The class in patches of each class of the detector; `None` if patches have no classes.
    class_ids: Option<Vec<u8>>,
    resets: usize,
    /// Number of patches.
    patches: u32,
    /// Processor time of this thread for the patches and for following the map.
    cpu: Option<Duration>,
}

/// The dense map at the end of a run.
pub struct DenseResult {
    pub map: Survey,
    /// The map as the bytes of its file.
    pub encoded: Vec<u8>,
}

impl DenseResult {
    /// Encodes the map.
    ///
    /// # Errors
    /// It cannot be encoded, which would be a fault of this program.
    pub fn new(map: Survey) -> Result<Self> {
        Ok(Self { encoded: encode(&map)?, map })
    }
}

/// The cost of a dense map.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DenseCost {
    /// Keyframes that have a patch.
    pub keyframes: u32,
    /// Processor time of the tracking thread for each of them, ms: extracting the patch and, unless mapping has threads of its own,
    /// following the map; `null` where the system does not measure it.
    pub cpu_ms_per_keyframe: Option<f64>,
    /// Memory of the patches, MB (10⁶ bytes).
    pub patches_mb: f64,
    /// Patches that were dropped because the thread of the dense map was busy.
    pub patches_dropped: usize,
}

impl DenseRun {
    /// Starts a dense map, with the patches of an earlier session if `slam` continues its map.
    ///
    /// # Errors
    /// A value of the configuration cannot work, a thread cannot be started, or the patches do not belong to the map.
    pub fn new(
        config: &DenseConfig,
        camera: &Camera,
        execution: Execution,
        earlier: Option<Survey>,
        slam: &Slam,
    ) -> Result<Self> {
        let mut mapper = DenseMapper::new(config, camera, execution)?;
        if let Some(earlier) = earlier {
            mapper = mapper
                .with_pieces(earlier, slam.map())
                .context("the dense map in the loaded file does not belong to its map")?;
        }
        let has_classes = config.classes && slam.knows_things();
        let class_ids = has_classes.then(|| mapper.name_classes(slam.class_names()));
        Ok(Self { mapper, class_ids, resets: 0, patches: 0, cpu: Some(Duration::ZERO) })
    }

    /// Processes the frame that the pipeline tracked last: a keyframe adds a patch, and all patches follow the map.
    pub fn insert(&mut self, frame: &RgbdFrame, pipeline: &mut Pipeline) {
        let slam = pipeline.slam();
        if slam.resets() > self.resets {
            self.resets = slam.resets();
            self.mapper.clear();
        }
        if !pipeline.made_keyframe() {
            return;
        }
        let Some(anchor) = slam.last_frame().reference else { return };
        if !self.mapper.is_due(frame.timestamp_ns, &slam.last_frame().t_cam_world.inverse()) {
            return;
        }
        let (took, cpu) = cpu::timed(|| {
            let started = Instant::now();
            let moving = slam.moving_mask(&frame.depth);
            let moves = |at, edge| moving.covers(&frame.depth, at, edge);
            let mut patch = self.mapper.cut(&frame.color, &frame.depth, moves);
            if let Some((ids, things)) = self.class_ids.as_ref().zip(slam.things(&frame.depth, &moving)) {
                let id = |at| things.class_at(at).and_then(|class| ids.get(class).copied()).unwrap_or_default();
                patch = patch.with_classes(self.mapper.grid(), id);
            }
            let extracted = started.elapsed();
            self.mapper.hang(frame.timestamp_ns, anchor, patch, slam.map());
            [extracted, started.elapsed() - extracted]
        });
        self.patches += 1;
        pipeline.add_dense(cpu.unwrap_or_default());
        self.cpu = self.cpu.zip(cpu).map(|(sum, took)| sum + took);
        for (stage, took) in ["dense patch", "dense map"].into_iter().zip(took) {
            pipeline.stages.push(stage, took);
        }
    }

    /// Returns the cost so far.
    pub fn cost(&self) -> DenseCost {
        let each_ms = |cpu: Duration| (cpu.as_secs_f64() * 1e6 / f64::from(self.patches.max(1))).round() / 1e3;
        DenseCost {
            keyframes: self.patches,
            cpu_ms_per_keyframe: self.cpu.map(each_ms),
            patches_mb: (self.mapper.bytes() as f64 / 1e5).round() / 10.0,
            patches_dropped: self.mapper.passed_over(),
        }
    }

    /// Ends the run and returns the dense map, with its patches where the final map has their keyframes.
    pub fn finish(self, pipeline: &mut Pipeline) -> Survey {
        pipeline.settle();
        self.mapper.into_survey(pipeline.slam().map())
    }
}
