//! `yfslam demo`: a comparison of methods that needs no data.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, value_parser};

use super::run::{self, RunArgs, WatchArgs};
use crate::input::settings::{MethodArg, describe};
use crate::ui::command_line::quote;
use crate::ui::terminal::Terminal;

const HELP: &str = "\
Examples:
  yfslam demo
  yfslam demo --frames 60 -o demo
  yfslam demo --methods none,yf --seed 7
  yfslam demo --view

Files in the output folder:
  report.html        the comparison
  none/, boxes/ ...  the files of `yfslam run`, one folder for each method";

/// Render people who walk around a desk, track the camera with several methods, and compare them.
///
/// The demo needs no data and no network connection; it takes about half a minute on two cores.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct DemoArgs {
    /// Methods; the others are compared with the first one.
    #[arg(
        long,
        alias = "method",
        value_enum,
        value_name = "METHOD,METHOD",
        value_delimiter = ',',
        default_value = "none,boxes,yf,full"
    )]
    methods: Vec<MethodArg>,
    /// Number of frames.
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = value_parser!(u32).range(3..=1_000_000))]
    frames: u32,
    /// Seed of the synthetic world.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Output folder.
    #[arg(short, long, value_name = "DIR", default_value = "yfslam-out/demo")]
    out: PathBuf,
    #[command(flatten)]
    watch: WatchArgs,
}

pub fn run(args: &DemoArgs, terminal: Terminal) -> Result<()> {
    // Four people cover half of the image, as in the most crowded recordings.
    let spec = format!("synth:walking_xyz?people=4&share=0.5&frames={}&seed={}", args.frames, args.seed);
    let methods: Vec<&str> = args.methods.iter().map(|m| describe(m.method()).0).collect();
    let watch = args.watch.arguments().into_iter().map(OsString::from);
    let arguments = [&spec, "--method", &methods.join(","), "--report", "--out"];
    let arguments: Vec<OsString> =
        arguments.into_iter().map(OsString::from).chain([args.out.clone().into()]).chain(watch).collect();
    let quoted: Vec<String> = arguments.iter().map(|argument| quote(&argument.to_string_lossy())).collect();
    terminal.note(&format!("this is `yfslam run {}`", quoted.join(" ")));
    run::run(&RunArgs::parse(&arguments)?, terminal)
}
