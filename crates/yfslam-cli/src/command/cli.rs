//! The command line: one definition per flag, from which parsing, help and completions follow.

use std::sync::LazyLock;

use clap::{Parser, Subcommand};

use crate::command::{bench, completions, config, demo, detect, eval, info, map, run, synth};
use crate::input::detector::describe_embedded;
use crate::ui::verbosity::Verbosity;

const EXAMPLES: &str = "\
Examples:
  yfslam demo                                        what it does, on any machine, without data
  yfslam run rgbd_bonn_crowd --camera bonn
  yfslam detect photo.jpg --pictures
  yfslam eval groundtruth.txt yfslam-out/rgbd_bonn_crowd/trajectory.txt";

/// RGB-D SLAM for scenes in which people walk: frames in, the camera's trajectory out.
#[derive(Debug, Parser)]
#[command(name = "yfslam", version, long_version = long_version(), after_help = EXAMPLES, arg_required_else_help = true)]
pub struct Cli {
    #[command(flatten)]
    pub verbosity: Verbosity,
    #[command(subcommand)]
    pub command: Command,
}

/// The version, and which network is embedded.
fn long_version() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| format!("{}\n{}", env!("CARGO_PKG_VERSION"), describe_embedded()));
    &TEXT
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Run(Box<run::RunArgs>),
    Map(map::DenseMapArgs),
    Eval(eval::EvalArgs),
    Demo(demo::DemoArgs),
    Detect(detect::DetectArgs),
    Synth(synth::SynthArgs),
    Bench(bench::BenchArgs),
    Info(info::InfoArgs),
    Config(config::ConfigArgs),
    Completions(completions::CompletionsArgs),
}
