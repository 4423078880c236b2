//! The command line: parsing, help and completions follow from one definition of each option.

use std::sync::LazyLock;

use clap::{Parser, Subcommand};

use crate::command::{
    bench, calibrate, camera, completions, config, convert, demo, detect, eval, evo, info, live, map, run, synth,
};
use crate::input::detector::describe_embedded;
use crate::ui::verbosity::Verbosity;

const HELP: &str = "\
Examples:
  yfslam demo                                  compares methods, without data
  yfslam run rgbd_bonn_crowd --camera bonn     tracks a sequence
  yfslam live rgbd_bonn_crowd --camera bonn    the same as it would be on a robot
  yfslam detect photo.jpg --images             detects people
  yfslam eval groundtruth.txt yfslam-out/rgbd_bonn_crowd/trajectory.txt";

/// Visual SLAM for scenes with people: camera trajectory and map from RGB-D, stereo or monocular images.
#[derive(Debug, Parser)]
#[command(name = "yfslam", version, long_version = long_version(), after_help = HELP, arg_required_else_help = true)]
pub struct Cli {
    #[command(flatten)]
    pub verbosity: Verbosity,
    #[command(subcommand)]
    pub command: Command,
}

/// Returns the version and the embedded network.
fn long_version() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| format!("{}\n{}", env!("CARGO_PKG_VERSION"), describe_embedded()));
    &TEXT
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Run(Box<run::RunArgs>),
    Live(Box<live::LiveArgs>),
    Map(map::DenseMapArgs),
    Eval(eval::EvalArgs),
    Ape(evo::ApeArgs),
    Rpe(evo::RpeArgs),
    Convert(convert::ConvertArgs),
    Demo(demo::DemoArgs),
    Detect(detect::DetectArgs),
    Synth(synth::SynthArgs),
    Bench(bench::BenchArgs),
    Calibrate(Box<calibrate::CalibrateArgs>),
    Camera(camera::CameraArgs),
    Info(Box<info::InfoArgs>),
    Config(config::ConfigArgs),
    Completions(completions::CompletionsArgs),
}
