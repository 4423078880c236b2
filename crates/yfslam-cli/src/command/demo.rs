//! `yfslam demo`: what the method does, on any machine, without data.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, value_parser};

use super::run::{self, RunArgs};
use crate::input::settings::{MethodArg, describe};
use crate::ui::command_line::quote;
use crate::ui::terminal::Terminal;

const EXAMPLES: &str = "\
Examples:
  yfslam demo
  yfslam demo --frames 60 --out demo
  yfslam demo --methods none,yf --seed 7

In the output folder, `report.html` shows it all; `none/`, `boxes/` and `yf/` hold what `yfslam run` leaves behind.";

/// Render people who walk around a desk, track the camera without and with the dynamic filter, and compare.
///
/// Nothing is downloaded and no data is needed; it takes half a minute on two cores.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct DemoArgs {
    /// Which methods; the others are compared with the first.
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
    /// Seed of the world: its textures, people and paths.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Where results go.
    #[arg(long, value_name = "DIR", default_value = "yfslam-out/demo")]
    out: PathBuf,
}

pub fn run(args: &DemoArgs, terminal: Terminal) -> Result<()> {
    // Four people who cover half of the picture: as crowded as the hardest sequences that people record.
    let spec = format!("synth:walking_xyz?people=4&share=0.5&frames={}&seed={}", args.frames, args.seed);
    let methods: Vec<&str> = args.methods.iter().map(|m| describe(m.method()).0).collect();
    let words = [&spec, "--method", &methods.join(","), "--report", "--out"];
    let words: Vec<OsString> = words.into_iter().map(OsString::from).chain([args.out.clone().into()]).collect();
    let quoted: Vec<String> = words.iter().map(|word| quote(&word.to_string_lossy())).collect();
    terminal.note(&format!("this is `yfslam run {}`", quoted.join(" ")));
    run::run(&RunArgs::of_words(&words)?, terminal)
}
