//! `yfslam run`: tracks a sequence with one method or several.

mod drive;

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::{Args, Command, FromArgMatches};
use yfslam::Config;
use yfslam::config::DepthSource;
use yfslam::dynamic::Method;
use yfslam_report::{TableStyle, evaluation_table};

use self::drive::{RecordedResult, Setup, drive, finish};
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
use crate::run::evaluation::EvaluationArgs;
use crate::run::map_args::MapArgs;
use crate::run::method_run::{EvalContext, RunResult};
use crate::run::shared_detector::{DetectionTally, SharedDetector};
use crate::ui::terminal::{Terminal, explain};

const EXAMPLES: &str = "\
Examples:
  yfslam run rgbd_bonn_crowd --camera bonn
  yfslam run rgbd_dataset_freiburg1_xyz --camera tum1 --method none
  yfslam run 'synth:walking_xyz?seed=7&frames=300' --out walk      no data needed
  yfslam run synth:walking_rpy --method none,boxes,yf --report     side by side
  yfslam run DIR --start 100 --end 400 --reverse --overlay --report
  yfslam run DIR --save-map lab.map                    then, another day:
  yfslam run OTHER --load-map lab.map --localise
  yfslam run DIR --dense --save-map lab.map            with surfaces, for `yfslam map lab.map`
  yfslam run DIR --masks DIR/masks                     what can move, from a segmentation of your own
  yfslam run DIR --sensor mono                         one picture a frame, no depth
  yfslam run DIR --detect-every 3                      the network looks at every third frame
  yfslam run synth:walking_xyz --fault covered@2+1 --fault late@5+0.5

In the output folder:
  trajectory.txt  all tracked frames, poses as known at the end, world from camera (TUM format)
  keyframes.txt   the keyframes of the map, likewise
  live.txt        all tracked frames, poses as known at their time
  map.ply         landmarks with colour
  run.json        what was run, what became of the frames, times, errors
  config.toml     every setting of this run; give it to --config to repeat it
  dense.map       with --dense, what `yfslam map` makes clouds, octrees, grids and meshes of
  overlay/        with --overlay, one picture a frame
  report.html     with --report, all of it on one page: figures, pictures, tables

A single camera (--sensor mono) knows no lengths: the median depth of its first landmarks is 1, errors are those after alignment by Sim(3).
It begins its map when it has moved aside, and so it does again when lost where it recognises nothing. Loops correct its scale, too.

Of several methods each has a folder of its own in the output folder, OUT/none and so on, and report.html compares them. Each frame is
read or rendered once, and the network looks at it once; results are those of a run of each method alone. A method that fails leaves a
failure.txt and does not stop the others.

Ends with success only if a trajectory was produced, by one method at least.";

/// Evenly spread snapshots in the report of one method.
const SNAPSHOTS: usize = 5;
/// The same for each of several methods.
const SNAPSHOTS_OF_EACH: usize = 3;

/// Track a sequence: its trajectory, map and report go to a folder.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct RunArgs {
    #[command(flatten)]
    source: SourceArgs,
    /// How moving things are kept out [default: full]. Several methods are run side by side; the others are compared with the first.
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
    /// Where results go [default: yfslam-out/NAME, the name of the sequence].
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    out: Option<PathBuf>,
    /// Write a picture of each frame: boxes yellow, moving regions red, static features green, dynamic ones red.
    #[arg(long, help_heading = "Output")]
    overlay: bool,
    /// Make a dense map on the way: `dense.map`, for `yfslam map`.
    #[arg(long, help_heading = "Output")]
    dense: bool,
    /// Write `report.html`: errors, trajectory, pictures and times on one page that needs no network.
    #[arg(long, help_heading = "Output")]
    report: bool,
    /// True trajectory to judge the result by, in TUM format or that of the folder's layout [default: groundtruth.txt, or EuRoC's or
    /// KITTI's own, if it is there]. The estimator never sees it.
    #[arg(long, value_name = "FILE", help_heading = "Evaluation")]
    groundtruth: Option<PathBuf>,
    #[command(flatten)]
    evaluation: EvaluationArgs,
}

pub fn run(args: &RunArgs, terminal: Terminal) -> Result<()> {
    let mut config = args.settings.resolve()?;
    let methods = args.methods(&config)?;
    let max_diff_ns = args.evaluation.max_diff_ns()?;
    let (boxes, detector) = boxes::choose(&args.detector, &args.source, &config, &methods, terminal)?;
    let mut source = args.source.open(config.depth.source, boxes.is_source().then_some(&*config.dynamic.movable))?;
    config.depth.source = source.depth_source;
    ensure!(
        !args.dense || config.depth.source == DepthSource::Image,
        "--dense needs depth images, which {} does not have or --sensor leaves unused; leave it out",
        source.name
    );
    if let Some(masks) = &source.masks {
        report_masks(masks, terminal);
    }
    let truth = find_truth(args, &source, terminal)?;
    let out = OutputFolder::prepare(args.out.as_deref(), &source.name)?;
    args.map.check()?;
    let snapshots = args.report.then_some(if methods.len() == 1 { SNAPSHOTS } else { SNAPSHOTS_OF_EACH });
    let outputs = RunOutputs { overlay: args.overlay, snapshots };
    let setup = Setup { source: &source, config: &config, map: &args.map, outputs, makes_dense_map: args.dense };
    let (mut runs, mut shared) = setup.prepare(&methods, &out, detector)?;
    let (reading, process) = drive(&mut source, shared.as_mut(), &mut runs, terminal);

    let detection = shared.map_or_else(DetectionTally::default, SharedDetector::into_tally);
    let (reading, truth) = (&reading, truth.as_ref());
    let alignment = args.evaluation.alignment(config.depth.source != DepthSource::Motion);
    let context =
        EvalContext { source: &source, truth, max_diff_ns, alignment, boxes: &boxes, reading, detection: &detection };
    let results = finish(runs, context, &args.map, terminal)?;
    let only_results: Vec<&RunResult> = results.iter().map(|recorded| &recorded.result).collect();
    let costs = frame_costs(&process, &detection, &only_results);
    let (sequence, faults) = (args.source.sequence.as_str(), args.source.faults.as_slice());
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
        })
        .collect();
    for (run, RecordedResult { folder, .. }) in runs.iter().zip(&results) {
        let report = RunReport::new(run);
        folder.write_report(&report)?;
        if methods.len() == 1 {
            terminal.result(&summary::of_one(&report, run)?)?;
        }
    }
    let page = args.report.then(|| html::write(&out, &runs, &reading.and(&detection.stages))).transpose()?;
    if methods.len() > 1 {
        terminal.result(&summary::of_several(&runs, truth))?;
    } else if let Some(evaluation) = only_results.first().and_then(|result| result.evaluation()) {
        terminal.result(&format!("\n{}", evaluation_table(evaluation, TableStyle::Plain)))?;
    }
    terminal.result(&format!("\nwritten to {}\n", out.path().display()))?;
    if let Some(page) = page {
        terminal.result(&format!("report: {}\n", page.display()))?;
    }
    check_accuracy(args, &only_results, terminal)
}

impl RunArgs {
    /// What the words after `yfslam` ask for, for commands that are a run.
    ///
    /// # Errors
    /// `yfslam run` would refuse them.
    pub fn of_words(words: &[OsString]) -> Result<Self> {
        let command = Self::augment_args(Command::new("yfslam run").no_binary_name(true));
        Ok(Self::from_arg_matches(&command.try_get_matches_from(words)?)?)
    }

    /// The methods that were asked for, each once; else that of the configuration.
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
            "--detect-async (dynamic.detect_async) is for live use, whose results differ from run to run; add --threaded"
        );
        let options = self.map.of_one_method();
        ensure!(
            methods.len() == 1 || options.is_empty(),
            "{} cannot be used with several methods, each of which makes a map of its own; give one --method",
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
