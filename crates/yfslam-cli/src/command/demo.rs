//! `yfslam demo`: what the method does, on any machine, without data.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, value_parser};
use yfslam::Config;
use yfslam::dynamic::Method;
use yfslam_eval::{EvalOptions, Evaluation, ExpectedFrames, Table, TableStyle, improvement_percent};

use crate::accuracy::{judge, to_eval};
use crate::output::OutputFolder;
use crate::pipeline::{Outcome, Pipeline};
use crate::progress::Progress;
use crate::report::{BoxSource, Report, Run};
use crate::source::SourceArgs;
use crate::terminal::Terminal;

const EXAMPLES: &str = "\
Examples:
  yfslam demo
  yfslam demo --frames 60 --out /tmp/demo

In the output folder, `none/` and `yf/` hold what `yfslam run` leaves behind.";

/// Render people who walk around a desk, track the camera without and with the dynamic filter, and compare.
///
/// Nothing is downloaded and no data is needed; it takes half a minute on two cores.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct DemoArgs {
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

/// The two that are compared.
const METHODS: [(&str, Method); 2] = [("none", Method::None), ("yf", Method::Yf)];

pub fn run(args: &DemoArgs, terminal: Terminal) -> Result<()> {
    // Four people who cover half of the picture: as crowded as the hardest sequences that people record.
    let spec = format!("synth:walking_xyz?people=4&share=0.5&frames={}&seed={}", args.frames, args.seed);
    let out = OutputFolder::prepare(args.out.as_deref(), "demo")?;
    terminal.note(&format!("rendering {spec}; the boxes of people come from the renderer, not from a network"));
    let mut source = SourceArgs::new(spec.clone()).open(true)?;
    let configs = METHODS.map(|(_, method)| {
        let mut config = Config::default();
        config.dynamic.method = method;
        config
    });

    let mut pipelines = Vec::new();
    for config in &configs {
        pipelines.push(Pipeline::new(config, &source.camera.camera, None)?);
    }
    let mut progress = Progress::new(terminal, "demo", source.stamps_ns.len());
    let mut rendering = Default::default();
    while let Some(frame) = source.frames.next(&mut rendering) {
        // Rendered frames are always usable.
        let Ok(frame) = frame else { continue };
        for pipeline in &mut pipelines {
            let state = pipeline.track(&frame);
            progress.frame(pipeline.frames(), state);
        }
    }
    progress.finish();

    let truth = source.truth_of_world();
    let mut judged = Vec::new();
    for ((pipeline, config), (name, method)) in pipelines.into_iter().zip(&configs).zip(METHODS) {
        let outcome = pipeline.finish(config)?;
        let expected = ExpectedFrames::StampsNs(source.stamps_ns.clone());
        let options = EvalOptions { expected, ..Default::default() };
        let poses = truth.as_ref().map_or(&[][..], |truth| &truth.poses);
        let evaluation = judge(poses, &to_eval(&outcome.trajectory), options)?;
        let folder = OutputFolder::prepare(Some(&out.path().join(name)), name)?;
        folder.write(&outcome, config)?;
        folder.write_report(&Report::new(&Run {
            sequence: &spec,
            source: &source,
            boxes: if method == Method::None { BoxSource::None } else { BoxSource::Renderer },
            faults: &[],
            outcome: &outcome,
            truth: truth.as_ref(),
            evaluation: Some(&evaluation),
            config,
        }))?;
        judged.push((outcome, evaluation));
    }
    if let [none, yf] = judged.as_slice() {
        terminal.result(&text(none, yf))?;
    }
    terminal.result(&format!("\nwritten to {}\n", out.path().display()))
}

/// The errors side by side, as in Table 2 of the paper.
fn text(none: &(Outcome, Evaluation), yf: &(Outcome, Evaluation)) -> String {
    let mut table = Table::new(["ATE (m)", "RMSE", "S.D.", "median", "max", "frames tracked"]);
    for (name, (outcome, evaluation)) in [("none: all features", none), ("yf: people kept out", yf)] {
        let s = evaluation.ate.translation_m;
        let figures = [s.rmse, s.std, s.median, s.max].map(|v| format!("{v:.4}"));
        let tracked = format!("{} of {}", outcome.frames.tracked, outcome.frames.total());
        table.push([name.to_owned()].into_iter().chain(figures).chain([tracked]));
    }
    let (n, y) = (none.1.ate.translation_m, yf.1.ate.translation_m);
    let better = [(y.rmse, n.rmse), (y.std, n.std), (y.median, n.median), (y.max, n.max)]
        .map(|(ours, original)| improvement_percent(ours, original).map_or("-".to_owned(), |v| format!("{v:.2}")));
    table.push(["improvement (%)".to_owned()].into_iter().chain(better));
    format!(
        "walking_xyz, synthetic, exact ground truth, boxes from the renderer\n\n{}",
        table.render(TableStyle::Plain)
    )
}
