//! Takes the frames of a source through one or more methods.

use anyhow::{Result, bail};
use yfslam::{Config, Frame, Method};

use crate::input::detector::LoadedDetector;
use crate::input::settings::describe;
use crate::input::source::Source;
use crate::output::folder::OutputFolder;
use crate::output::recorder::{Recorder, ReportImages, RunOutputs};
use crate::run::map_args::MapArgs;
use crate::run::method_run::{EvalContext, MethodRun, RunResult};
use crate::run::shared_detector::SharedDetector;
use crate::stats::process::{ProcessMeter, ProcessTime};
use crate::stats::skip::Skip;
use crate::stats::stages::Stages;
use crate::ui::progress::Progress;
use crate::ui::terminal::{Terminal, explain};

/// A method run whose frames are recorded.
pub struct RecordedRun {
    run: MethodRun,
    recorder: Recorder,
    /// The error that ended it early.
    failure: Option<anyhow::Error>,
}

/// The result of a method, with what the reports show of it.
pub struct RecordedResult<'a> {
    pub result: RunResult<'a>,
    pub images: ReportImages,
    pub folder: OutputFolder,
}

/// What the methods of a run have in common.
pub struct Setup<'a> {
    pub source: &'a Source,
    pub config: &'a Config,
    pub map: &'a MapArgs,
    pub outputs: RunOutputs,
    pub makes_dense_map: bool,
}

impl Setup<'_> {
    /// Prepares one run for each method. A detector belongs to the only method, or is shared.
    ///
    /// # Errors
    /// The configuration, the detector, a map or an output folder cannot be used.
    pub fn prepare(
        &self,
        methods: &[Method],
        out: &OutputFolder,
        detector: Option<LoadedDetector>,
    ) -> Result<(Vec<RecordedRun>, Option<SharedDetector>)> {
        let is_only = methods.len() == 1;
        let (mut own, shared) = if is_only { (detector, None) } else { (None, detector) };
        let run = |method: &Method| {
            let mut config = self.config.clone();
            config.dynamic.method = *method;
            let folder = if is_only { out.clone() } else { out.for_method(describe(*method).0)? };
            let recorder = Recorder::prepare(folder, &config, self.source.stamps_ns.len(), self.outputs)?;
            let run = MethodRun::prepare(config, self.source, own.take(), self.makes_dense_map, self.map)?;
            anyhow::Ok(RecordedRun { run, recorder, failure: None })
        };
        let runs = methods.iter().map(run).collect::<Result<_>>()?;
        Ok((runs, shared.map(|detector| SharedDetector::new(detector, self.config)).transpose()?))
    }
}

impl RecordedRun {
    /// Processes one frame, unless an earlier one failed.
    fn process(&mut self, frame: &Result<Frame, Skip>) {
        if self.failure.is_some() {
            return;
        }
        self.run.process(frame);
        if let Ok(frame) = frame {
            let index = self.run.pipeline.frames().total() - 1;
            self.failure = self.recorder.record(index, frame, self.run.pipeline.slam()).err();
        }
    }

    fn finish<'a>(self, context: EvalContext<'a>, map: &MapArgs) -> Result<RecordedResult<'a>> {
        let Self { run, recorder, failure } = self;
        if let Some(failure) = failure {
            return Err(failure);
        }
        let (result, dense) = run.finish(context, map)?;
        let images = recorder.write(&result, dense.as_ref())?;
        Ok(RecordedResult { result, images, folder: recorder.folder().clone() })
    }
}

/// Takes all frames of the source through all runs, with a thread for each run. Returns the durations of reading, and the processor time.
pub fn drive(
    source: &mut Source,
    mut detector: Option<&mut SharedDetector>,
    runs: &mut [RecordedRun],
    terminal: Terminal,
) -> (Stages, ProcessTime) {
    let mut progress = Progress::new(terminal, &source.name, source.stamps_ns.len());
    let mut reading = Stages::default();
    let mut meter = ProcessMeter::start();
    while runs.iter().any(|run| run.failure.is_none())
        && let Some(frame) = source.frames.next(&mut reading)
    {
        let frames = distribute(frame, detector.as_deref_mut(), runs);
        std::thread::scope(|scope| {
            let mut work = runs.iter_mut().zip(&frames);
            let first = work.next();
            for (run, frame) in work {
                scope.spawn(|| run.process(frame));
            }
            if let Some((run, frame)) = first {
                run.process(frame);
            }
        });
        meter.frame();
        if let Some(RecordedRun { run, .. }) = runs.first() {
            progress.frame(run.pipeline.frames(), run.state);
        }
    }
    progress.finish();
    (reading, meter.finish())
}

/// Returns the frame for each run, with boxes from the shared detector, if there is one.
fn distribute(
    frame: Result<Frame, Skip>,
    detector: Option<&mut SharedDetector>,
    runs: &[RecordedRun],
) -> Vec<Result<Frame, Skip>> {
    let (Some(detector), Ok(frame)) = (detector, &frame) else { return vec![frame; runs.len()] };
    detector.begin(frame);
    let frame_for = |RecordedRun { run, .. }: &RecordedRun| {
        let needs_boxes = run.config.dynamic.method.needs_boxes();
        Ok(if needs_boxes { detector.detect(frame, run.pipeline.slam().roll_deg()) } else { frame.clone() })
    };
    runs.iter().map(frame_for).collect()
}

/// Ends all runs and writes their files. A method of several that has no result only gives a warning.
///
/// # Errors
/// No method has a trajectory.
pub fn finish<'a>(
    runs: Vec<RecordedRun>,
    context: EvalContext<'a>,
    map: &MapArgs,
    terminal: Terminal,
) -> Result<Vec<RecordedResult<'a>>> {
    let is_only = runs.len() == 1;
    let mut results = Vec::new();
    for recorded in runs {
        let folder = recorded.recorder.folder().clone();
        let (name, _) = describe(recorded.run.config.dynamic.method);
        match recorded.finish(context, map) {
            Ok(result) => results.push(result),
            Err(error) if is_only => return Err(error),
            Err(error) => {
                terminal.warn(&format!("{name}: {}", explain(&error)));
                folder.write_failure(&explain(&error))?;
            }
        }
    }
    if results.is_empty() {
        bail!("no method has a trajectory");
    }
    Ok(results)
}
