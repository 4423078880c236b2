//! One file per subcommand.

pub mod bench;
pub mod calibrate;
pub mod camera;
pub mod cli;
pub mod completions;
pub mod config;
pub mod convert;
pub mod demo;
pub mod detect;
pub mod eval;
pub mod evo;
pub mod info;
pub mod live;
pub mod map;
pub mod run;
pub mod synth;

use anyhow::Result;
use clap::CommandFactory;

use self::cli::{Cli, Command};
use crate::ui::terminal::Terminal;

/// Runs the requested command.
///
/// # Errors
/// The command failed; the message says why and what to do.
pub fn run(cli: &Cli) -> Result<()> {
    let terminal = Terminal::new(cli.verbosity);
    match &cli.command {
        Command::Run(args) => run::run(args, terminal),
        Command::Live(args) => live::run(args, terminal),
        Command::Map(args) => map::run(args, terminal),
        Command::Eval(args) => eval::run(args, terminal),
        Command::Convert(args) => convert::run(args, terminal),
        Command::Ape(args) => evo::run_ape(args, terminal),
        Command::Rpe(args) => evo::run_rpe(args, terminal),
        Command::Demo(args) => demo::run(args, terminal),
        Command::Detect(args) => detect::run(args, terminal),
        Command::Bench(args) => bench::run(args, terminal),
        Command::Synth(args) => synth::run(args, terminal),
        Command::Calibrate(args) => calibrate::run(args, terminal),
        Command::Camera(args) => camera::run(args),
        Command::Info(args) => info::run(args),
        Command::Config(args) => config::run(args),
        Command::Completions(args) => completions::run(args, Cli::command()),
    }
}
