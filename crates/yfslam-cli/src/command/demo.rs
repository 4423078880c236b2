//! `yfslam demo`: what the method does, on any machine, without data.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{Args, value_parser};
use yfslam::dynamic::Method;
use yfslam::{Config, Slam};
use yfslam_eval::{EvalOptions, Evaluation, ExpectedFrames, Table, TableStyle, improvement_percent};

use crate::accuracy::{judge, to_eval};
use crate::html;
use crate::moments::Moments;
use crate::output::OutputFolder;
use crate::pipeline::{Outcome, Pipeline, Stages};
use crate::progress::Progress;
use crate::report::{BoxSource, Report, Run};
use crate::settings::{MethodArg, describe};
use crate::source::{Source, SourceArgs};
use crate::terminal::{Terminal, explain};

const EXAMPLES: &str = "\
Examples:
  yfslam demo
  yfslam demo --frames 60 --out demo
  yfslam demo --methods none,yf --seed 7

In the output folder, `report.html` shows it all; `none/`, `boxes/` and `yf/` hold what `yfslam run` leaves behind.";

/// Evenly spread moments of which the report has a picture for every method.
const MOMENTS: usize = 3;

/// Render people who walk around a desk, track the camera without and with the dynamic filter, and compare.
///
/// Nothing is downloaded and no data is needed; it takes half a minute on two cores.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct DemoArgs {
    /// Which methods; the others are compared with the first.
    #[arg(long, value_enum, value_name = "METHOD,METHOD", value_delimiter = ',', default_value = "none,boxes,yf")]
    methods: Vec<MethodArg>,
    /// Number of frames.
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = value_parser!(u32).range(3..=1_000_000))]
    frames: u32,
    /// Seed of the world: its textures, people and paths.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Where results go [default: yfslam-out/demo].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// One of those that are compared, at work.
struct Contender {
    config: Config,
    pipeline: Pipeline,
    moments: Moments,
}

/// One of those that are compared, when it is done.
struct Judged {
    config: Config,
    outcome: Outcome,
    evaluation: Option<Evaluation>,
    moments: Moments,
}

pub fn run(args: &DemoArgs, terminal: Terminal) -> Result<()> {
    // Four people who cover half of the picture: as crowded as the hardest sequences that people record.
    let spec = format!("synth:walking_xyz?people=4&share=0.5&frames={}&seed={}", args.frames, args.seed);
    let out = OutputFolder::prepare(args.out.as_deref(), "demo")?;
    terminal.note(&format!("rendering {spec}; the boxes of people come from the renderer, not from a network"));
    let mut source = SourceArgs::new(spec.clone()).open(Some(&Config::default().dynamic.movable))?;
    let mut contenders = contenders(args, &source)?;
    let rendering = drive(&mut source, &mut contenders, terminal);

    let truth = source.truth_of_world();
    let poses = truth.as_ref().map_or(&[][..], |truth| &truth.poses);
    let judged: Vec<Judged> = contenders.into_iter().filter_map(|c| c.finish(&source, poses, terminal)).collect();
    if judged.is_empty() {
        bail!("no method has a trajectory; give more --frames or another --seed");
    }
    let mut shown = Vec::new();
    for Judged { config, outcome, evaluation, moments } in &judged {
        let method = config.dynamic.method;
        let run = Run {
            sequence: &spec,
            source: &source,
            boxes: if method == Method::None { BoxSource::None } else { BoxSource::Renderer },
            faults: &[],
            outcome,
            truth: truth.as_ref(),
            evaluation: evaluation.as_ref(),
            config,
        };
        let (name, _) = describe(method);
        let folder = OutputFolder::prepare(Some(&out.path().join(name)), name)?;
        folder.write(outcome, config)?;
        folder.write_report(&Report::new(&run))?;
        shown.push(html::Shown { run, pictures: moments.to_pictures()? });
    }
    let page = html::write(&out, shown, &rendering)?;
    terminal.result(&text(&judged))?;
    terminal.result(&format!("\nwritten to {}\nreport: {}\n", out.path().display(), page.display()))
}

fn contenders(args: &DemoArgs, source: &Source) -> Result<Vec<Contender>> {
    let mut methods: Vec<Method> = Vec::new();
    for method in args.methods.iter().map(|m| m.method()) {
        if !methods.contains(&method) {
            methods.push(method);
        }
    }
    let contender = |method| {
        let mut config = Config::default();
        config.dynamic.method = method;
        let pipeline = Pipeline::new(Slam::new(config.clone(), &source.camera.camera, None)?, None);
        let moments = Moments::new(source.stamps_ns.len(), MOMENTS, config.dynamic.open_score);
        Ok(Contender { config, pipeline, moments })
    };
    methods.into_iter().map(contender).collect()
}

/// Takes each frame, rendered once, through all pipelines. Returns the times of rendering.
fn drive(source: &mut Source, contenders: &mut [Contender], terminal: Terminal) -> Stages {
    let mut progress = Progress::new(terminal, "demo", source.stamps_ns.len());
    let mut rendering = Stages::default();
    while let Some(frame) = source.frames.next(&mut rendering) {
        // Rendered frames are always usable.
        let Ok(frame) = frame else { continue };
        for Contender { pipeline, moments, .. } in &mut *contenders {
            let state = pipeline.track(&frame);
            moments.see(pipeline.frames().total() - 1, &frame, pipeline.slam());
            progress.frame(pipeline.frames(), state);
        }
    }
    progress.finish();
    rendering
}

impl Contender {
    /// The result; `None` if there is no trajectory, having said so.
    fn finish(self, source: &Source, truth: &[yfslam_eval::StampedPose], terminal: Terminal) -> Option<Judged> {
        let Self { config, pipeline, moments } = self;
        let (name, _) = describe(config.dynamic.method);
        let outcome = match pipeline.finish(&config) {
            Ok(outcome) => outcome,
            Err(error) => {
                terminal.warn(&format!("{name}: {}", explain(&error)));
                return None;
            }
        };
        let expected = ExpectedFrames::StampsNs(source.stamps_ns.clone());
        let evaluation = judge(truth, &to_eval(&outcome.trajectory), EvalOptions { expected, ..Default::default() });
        let evaluation = evaluation.inspect_err(|error| terminal.warn(&format!("{name}: no evaluation: {error}"))).ok();
        Some(Judged { config, outcome, evaluation, moments })
    }
}

/// The errors side by side, as in Table 2 of the paper.
fn text(judged: &[Judged]) -> String {
    let headers =
        ["ATE (m)", "RMSE", "S.D.", "mean", "median", "max", "improve RMSE (%)", "S.D. (%)", "frames tracked"];
    let mut table = Table::new(headers);
    let original = judged.first().and_then(|first| first.evaluation.as_ref()).map(|e| e.ate.translation_m);
    for (place, Judged { config, outcome, evaluation, .. }) in judged.iter().enumerate() {
        let (name, summary) = describe(config.dynamic.method);
        let errors = evaluation.as_ref().map(|e| e.ate.translation_m);
        let figures = match errors {
            Some(s) => [s.rmse, s.std, s.mean, s.median, s.max].map(|v| format!("{v:.4}")),
            None => std::array::from_fn(|_| "-".to_owned()),
        };
        let improvement = match errors.zip(original) {
            Some((ours, original)) if place > 0 => {
                [(ours.rmse, original.rmse), (ours.std, original.std)].map(|(ours, original)| {
                    improvement_percent(ours, original).map_or("-".to_owned(), |percent| format!("{percent:.2}"))
                })
            }
            _ => Default::default(),
        };
        let tracked = format!("{} of {}", outcome.frames.tracked, outcome.frames.total());
        table.push([format!("{name}: {summary}")].into_iter().chain(figures).chain(improvement).chain([tracked]));
    }
    format!(
        "walking_xyz, synthetic, exact ground truth, boxes from the renderer\n\n{}",
        table.render(TableStyle::Plain)
    )
}
