//! One method at work on a sequence, and what came of it.
//!
//! In: frames, which several lanes may share. Out: a [`Judged`] run, its files written.

use anyhow::Result;
use yfslam::dense::persist::encode;
use yfslam::tracking::TrackingState;
use yfslam::{Config, Detector, RgbdFrame, Slam};
use yfslam_eval::report::{DenseMap, Picture};
use yfslam_eval::{AlignmentKind, EvalError, EvalOptions, Evaluation, ExpectedFrames};

use crate::input::boxes::{BoxOrigin, DetectionTally};
use crate::input::detector::LoadedDetector;
use crate::input::source::{Source, Truth};
use crate::output::folder::OutputFolder;
use crate::output::overlay::Overlay;
use crate::output::snapshots::Moments;
use crate::run::dense::{self, DenseCost, DenseRun};
use crate::run::evaluation::{judge, to_eval};
use crate::run::map_args::MapArgs;
use crate::run::pipeline::{Outcome, Pipeline};
use crate::stats::skip::Skip;
use crate::stats::stages::Stages;

/// A method at work.
pub struct Lane {
    pub config: Config,
    pub folder: OutputFolder,
    pub pipeline: Pipeline,
    pub state: TrackingState,
    overlay: Option<Overlay>,
    moments: Option<Moments>,
    dense: Option<DenseRun>,
    /// What ended it early.
    failure: Option<anyhow::Error>,
}

/// What a lane is to leave behind besides its trajectory.
#[derive(Clone, Copy)]
pub struct Extras<'a> {
    /// A picture of every frame.
    pub overlay: bool,
    /// Evenly spread moments of which the report has a picture; `None` without a report.
    pub moments: Option<usize>,
    /// A dense map.
    pub dense: bool,
    pub map: &'a MapArgs,
}

/// What a run is judged by.
#[derive(Clone, Copy)]
pub struct Judge<'a> {
    pub source: &'a Source,
    pub truth: Option<&'a Truth>,
    pub max_diff_ns: u64,
    pub alignment: AlignmentKind,
    /// Where the boxes come from, for methods that need any.
    pub boxes: &'a BoxOrigin,
    /// What reading the frames took.
    pub reading: &'a Stages,
    /// What detection took that was done for several lanes.
    pub detection: &'a DetectionTally,
}

/// What came of a method.
pub struct Judged<'a> {
    pub config: Config,
    pub folder: OutputFolder,
    pub outcome: Outcome,
    /// Where its boxes come from.
    pub boxes: &'a BoxOrigin,
    /// Stages that were not its own: reading, and detection for several.
    pub shared: Stages,
    /// `None` without ground truth.
    pub evaluation: Option<Result<Evaluation, EvalError>>,
    pub pictures: Vec<Picture>,
    /// Its dense map in pictures, for the report.
    pub dense: Option<DenseMap>,
    pub dense_cost: Option<DenseCost>,
}

impl Lane {
    /// A method that is ready for the frames of `source`, with a detector of its own if it is alone.
    ///
    /// # Errors
    /// The configuration, the detector or a map cannot be used, or pictures of an earlier run cannot be removed.
    pub fn prepare(
        config: Config,
        source: &Source,
        folder: OutputFolder,
        detector: Option<LoadedDetector>,
        extras: Extras,
    ) -> Result<Self> {
        let open_score = config.dynamic.open_score;
        let overlay = extras.overlay.then(|| Overlay::prepare(folder.path(), open_score)).transpose()?;
        let moments = extras.moments.map(|count| Moments::new(source.stamps_ns.len(), count, open_score));
        let (detector, times) = detector.map(|d| (d.detector as Box<dyn Detector>, d.times)).unzip();
        let earlier = extras.map.pieces(extras.dense)?;
        let slam = extras.map.apply(Slam::new(config.clone(), &source.camera.camera, detector)?)?;
        let pipeline = Pipeline::new(slam, times);
        let (camera, execution) = (&source.camera.camera, extras.map.execution());
        let dense = extras
            .dense
            .then(|| DenseRun::new(&config.dense, camera, execution, earlier, pipeline.slam()))
            .transpose()?;
        Ok(Self { config, folder, pipeline, overlay, moments, dense, state: TrackingState::default(), failure: None })
    }

    /// Takes one frame through the pipeline.
    pub fn take(&mut self, frame: &Result<RgbdFrame, Skip>) {
        match frame {
            _ if self.failure.is_some() => {}
            Ok(frame) => {
                self.state = self.pipeline.track(frame);
                self.failure = self.picture(frame).err();
                if let Some(dense) = &mut self.dense {
                    dense.see(frame, &mut self.pipeline);
                }
            }
            Err(skip) => self.pipeline.skip(skip.clone()),
        }
    }

    fn picture(&mut self, frame: &RgbdFrame) -> Result<()> {
        let index = self.pipeline.frames().total() - 1;
        if let Some(moments) = &mut self.moments {
            moments.see(index, frame, self.pipeline.slam());
        }
        match &self.overlay {
            Some(overlay) => overlay.write(index, frame, self.pipeline.slam()),
            None => Ok(()),
        }
    }

    /// Whether it ended early.
    pub fn has_failed(&self) -> bool {
        self.failure.is_some()
    }

    /// Ends the run and judges it.
    ///
    /// # Errors
    /// What ended it early, or why there is no trajectory; a file cannot be written.
    pub fn finish<'a>(self, judge_by: Judge<'a>, map: &MapArgs) -> Result<Judged<'a>> {
        let Self { config, folder, mut pipeline, moments, dense, failure, .. } = self;
        if let Some(failure) = failure {
            return Err(failure);
        }
        let dense_cost = dense.as_ref().map(DenseRun::cost);
        let survey = dense.map(|dense| dense.finish(&mut pipeline));
        let pieces = survey.as_ref().map(encode).transpose()?;
        map.save(&mut pipeline, pieces.as_deref())?;
        let mut outcome = pipeline.finish(&config)?;
        let mut shared = judge_by.reading.clone();
        let needs_boxes = config.dynamic.method.needs_boxes();
        if needs_boxes {
            let DetectionTally { stages, cpu, failures } = judge_by.detection;
            shared = shared.and(stages);
            outcome.cpu = outcome.cpu.zip(*cpu).map(|(own, shared)| own + shared);
            outcome.frames.detector_failures += failures;
        }
        let evaluation = judge_by.truth.map(|truth| {
            let expected = ExpectedFrames::StampsNs(judge_by.source.stamps_ns.clone());
            let Judge { max_diff_ns, alignment, .. } = judge_by;
            let options = EvalOptions { max_diff_ns, alignment, expected, ..Default::default() };
            judge(&truth.poses, &to_eval(&outcome.trajectory), options)
        });
        folder.write(&outcome, &config)?;
        if let Some(pieces) = &pieces {
            dense::write(folder.path(), pieces)?;
        }
        let shown = survey.filter(|_| moments.is_some());
        let dense = shown.map(|survey| dense::pictures(&config.dense, &survey)).transpose()?;
        let pictures = moments.map_or(Ok(Vec::new()), |moments| moments.to_pictures())?;
        let boxes = if needs_boxes { judge_by.boxes } else { &BoxOrigin::None };
        Ok(Judged { config, folder, outcome, boxes, shared, evaluation, pictures, dense, dense_cost })
    }
}

impl Judged<'_> {
    /// The errors, if they are known.
    pub fn evaluation(&self) -> Option<&Evaluation> {
        self.evaluation.as_ref()?.as_ref().ok()
    }
}
