//! `yfslam run`: a sequence in, its trajectory out.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use yfslam::dynamic::Method;
use yfslam::{Config, Slam};
use yfslam_eval::{EvalOptions, Evaluation, ExpectedFrames, TableStyle};

use crate::accuracy::{MatchArgs, judge, to_eval};
use crate::detector::{self, DetectorArgs, LoadedDetector};
use crate::html;
use crate::map::MapArgs;
use crate::moments::Moments;
use crate::output::OutputFolder;
use crate::overlay::Overlay;
use crate::pipeline::{Outcome, Pipeline, PlaceTally, Stages};
use crate::progress::Progress;
use crate::report::{BoxSource, Report, Run};
use crate::settings::SettingsArgs;
use crate::source::{Source, SourceArgs, Truth};
use crate::terminal::{Terminal, explain};

const EXAMPLES: &str = "\
Examples:
  yfslam run rgbd_bonn_crowd --camera bonn --detector yolo-fastestv2.onnx
  yfslam run rgbd_dataset_freiburg1_xyz --camera tum1 --method none
  yfslam run 'synth:walking_xyz?seed=7&frames=300' --out walk      no data needed
  yfslam run DIR --start 100 --end 400 --reverse --overlay --report
  yfslam run DIR --save-map lab.map                    then, another day:
  yfslam run OTHER --load-map lab.map --localise
  yfslam run synth:walking_xyz --fault covered@2+1 --fault late@5+0.5

In the output folder:
  trajectory.txt  all tracked frames, poses as known at the end, world from camera (TUM format)
  keyframes.txt   the keyframes of the map, likewise
  live.txt        all tracked frames, poses as known at their time
  map.ply         landmarks with colour
  run.json        what was run, what became of the frames, times, errors
  config.toml     every setting of this run; give it to --config to repeat it
  overlay/        with --overlay, one picture a frame
  report.html     with --report, all of it on one page: figures, pictures, tables

Ends with success only if a trajectory was produced.";

/// Evenly spread moments of which the report has a picture.
const MOMENTS: usize = 5;

/// Track a sequence: its trajectory, map and report go to a folder.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct RunArgs {
    #[command(flatten)]
    source: SourceArgs,
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
    /// Write `report.html`: errors, trajectory, pictures and times on one page that needs no network.
    #[arg(long, help_heading = "Output")]
    report: bool,
    /// True trajectory in TUM format to judge the result by [default: groundtruth.txt in the folder, if it is there]. The estimator
    /// never sees it.
    #[arg(long, value_name = "FILE", help_heading = "Evaluation")]
    groundtruth: Option<PathBuf>,
    #[command(flatten)]
    matching: MatchArgs,
}

pub fn run(args: &RunArgs, terminal: Terminal) -> Result<()> {
    let config = args.settings.resolve()?;
    let max_diff_ns = args.matching.max_diff_ns()?;
    let detector = load_detector(args, &config)?;
    let identity = detector.as_ref().map(|d| d.identity.clone());
    let boxes = match &identity {
        Some(identity) => BoxSource::Detector(identity),
        None if config.dynamic.method == Method::None => BoxSource::None,
        None if args.source.is_synthetic() => {
            terminal.note("no --detector: the boxes of people come from the renderer, which knows them exactly");
            BoxSource::Renderer
        }
        None => {
            terminal.note("no --detector: the boxes of people come from the folder's boxes.json");
            BoxSource::Folder
        }
    };
    let own_boxes = matches!(boxes, BoxSource::Renderer | BoxSource::Folder);
    let mut source = args.source.open(own_boxes.then_some(&*config.dynamic.movable))?;
    let truth = find_truth(args, &source, terminal)?;
    let out = OutputFolder::prepare(args.out.as_deref(), &source.name)?;
    let pictures = args.overlay.then(|| Overlay::prepare(out.path(), config.dynamic.open_score)).transpose()?;
    let mut moments = args.report.then(|| Moments::new(source.stamps_ns.len(), MOMENTS, config.dynamic.open_score));
    args.map.check()?;
    let (detector, detector_times) = detector.map(|d| (d.detector, d.times)).unzip();
    let slam = args.map.apply(Slam::new(config.clone(), &source.camera.camera, detector)?)?;
    let mut pipeline = Pipeline::new(slam, detector_times);
    drive(&mut source, &mut pipeline, pictures.as_ref(), moments.as_mut(), terminal)?;
    args.map.save(&mut pipeline)?;
    let outcome = pipeline.finish(&config)?;

    let evaluation = truth.as_ref().map(|truth| {
        let expected = ExpectedFrames::StampsNs(source.stamps_ns.clone());
        let options = EvalOptions { max_diff_ns, expected, ..Default::default() };
        judge(&truth.poses, &to_eval(&outcome.trajectory), options)
    });
    out.write(&outcome, &config)?;
    let run = Run {
        sequence: &args.source.sequence,
        source: &source,
        boxes,
        faults: &args.source.faults,
        outcome: &outcome,
        truth: truth.as_ref(),
        evaluation: evaluation.as_ref().and_then(|e| e.as_ref().ok()),
        config: &config,
    };
    let report = Report::new(&run);
    out.write_report(&report)?;
    terminal.result(&summary(&report, &source, &outcome)?)?;
    let page = match moments {
        Some(moments) => {
            let shown = html::Shown { run, pictures: moments.to_pictures()? };
            Some(html::write(&out, vec![shown], &Stages::default())?)
        }
        None => None,
    };
    let judged = show_accuracy(args, evaluation.as_ref(), terminal);
    terminal.result(&format!("\nwritten to {}\n", out.path().display()))?;
    if let Some(page) = page {
        terminal.result(&format!("report: {}\n", page.display()))?;
    }
    judged
}

/// The detector, if the method needs one and the user named one.
fn load_detector(args: &RunArgs, config: &Config) -> Result<Option<LoadedDetector>> {
    let method = match config.dynamic.method {
        Method::None => return Ok(None),
        Method::Boxes => "boxes",
        Method::Yf => "yf",
    };
    match &args.detector.detector {
        Some(file) => Ok(Some(detector::load(&args.detector, file, config)?)),
        None if args.source.knows_boxes() => Ok(None),
        None => bail!(
            "method {method} keeps people out and needs a network that finds them; give --detector FILE.onnx (YOLO-FastestV2 as \
             ONNX with six raw outputs: the official COCO weights or your own training), or --method none to trust every feature"
        ),
    }
}

/// A broken ground truth ends the run if it was asked for; one that merely lies in the folder is passed over.
fn find_truth(args: &RunArgs, source: &Source, terminal: Terminal) -> Result<Option<Truth>> {
    match source.truth(&args.source, args.groundtruth.as_deref(), terminal) {
        Err(error) if args.groundtruth.is_none() => {
            terminal.warn(&format!("no evaluation: {}", explain(&error)));
            Ok(None)
        }
        found => found.context("the ground truth cannot be used"),
    }
}

/// Takes all frames of the source through the pipeline.
fn drive(
    source: &mut Source,
    pipeline: &mut Pipeline,
    pictures: Option<&Overlay>,
    mut moments: Option<&mut Moments>,
    terminal: Terminal,
) -> Result<()> {
    let mut progress = Progress::new(terminal, &source.name, source.stamps_ns.len());
    let mut state = Default::default();
    while let Some(frame) = source.frames.next(&mut pipeline.stages) {
        match frame {
            Ok(frame) => {
                state = pipeline.track(&frame);
                let index = pipeline.frames().total() - 1;
                if let Some(pictures) = pictures {
                    pictures.write(index, &frame, pipeline.slam())?;
                }
                if let Some(moments) = &mut moments {
                    moments.see(index, &frame, pipeline.slam());
                }
            }
            Err(skip) => pipeline.skip(skip),
        }
        progress.frame(pipeline.frames(), state);
    }
    progress.finish();
    Ok(())
}

/// What became of the frames, in a few lines.
fn summary(report: &Report, source: &Source, outcome: &Outcome) -> Result<String> {
    let frames = &outcome.frames;
    let mut text = format!(
        "{}: tracked {} of {} frames ({:.1} %), lost {}, skipped {}; {:.1} frames a second\n",
        source.name,
        frames.tracked,
        frames.total(),
        frames.tracked_percent(),
        frames.lost,
        frames.skipped,
        report.fps
    );
    if frames.skipped > 0 {
        let reasons: Vec<_> =
            frames.skipped_by_reason.iter().map(|(reason, count)| format!("{count} × {reason}")).collect();
        writeln!(
            text,
            "skipped: {}; the first: {}",
            reasons.join(", "),
            frames.first_skipped.as_deref().unwrap_or("-")
        )?;
    }
    if let Some(a) = &report.association
        && a.duplicate_stamps_skipped + a.backward_stamps_skipped + a.unstamped_skipped > 0
    {
        let (duplicate, backward, unstamped) =
            (a.duplicate_stamps_skipped, a.backward_stamps_skipped, a.unstamped_skipped);
        writeln!(
            text,
            "list entries skipped: {duplicate} × duplicate stamp, {backward} × stamp runs backward, {unstamped} × no stamp"
        )?;
    }
    if frames.detector_failures > 0 {
        writeln!(
            text,
            "the detector failed on {} frames, which count as frames without boxes",
            frames.detector_failures
        )?;
    }
    places_summary(&mut text, &outcome.places)?;
    write!(text, "map: {} keyframes, {} landmarks", report.map.keyframes, report.map.landmarks)?;
    if let Some(peak) = report.peak_memory_mb {
        write!(text, "; peak memory {peak:.0} MB")?;
    }
    Ok(text + "\n")
}

fn places_summary(text: &mut String, places: &PlaceTally) -> Result<()> {
    if !places.loops.is_empty() {
        let drifts: Vec<_> = places.loops.iter().map(|l| format!("{:.2} m", l.drift_m)).collect();
        writeln!(text, "loops closed: {}, after a drift of {}", places.loops.len(), drifts.join(", "))?;
    }
    if let Some(longest) = places.lost.iter().map(|stretch| stretch.frames).max() {
        let found = places.lost.iter().filter(|stretch| stretch.found_again).count();
        writeln!(text, "lost {} times, found again {found} times; for {longest} frames at most", places.lost.len())?;
    }
    Ok(())
}

/// Prints the errors; that they cannot be computed is an error if they were asked for.
fn show_accuracy(
    args: &RunArgs,
    evaluation: Option<&Result<Evaluation, yfslam_eval::EvalError>>,
    terminal: Terminal,
) -> Result<()> {
    match evaluation {
        None => Ok(()),
        Some(Ok(evaluation)) => terminal.result(&format!("\n{}", evaluation.table(TableStyle::Plain))),
        Some(Err(error)) if args.groundtruth.is_none() => {
            terminal.warn(&format!("no evaluation: {error}"));
            Ok(())
        }
        Some(Err(error)) => Err(error.clone()).context("the trajectory was written, but it cannot be judged"),
    }
}
