//! `yfslam run`: tracks a sequence with one method or several.

mod checkpoint;
mod drive;
mod vslam_lab;
mod watch;

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use clap::{Args, Command, FromArgMatches};
use yfslam::config::DepthSource;
use yfslam::{Config, Method};
use yfslam_eval::{EvalOptions, ExpectedFrames};
use yfslam_io::trajectory::{TrajectoryFormat, write_trajectory_as};
use yfslam_report::{TableStyle, evaluation_table};
use yfslam_view::ViewOptions;

use self::checkpoint::Checkpoints;
use self::drive::{Driven, RecordedResult, Setup, Watchers, drive, finish};
pub use self::watch::WatchArgs;
use crate::input::boxes;
use crate::input::detector::DetectorArgs;
use crate::input::settings::{MethodArg, SettingsArgs, describe};
use crate::input::source::{MaskTally, Source, SourceArgs, Truth};
use crate::output::folder::OutputFolder;
use crate::output::html;
use crate::output::recorder::RunOutputs;
use crate::output::report::{ReportedRun, RunReport};
use crate::output::summary;
use crate::run::cost::frame_costs;
use crate::run::evaluation::{EvaluationArgs, ScaleSource, scale_warning};
use crate::run::map_args::MapArgs;
use crate::run::method_run::{EvalContext, RunResult};
use crate::run::shared_detector::{DetectionTally, SharedDetector};
use crate::ui::failures::Failures;
use crate::ui::interrupt::Interrupt;
use crate::ui::terminal::{Terminal, explain};

const HELP: &str = "\
Examples:
  yfslam run rgbd_bonn_crowd --camera bonn
  yfslam run rgbd_dataset_freiburg1_xyz --camera tum1 --method none
  yfslam run 'synth:walking_xyz?seed=7&frames=300' -o walk         needs no data
  yfslam run synth:walking_rpy --method none,boxes,yf --report     several methods and a report
  yfslam run DIR --start 100 --end 400 --reverse --overlay --report
  yfslam run DIR --save-map lab.map                                saves the map
  yfslam run OTHER --load-map lab.map --localise                   localises in it
  yfslam run DIR --dense --save-map lab.map                        adds a dense map, for `yfslam map lab.map`
  yfslam run DIR --masks DIR/masks                                 uses your own segmentation
  yfslam run DIR --sensor mono                                     uses the colour images only
  yfslam run DIR --save-map lab.map --checkpoint 30                saves trajectory and map every 30 s
  yfslam run DIR --save-map lab.map --checkpoint 30 --resume       goes on where that run was interrupted or killed
  yfslam run DIR --detect-every 3                                  runs the detector on every third frame
  yfslam run synth:walking_xyz --fault covered@2+1 --fault late@5+0.5
  yfslam run DIR --view                                            shows the run on a page while it goes on

Files in the output folder:
  trajectory.txt  final poses of all tracked frames, world from camera (TUM format)
  keyframes.txt   final poses of the keyframes
  live.txt        poses of all tracked frames as estimated at the time of each frame
  map.ply         landmarks with colour
  T_map_world.txt transformation from the world of these files to the frame of `yfslam map`, in which z points up
  run.json        input, counts of frames, times, errors, and `health`: signs that the result may be wrong
  config.toml     the configuration of this run; --config repeats the run with it
  dense.map       with --dense, the input of `yfslam map`
  overlay/        with --overlay, one image for each frame
  report.html     with --report, one page with errors, figures, images and times
  With --vslam-lab FOLDER/ID, FOLDER/ID_KeyFrameTrajectory.csv has the keyframes: nanoseconds, position, quaternion x y z w.

  Each file is written whole or not at all. When a run begins, files of these names are removed, except config.toml: those that an
  earlier run left are never taken for results of this one. Incomplete files of killed runs (.yfslam-*.tmp) are removed, too.

Detections:
  The methods boxes, yf, ds, dyna and full need the bounding boxes of people. Without --detector, boxes come from the synthetic world or
  from the file boxes.json in the folder, else from the network in this program. With --masks alone, no detector is running.

Masks (--masks):
  One PNG image for each colour image, with the same name or named by its time stamp, or listed in `masks.txt` in the folder.
  Pixels with the value 0 belong to no movable object. The methods ds, dyna and full use masks, and then need no boxes.

Several methods:
  Each method has its own folder in the output folder, such as OUT/none. Each frame is read and searched for people once; the results
  equal those of separate runs. If a method fails, its folder has a file failure.txt, and the other methods continue.

A single camera (--sensor mono):
  The scale is unknown: the median depth of the first landmarks is 1. Errors are computed after alignment with scale, Sim(3). The map
  is initialised after sideways motion of the camera, and again when the camera is lost and not relocalised. Loop closing corrects drift
  of the scale.

Kinds of faults (--fault):
  dropped, repeated, blank, black, frozen, late, nan-stamp, clock-ahead, clock-behind, wrong-size, covered, over-exposed, blurred, flicker,
  dirt, ir-pattern, depth-dropout, depth-noise, depth-scale, depth-saturated, depth-late, false-boxes, no-boxes

Signals:
  After SIGINT (Ctrl-C) or SIGTERM, the run ends with all files for the frames so far, and run.json has \"interrupted\": true. A second
  signal ends the program at once; then the files of the last --checkpoint stay. --resume goes on from them, or from where a signal
  ended a run with --checkpoint: the camera is relocalised in the map of the checkpoint, and the results are those of all frames. Overlay,
  recording and film hold the later frames only.

Exit status:
  0    at least one method produced a trajectory, and all files were written
  1    an error: no method produced a trajectory, or a file could not be written; all other files were
  130  SIGINT, and 143  SIGTERM: all files were written for the frames until then";

/// Evenly spread snapshots in the report of one method.
const SNAPSHOTS: usize = 5;
/// The same for each of several methods.
const SNAPSHOTS_OF_EACH: usize = 3;

/// Track a sequence; trajectory, map and report are written to a folder.
#[derive(Args, Clone, Debug)]
#[command(after_help = HELP)]
pub struct RunArgs {
    #[command(flatten)]
    source: SourceArgs,
    /// Methods for dynamic scenes [default: full]; with several methods, the others are compared with the first one.
    #[arg(
        long = "method",
        alias = "methods",
        value_enum,
        value_name = "METHOD,METHOD",
        value_delimiter = ',',
        help_heading = "System"
    )]
    methods: Vec<MethodArg>,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    detector: DetectorArgs,
    #[command(flatten)]
    map: MapArgs,
    /// Output folder [default: yfslam-out/NAME, the name of the sequence].
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    out: Option<PathBuf>,
    /// Write an image of each frame with boxes (yellow), moving regions (red), static features (green) and dynamic features (red).
    #[arg(long, help_heading = "Output")]
    overlay: bool,
    /// Make a dense map, `dense.map`, for `yfslam map`.
    #[arg(long, help_heading = "Output")]
    dense: bool,
    /// Write `report.html`, a page with errors, figures, images and times.
    #[arg(long, help_heading = "Output")]
    report: bool,
    #[command(flatten)]
    watch: WatchArgs,
    /// Also write the keyframes to FOLDER/ID_KeyFrameTrajectory.csv, the result that VSLAM-LAB expects of a baseline.
    #[arg(long, value_name = "FOLDER/ID", help_heading = "Output")]
    vslam_lab: Option<PathBuf>,
    /// Save trajectory.txt, live.txt and the map at this interval of wall time, so that a killed run loses no more.
    #[arg(long, value_name = "SECONDS", value_parser = checkpoint::parse_interval, help_heading = "Output")]
    checkpoint: Option<Duration>,
    /// Go on from the last checkpoint of an interrupted or killed run with the same arguments and output folder.
    #[arg(long, conflicts_with = "load_map", help_heading = "Output")]
    resume: bool,
    /// Ground truth, in TUM format or in the format of the folder [default: the ground truth in the folder].
    #[arg(long, value_name = "FILE", help_heading = "Evaluation")]
    groundtruth: Option<PathBuf>,
    #[command(flatten)]
    evaluation: EvaluationArgs,
}

/// When frames are used.
#[derive(Clone, Copy, Debug)]
pub enum Pace {
    /// Each frame, however long the one before has taken.
    EveryFrame,
    /// As they come, at a multiple of real time; those for which there is no time are dropped. Mapping runs on its own thread.
    Live { rate: f64 },
}

pub fn run(args: &RunArgs, terminal: Terminal) -> Result<()> {
    run_at(args, Pace::EveryFrame, terminal)
}

pub fn run_at(args: &RunArgs, pace: Pace, terminal: Terminal) -> Result<()> {
    let mut args = args.clone();
    args.map.threaded |= matches!(pace, Pace::Live { .. });
    let args = &args;
    let interrupt = Interrupt::watch()?;
    let mut config = args.settings.resolve()?;
    let methods = args.methods(&config)?;
    let max_diff_ns = args.evaluation.max_diff_ns()?;
    let (boxes, detector) = boxes::choose(&args.detector, &args.source, &config, &methods, terminal)?;
    let mut source =
        Source::open(&args.source, config.depth.source, boxes.is_source().then_some(&*config.dynamic.movable))?;
    for note in &source.camera.notes {
        terminal.warn(&format!("camera {}: {note}", source.camera.origin));
    }
    config.depth.source = source.depth_source;
    ensure!(
        !args.dense || config.depth.source == DepthSource::Image,
        "--dense needs depth images, which {} does not have or --sensor leaves unused; leave it out",
        source.name
    );
    source.notes.iter().for_each(|note| terminal.note(note));
    source.warnings.iter().for_each(|warning| terminal.warn(warning));
    if let Some(masks) = &source.masks {
        report_masks(masks, terminal);
    }
    let truth = find_truth(args, &source, terminal)?;
    let out = OutputFolder::prepare(args.out.as_deref(), &source.name)?;
    args.check_map(&out)?;
    let vslam_lab = args.vslam_lab.as_deref().map(vslam_lab::prepare).transpose()?;
    let snapshots = args.report.then_some(if methods.len() == 1 { SNAPSHOTS } else { SNAPSHOTS_OF_EACH });
    let WatchArgs { record, video, .. } = args.watch.clone();
    let outputs = RunOutputs { overlay: args.overlay, snapshots, record, video };
    args.check_resume(pace)?;
    let setup = Setup {
        source: &source,
        config: &config,
        map: &args.map,
        outputs,
        makes_dense_map: args.dense,
        faults: &args.source.faults,
        resumes: args.resume,
        terminal,
    };
    let (mut runs, mut shared) = setup.prepare(&methods, &out, detector)?;
    let checkpoints = Checkpoints::new(args.checkpoint);
    if let Pace::Live { rate } = pace {
        source = source.play_live(rate, &interrupt, terminal)?;
    }
    let alignment = args.evaluation.alignment(config.depth.source != DepthSource::Motion);
    let view = ViewOptions {
        start_ns: source.stamps_ns.first().copied(),
        frames: Some(source.stamps_ns.len()),
        truth: truth.as_ref().map(|truth| truth.poses.clone()).unwrap_or_default(),
        alignment,
        max_diff_ns,
        ..ViewOptions::new(&source.name, source.camera.camera.clone())
    };
    let view = args.watch.start_view(view, &methods, &interrupt, terminal)?;
    let watchers = Watchers { map: &args.map, interrupt: &interrupt, terminal, view: view.as_ref() };
    let driven = drive(&mut source, shared.as_mut(), &mut runs, &watchers, checkpoints);
    drop(view);
    let Driven { reading, process, interrupted } = driven;

    let detection = shared.map_or_else(DetectionTally::default, SharedDetector::into_tally);
    let (reading, truth) = (&reading, truth.as_ref());
    let context =
        EvalContext { source: &source, truth, max_diff_ns, alignment, boxes: &boxes, reading, detection: &detection };
    let mut failures = Failures::new(terminal);
    let results = match (finish(runs, context, &args.map, &mut failures, terminal), interrupted) {
        (Err(error), Some(interrupted)) => return Err(anyhow::Error::from(interrupted).context(explain(&error))),
        (results, _) => results?,
    };
    let only_results: Vec<&RunResult> = results.iter().map(|recorded| &recorded.result).collect();
    let costs = frame_costs(&process, &detection, &only_results);
    let sequence = args.source.folder().to_string_lossy();
    let (sequence, faults) = (&*sequence, args.source.faults.as_slice());
    let source = &source;
    let runs: Vec<ReportedRun> = results
        .iter()
        .zip(costs)
        .map(|(RecordedResult { result, images, .. }, cost)| ReportedRun {
            sequence,
            source,
            faults,
            truth,
            result,
            images,
            cost,
            interrupted,
        })
        .collect();
    let mut text = String::new();
    for (run, RecordedResult { folder, .. }) in runs.iter().zip(&results) {
        let report = RunReport::new(run);
        failures.keep(folder.write_report(&report));
        if methods.len() == 1 {
            text += &summary::of_one(&report, run)?;
        }
    }
    if let Some((path, result)) = vslam_lab.as_deref().zip(only_results.first()) {
        failures.keep(write_trajectory_as(path, &result.outcome.keyframes, TrajectoryFormat::VslamLab));
    }
    let page = args.report.then(|| html::write(&out, &runs, &reading.and(&detection.stages)));
    let page = page.and_then(|page| failures.keep(page));
    if methods.len() > 1 {
        text += &summary::of_several(&runs, truth);
    } else if let Some(evaluation) = only_results.first().and_then(|result| result.evaluation()) {
        text += &format!("\n{}", evaluation_table(evaluation, TableStyle::Plain));
    }
    text += &format!("\nwritten to {}\n", out.path().display());
    if let Some(page) = page {
        text += &format!("report: {}\n", page.display());
    }
    if interrupted.is_none() && failures.check().is_ok() {
        for recorded in &results {
            failures.keep(recorded.folder.remove_checkpoint());
        }
    }
    // Standard output may be closed, so all files are written before.
    let printed = terminal.result(&text);
    failures.check()?;
    interrupt.check()?;
    warn_of_scale(&only_results, source, terminal);
    check_accuracy(args, &only_results, terminal)?;
    printed
}

impl RunArgs {
    /// Parses arguments of `yfslam run`, for other commands.
    ///
    /// # Errors
    /// `yfslam run` would refuse the arguments.
    pub fn parse(arguments: &[OsString]) -> Result<Self> {
        let command = Self::augment_args(Command::new("yfslam run").no_binary_name(true));
        Ok(Self::from_arg_matches(&command.try_get_matches_from(arguments)?)?)
    }

    /// Returns what an estimate of another program is evaluated with: the time stamps of all frames, the ground truth, and the options.
    ///
    /// # Errors
    /// The sequence cannot be opened, or has no ground truth.
    pub fn reference(&self, terminal: Terminal) -> Result<(Vec<i64>, Truth, EvalOptions)> {
        let source = Source::open(&self.source, self.settings.resolve()?.depth.source, None)?;
        let truth = source.truth(self.groundtruth.as_deref(), terminal)?;
        let truth = truth.with_context(|| format!("{} has no ground truth", source.name))?;
        let options = EvalOptions {
            max_diff_ns: self.evaluation.max_diff_ns()?,
            alignment: self.evaluation.alignment(source.depth_source != DepthSource::Motion),
            expected: ExpectedFrames::StampsNs(source.stamps_ns.clone()),
            ..EvalOptions::default()
        };
        Ok((source.stamps_ns, truth, options))
    }

    /// Checks before a run that its map can be saved after it, in a file of its own.
    ///
    /// # Errors
    /// The map cannot be written, or would replace another file of the run.
    fn check_map(&self, out: &OutputFolder) -> Result<()> {
        let clash = self.map.save_map.as_ref().filter(|path| out.has_result(path));
        ensure!(
            clash.is_none(),
            "--save-map {} is the name of another file of this run; choose another name, such as lab.map",
            clash.map_or_else(String::new, |path| path.display().to_string())
        );
        self.map.check()
    }

    /// Checks that the frames before a checkpoint can be left out.
    ///
    /// # Errors
    /// They cannot, because frames come as they are sent.
    fn check_resume(&self, pace: Pace) -> Result<()> {
        ensure!(
            !self.resume || (matches!(pace, Pace::EveryFrame) && !self.source.is_pipe()),
            "--resume is for recordings and worlds whose every frame is used; to go on with live frames, save the map with --save-map and load it \
             with --load-map"
        );
        Ok(())
    }

    /// Returns the requested methods, each once; else the method of the configuration.
    fn methods(&self, config: &Config) -> Result<Vec<Method>> {
        let mut methods: Vec<Method> = Vec::new();
        for method in self.methods.iter().map(|m| m.method()) {
            if !methods.contains(&method) {
                methods.push(method);
            }
        }
        if methods.is_empty() {
            methods.push(config.dynamic.method);
        }
        ensure!(
            !config.dynamic.detect_async || self.map.threaded,
            "--detect-async (dynamic.detect_async) is for live use, with results that differ from run to run; add --threaded"
        );
        let mut options = self.map.single_method_options();
        options.extend(self.resume.then_some("--resume"));
        options.extend(self.vslam_lab.is_some().then_some("--vslam-lab"));
        ensure!(
            methods.len() == 1 || options.is_empty(),
            "{} cannot be used with several methods, because each method makes its own map and files; give one --method",
            options.join(" and ")
        );
        Ok(methods)
    }
}

/// Reports how many frames have a mask.
fn report_masks(masks: &MaskTally, terminal: Terminal) {
    let MaskTally { folder, found, missing, first_missing } = masks;
    terminal.note(&format!("{found} of {} frames have a mask in {}", found + missing, folder.display()));
    if let Some(first) = first_missing {
        terminal.warn(&format!(
            "{missing} frames have no mask, and nothing is masked in them; the first missing file is {}",
            first.display()
        ));
    }
}

/// Reads the ground truth. A broken one is an error only if the user named it.
fn find_truth(args: &RunArgs, source: &Source, terminal: Terminal) -> Result<Option<Truth>> {
    match source.truth(args.groundtruth.as_deref(), terminal) {
        Err(error) if args.groundtruth.is_none() => {
            terminal.warn(&format!("no evaluation: {}", explain(&error)));
            Ok(None)
        }
        truth => truth.context("the ground truth cannot be used"),
    }
}

/// Warns if lengths differ from those of the ground truth; the scale of a single camera is arbitrary.
fn warn_of_scale(results: &[&RunResult], source: &Source, terminal: Terminal) {
    let camera = &source.camera;
    let scale = match source.depth_source {
        DepthSource::Image => ScaleSource::DepthFactor(camera.depth_factor),
        DepthSource::Stereo => ScaleSource::Baseline(camera.camera.bf / camera.camera.fx),
        DepthSource::Motion => return,
    };
    let warning = results.iter().find_map(|result| scale_warning(result.evaluation()?, scale));
    if let Some(warning) = warning {
        terminal.warn(&warning);
    }
}

/// Warns where errors cannot be computed; fails if the user named a ground truth.
fn check_accuracy(args: &RunArgs, results: &[&RunResult], terminal: Terminal) -> Result<()> {
    for result in results {
        let Some(Err(error)) = &result.evaluation else { continue };
        if args.groundtruth.is_some() {
            return Err(error.clone()).context("the trajectory was written, but it cannot be evaluated");
        }
        let (name, _) = describe(result.config.dynamic.method);
        terminal.warn(&format!("{name}: no evaluation: {error}"));
    }
    Ok(())
}
