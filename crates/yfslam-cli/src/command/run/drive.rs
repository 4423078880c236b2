//! Takes the frames of a source through one or more methods.

use std::time::Instant;

use anyhow::{Result, bail};
use yfslam::{Config, Frame, Method};
use yfslam_io::Fault;
use yfslam_view::View;

use super::checkpoint::Checkpoints;
use crate::input::detector::LoadedDetector;
use crate::input::settings::describe;
use crate::input::source::Source;
use crate::output::folder::OutputFolder;
use crate::output::recorder::{Recorder, ReportImages, RunOutputs};
use crate::run::map_args::MapArgs;
use crate::run::method_run::{EvalContext, MethodRun, RunResult};
use crate::run::resume::RunIdentity;
use crate::run::shared_detector::SharedDetector;
use crate::stats::process::{ProcessMeter, ProcessTime};
use crate::stats::skip::Skip;
use crate::stats::stages::Stages;
use crate::ui::failures::Failures;
use crate::ui::interrupt::{Interrupt, Interrupted};
use crate::ui::progress::Progress;
use crate::ui::terminal::{Terminal, explain};

/// A method run whose frames are recorded.
pub struct RecordedRun {
    run: MethodRun,
    /// What a checkpoint says about the run.
    identity: RunIdentity,
    recorder: Recorder,
    failures: Failures,
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
    /// Faults put into the frames on purpose.
    pub faults: &'a [Fault],
    /// Whether to go on from the checkpoint in the output folder.
    pub resumes: bool,
    pub terminal: Terminal,
}

/// What goes along with the runs.
#[derive(Clone, Copy)]
pub struct Watchers<'a> {
    pub map: &'a MapArgs,
    pub interrupt: &'a Interrupt,
    pub terminal: Terminal,
    /// The page that shows them.
    pub view: Option<&'a View>,
}

/// How the frames were processed.
pub struct Driven {
    /// Durations of reading.
    pub reading: Stages,
    pub process: ProcessTime,
    /// The signal that ended the run before its last frame.
    pub interrupted: Option<Interrupted>,
}

impl Setup<'_> {
    /// Prepares one run for each method. A detector belongs to the only method, or is shared. Once everything can be used, the results of
    /// an earlier run are removed from the output folders.
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
            let outputs = self.outputs.of_method(if is_only { None } else { Some(describe(*method).0) });
            let camera = &self.source.camera.camera;
            let recorder = Recorder::prepare(folder, &config, camera, self.source.stamps_ns.len(), &outputs)?;
            let faults: Vec<String> = self.faults.iter().map(ToString::to_string).collect();
            let loaded = self.map.load_map.as_deref();
            let identity = RunIdentity::new(self.source, &faults, &config, self.makes_dense_map, loaded)?;
            let resumed = self.resumes.then(|| recorder.folder().read_checkpoint(&identity)).transpose()?;
            let mut map = self.map.clone();
            if resumed.is_some() {
                map.load_map = Some(recorder.folder().checkpoint_map());
            }
            let mut run = MethodRun::prepare(config, self.source, own.take(), self.makes_dense_map, &map)?;
            if let Some(resumed) = resumed {
                run.pipeline.resume(resumed);
            }
            anyhow::Ok(RecordedRun { run, identity, recorder, failures: Failures::new(self.terminal) })
        };
        let runs = methods.iter().map(run).collect::<Result<Vec<_>>>()?;
        let shared = shared.map(|detector| SharedDetector::new(detector, self.config)).transpose()?;
        if !self.resumes {
            out.remove_results()?;
        }
        runs.iter().try_for_each(|RecordedRun { run, recorder, .. }| recorder.begin(&run.config, self.resumes))?;
        Ok((runs, shared))
    }
}

impl RecordedRun {
    /// Processes one frame, and shows it as one of run `number`.
    fn process(&mut self, frame: &Result<Frame, Skip>, view: Option<&View>, number: usize) {
        self.run.process(frame);
        if let Ok(frame) = frame {
            let index = self.run.pipeline.frames().total() - 1;
            let (tracked, slam) = (self.run.pipeline.last(), self.run.pipeline.slam());
            self.recorder.record(index, frame, tracked, slam, &mut self.failures);
            if let Some((view, tracked)) = view.zip(self.run.pipeline.last()) {
                view.show(number, frame, tracked, self.run.pipeline.slam());
            }
        }
    }

    /// Saves the results so far. A file that cannot be written now is written at the next checkpoint or at the end.
    fn save_checkpoint(&mut self, map: &MapArgs, terminal: Terminal) {
        let started = Instant::now();
        if let Err(error) = self.recorder.write_checkpoint(&mut self.run.pipeline, map, &self.identity) {
            terminal.warn(&format!("no checkpoint: {}", explain(&error)));
        }
        self.run.pipeline.stages.push("checkpoint", started.elapsed());
    }

    fn finish<'a>(
        self,
        context: EvalContext<'a>,
        map: &MapArgs,
        failures: &mut Failures,
    ) -> Result<RecordedResult<'a>> {
        let Self { mut run, mut recorder, failures: mut earlier, .. } = self;
        run.pipeline.finish_mapping();
        recorder.finish_films(run.pipeline.slam(), &mut earlier);
        failures.add(&earlier);
        let (result, maps) = run.finish(context, map)?;
        let images = recorder.write(&result, maps, map, failures);
        Ok(RecordedResult { result, images, folder: recorder.folder().clone() })
    }
}

/// Takes the frames of the source through all runs, with a thread for each run, until the last frame or a signal.
pub fn drive(
    source: &mut Source,
    mut detector: Option<&mut SharedDetector>,
    runs: &mut [RecordedRun],
    watchers: &Watchers,
    mut checkpoints: Checkpoints,
) -> Driven {
    let Watchers { map, interrupt, terminal, view } = *watchers;
    let mut progress = Progress::new(terminal, &source.name, source.stamps_ns.len());
    let mut reading = Stages::default();
    // The frames before the checkpoint from which the run goes on.
    let done = runs.first().map_or(0, |run| run.run.pipeline.frames().total());
    for _ in (0..done).take_while(|_| interrupt.received().is_none()) {
        if source.frames.next(&mut reading).is_none() {
            break;
        }
    }
    let mut meter = ProcessMeter::start();
    let interrupted = loop {
        let interrupted = interrupt.received();
        if interrupted.is_some() {
            break interrupted;
        }
        let Some(frame) = source.frames.next(&mut reading) else {
            // Live frames end with a signal, too, because waiting for the next one ends.
            break if source.frames.is_live() { interrupt.received() } else { None };
        };
        // Live frames do not wait.
        if let (Some(view), Ok(frame), false) = (view, &frame, source.frames.is_live()) {
            view.pace(frame.timestamp_ns, || interrupt.received().is_some());
        }
        let frames = distribute(frame, detector.as_deref_mut(), runs);
        std::thread::scope(|scope| {
            let mut work = runs.iter_mut().zip(&frames).enumerate();
            let first = work.next();
            for (number, (run, frame)) in work {
                scope.spawn(move || run.process(frame, view, number));
            }
            if let Some((number, (run, frame))) = first {
                run.process(frame, view, number);
            }
        });
        meter.frame();
        if let Some(RecordedRun { run, .. }) = runs.first() {
            progress.frame(run.pipeline.frames(), run.state);
        }
        checkpoints.save_if_due(|| runs.iter_mut().for_each(|run| run.save_checkpoint(map, terminal)));
    };
    progress.finish();
    if let Some(view) = view {
        runs.iter().enumerate().for_each(|(number, run)| view.show_end(number, run.run.pipeline.slam()));
    }
    if let Some(interrupted) = interrupted {
        // A later run goes on from here.
        checkpoints.save(|| runs.iter_mut().for_each(|run| run.save_checkpoint(map, terminal)));
        terminal
            .note(&format!("{interrupted}; results are being written, and a second signal ends the program at once"));
    }
    Driven { reading, process: meter.finish(), interrupted }
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

/// Ends all runs and writes their files. A method of several that has no result only gives a warning, and a file that cannot be written
/// is reported.
///
/// # Errors
/// No method has a trajectory.
pub fn finish<'a>(
    runs: Vec<RecordedRun>,
    context: EvalContext<'a>,
    map: &MapArgs,
    failures: &mut Failures,
    terminal: Terminal,
) -> Result<Vec<RecordedResult<'a>>> {
    let is_only = runs.len() == 1;
    let mut results = Vec::new();
    for recorded in runs {
        let folder = recorded.recorder.folder().clone();
        let (name, _) = describe(recorded.run.config.dynamic.method);
        match recorded.finish(context, map, failures) {
            Ok(result) => results.push(result),
            Err(error) if is_only => return Err(error),
            Err(error) => {
                terminal.warn(&format!("{name}: {}", explain(&error)));
                failures.keep(folder.write_failure(&explain(&error)));
            }
        }
    }
    if results.is_empty() {
        bail!("no method has a trajectory");
    }
    Ok(results)
}
