//! The dense map of a run: a piece for each keyframe, which follows every correction, and the file that keeps them.
//!
//! In: frames and the system that has just seen them. Out: `dense.map`, from which `yfslam map` makes what people use.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use serde::Serialize;
use yfslam::dense::cloud::cloud;
use yfslam::dense::{DenseConfig, DenseMapper, Survey, up};
use yfslam::image::RgbImage;
use yfslam::{Camera, Execution, RgbdFrame, Slam};
use yfslam_eval::report::DenseMap;
use yfslam_io::write_atomically;

use crate::draw::dense_image::{SHOWN_M, from_above, from_corner};
use crate::output::snapshots::to_png;
use crate::run::pipeline::Pipeline;
use crate::stats::cpu;

/// Name of the file in the output folder.
pub const DENSE_FILE: &str = "dense.map";

/// Width and height of the report's pictures, px.
const PICTURE_PX: [usize; 2] = [480, 360];

/// The dense map in the making.
pub struct DenseRun {
    mapper: DenseMapper,
    /// The class in pieces of each class of the detector; `None` where pieces have none.
    class_ids: Option<Vec<u8>>,
    resets: usize,
    /// Pieces cut, and the processor time of this thread for them and for following the map.
    pieces: u32,
    cpu: Option<Duration>,
}

/// What a dense map took.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DenseCost {
    /// Keyframes of which a piece was cut.
    pub keyframes: u32,
    /// Processor time of the thread of tracking for each, ms: cutting the piece and, unless mapping has threads of its own, following the
    /// map; `null` where the system does not tell.
    pub cpu_ms_per_keyframe: Option<f64>,
    /// Memory of the pieces, MB (10⁶ bytes).
    pub pieces_mb: f64,
    /// Pieces that came when the dense map's thread was busy, and were left out.
    pub passed_over: usize,
}

impl DenseRun {
    /// A dense map with the pieces of an earlier session, if there are any, whose map `slam` goes on with.
    ///
    /// # Errors
    /// For a value of the configuration that cannot work, if a thread cannot be started, or if the pieces do not fit.
    pub fn new(
        config: &DenseConfig,
        camera: &Camera,
        execution: Execution,
        earlier: Option<Survey>,
        slam: &Slam,
    ) -> Result<Self> {
        let mut mapper = DenseMapper::new(config, camera, execution)?;
        if let Some(earlier) = earlier {
            mapper =
                mapper.with_pieces(earlier, slam.map()).context("the dense pieces of the loaded map do not fit")?;
        }
        let names_things = config.classes && slam.knows_things();
        let class_ids = names_things.then(|| mapper.name_classes(slam.class_names()));
        Ok(Self { mapper, class_ids, resets: 0, pieces: 0, cpu: Some(Duration::ZERO) })
    }

    /// Takes note of the frame that the pipeline saw last: if it became a keyframe, its piece is cut, and all pieces follow the map.
    pub fn see(&mut self, frame: &RgbdFrame, pipeline: &mut Pipeline) {
        let slam = pipeline.slam();
        if slam.resets() > self.resets {
            self.resets = slam.resets();
            self.mapper.clear();
        }
        if !pipeline.made_keyframe() {
            return;
        }
        let Some(tie) = slam.last_frame().reference else { return };
        if !self.mapper.is_due(frame.timestamp_ns, &slam.last_frame().t_cam_world.inverse()) {
            return;
        }
        let (took, cpu) = cpu::timed(|| {
            let started = Instant::now();
            let moving = slam.moving_mask(&frame.depth);
            let moves = |at, edge| moving.covers(&frame.depth, at, edge);
            let mut piece = self.mapper.cut(&frame.color, &frame.depth, moves);
            if let Some((ids, things)) = self.class_ids.as_ref().zip(slam.things(&frame.depth, &moving)) {
                let id = |at| things.class_at(at).and_then(|class| ids.get(class).copied()).unwrap_or_default();
                piece = piece.with_classes(self.mapper.grid(), id);
            }
            let cut = started.elapsed();
            self.mapper.hang(frame.timestamp_ns, tie, piece, slam.map());
            [cut, started.elapsed() - cut]
        });
        self.pieces += 1;
        self.cpu = self.cpu.zip(cpu).map(|(sum, took)| sum + took);
        for (stage, took) in ["dense piece", "dense map"].into_iter().zip(took) {
            pipeline.stages.push(stage, took);
        }
    }

    /// What it took.
    pub fn cost(&self) -> DenseCost {
        let each_ms = |cpu: Duration| (cpu.as_secs_f64() * 1e6 / f64::from(self.pieces.max(1))).round() / 1e3;
        DenseCost {
            keyframes: self.pieces,
            cpu_ms_per_keyframe: self.cpu.map(each_ms),
            pieces_mb: (self.mapper.bytes() as f64 / 1e5).round() / 10.0,
            passed_over: self.mapper.passed_over(),
        }
    }

    /// The pieces, where the map has them at the end.
    pub fn finish(self, pipeline: &mut Pipeline) -> Survey {
        pipeline.settle();
        self.mapper.into_survey(pipeline.slam().map())
    }
}

/// Writes the pieces, as [`yfslam::dense::persist::encode`] gives them, into the output folder.
///
/// # Errors
/// The file cannot be written; what stood there stays.
pub fn write(folder: &Path, pieces: &[u8]) -> Result<()> {
    Ok(write_atomically(&folder.join(DENSE_FILE), |file| file.write_all(pieces))?)
}

/// The map of the pieces, drawn for the report.
///
/// # Errors
/// A picture is too large for PNG.
pub fn pictures(config: &DenseConfig, survey: &Survey) -> Result<DenseMap> {
    let turn = up::of_survey(survey);
    let volume = survey.volume(config, &turn, |_| {});
    let points = cloud(survey, &volume, |_| {});
    let cut_m = up::floor_m(survey, &turn).unwrap_or_default() as f32 + SHOWN_M;
    let above = from_above(&points, config.resolution_m, cut_m, PICTURE_PX);
    let corner = from_corner(&points, config.resolution_m, cut_m, PICTURE_PX);
    let png = |image: &RgbImage| -> Result<_> { Ok((to_png(image)?, [image.width(), image.height()])) };
    Ok(DenseMap {
        keyframes: survey.pieces.len(),
        occupied: volume.voxels().filter(|known| known.occupied).count(),
        resolution_m: config.resolution_m,
        views: [png(&above)?, png(&corner)?],
    })
}
