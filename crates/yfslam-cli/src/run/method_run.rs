//! One method on one sequence.
//!
//! In: frames, which several methods may share. Out: a [`RunResult`].

use anyhow::Result;
use yfslam::{Config, Detector, Execution, Frame, Slam, TrackingState};
use yfslam_eval::{AlignmentKind, EvalError, EvalOptions, Evaluation, ExpectedFrames};

use super::dense::{DenseCost, DenseResult};
use super::evaluation::evaluate_possible;
use super::map_args::MapArgs;
use super::pipeline::{Outcome, Pipeline};
use super::shared_detector::DetectionTally;
use crate::input::boxes::BoxOrigin;
use crate::input::detector::LoadedDetector;
use crate::input::source::{Source, Truth};
use crate::stats::skip::Skip;
use crate::stats::stages::Stages;

/// One method at work.
pub struct MethodRun {
    pub config: Config,
    pub pipeline: Pipeline,
    pub state: TrackingState,
    makes_dense_map: bool,
}

/// The maps that a run leaves behind, encoded.
#[derive(Default)]
pub struct Maps {
    /// The map for a later run, if it is to be saved.
    pub saved: Option<Result<Vec<u8>>>,
    /// The dense map, if one is made.
    pub dense: Option<Result<DenseResult>>,
}

/// What a run is evaluated with.
#[derive(Clone, Copy)]
pub struct EvalContext<'a> {
    pub source: &'a Source,
    pub truth: Option<&'a Truth>,
    pub max_diff_ns: u64,
    pub alignment: AlignmentKind,
    /// Where the boxes come from, for methods that need them.
    pub boxes: &'a BoxOrigin,
    /// Durations of reading the frames.
    pub reading: &'a Stages,
    /// Cost of detection that several methods share.
    pub detection: &'a DetectionTally,
}

/// The result of one method.
pub struct RunResult<'a> {
    pub config: Config,
    pub outcome: Outcome,
    /// Where its boxes come from.
    pub boxes: &'a BoxOrigin,
    /// Stages that several methods share: reading, and detection.
    pub shared: Stages,
    /// `None` without ground truth.
    pub evaluation: Option<Result<Evaluation, EvalError>>,
    pub dense_cost: Option<DenseCost>,
}

impl MethodRun {
    /// Prepares a method for the frames of `source`, with a detector of its own if it is the only method.
    ///
    /// # Errors
    /// The configuration, the detector or a map cannot be used.
    pub fn prepare(
        config: Config,
        source: &Source,
        detector: Option<LoadedDetector>,
        makes_dense_map: bool,
        map: &MapArgs,
    ) -> Result<Self> {
        let (detector, times) = detector.map(|d| (d.detector as Box<dyn Detector>, d.times)).unzip();
        let mut builder = Slam::builder(source.camera.camera.clone()).config(config.clone());
        if let Some(detector) = detector {
            builder = builder.detector(detector);
        }
        if makes_dense_map {
            builder = builder.dense(config.dense.clone());
        }
        let slam = map.build(builder, makes_dense_map)?;
        let mut pipeline = Pipeline::new(slam, map.execution() == Execution::Inline, times);
        if let Some(file) = &map.load_map {
            pipeline = pipeline.with_loaded_map(file, !map.localise);
        }
        Ok(Self { config, pipeline, makes_dense_map, state: TrackingState::default() })
    }

    /// Tracks one frame, or counts one that cannot be used.
    pub fn process(&mut self, frame: &Result<Frame, Skip>) {
        match frame {
            Ok(frame) => self.state = self.pipeline.track(frame),
            Err(skip) => self.pipeline.skip(skip.clone()),
        }
    }

    /// Ends the run and evaluates it. Returns its maps beside the result.
    ///
    /// # Errors
    /// There is no trajectory, with the reason.
    pub fn finish<'a>(self, context: EvalContext<'a>, map: &MapArgs) -> Result<(RunResult<'a>, Maps)> {
        let Self { config, mut pipeline, makes_dense_map, .. } = self;
        let dense_cost = makes_dense_map.then(|| pipeline.dense_cost());
        let dense = makes_dense_map.then(|| pipeline.dense_map());
        let saved = map.encode(&mut pipeline);
        let mut outcome = pipeline.finish(&config)?;
        let mut shared = context.reading.clone();
        let needs_boxes = config.dynamic.method.needs_boxes();
        if needs_boxes {
            let DetectionTally { stages, failures, .. } = context.detection;
            shared = shared.and(stages);
            outcome.frames.detector_failures += failures;
        }
        let evaluation = context.truth.map(|truth| {
            let expected = ExpectedFrames::StampsNs(context.source.stamps_ns.clone());
            let EvalContext { max_diff_ns, alignment, .. } = context;
            let options = EvalOptions { max_diff_ns, alignment, expected, ..Default::default() };
            evaluate_possible(&truth.poses, &outcome.trajectory, options)
        });
        let boxes = if needs_boxes { context.boxes } else { &BoxOrigin::None };
        Ok((RunResult { config, outcome, boxes, shared, evaluation, dense_cost }, Maps { saved, dense }))
    }
}

impl RunResult<'_> {
    /// Returns the errors, if they are known.
    pub fn evaluation(&self) -> Option<&Evaluation> {
        self.evaluation.as_ref()?.as_ref().ok()
    }
}
