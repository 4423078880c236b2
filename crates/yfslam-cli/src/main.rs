//! The command `yfslam`.
//!
//! ```text
//! command ─► output ─► run ─► input ─► ui ─► stats        (and draw, which uses none of the others)
//! ```
//!
//! An arrow points from a folder to the folders that it may use; `tests/structure.rs` checks it.
#![forbid(unsafe_code)]

mod command;
mod draw;
mod input;
mod output;
mod run;
mod stats;
mod ui;

use std::process::ExitCode;

use clap::Parser;

use ui::interrupt::Interrupted;
use ui::{messages, terminal};

fn main() -> ExitCode {
    let cli = command::cli::Cli::parse();
    let code = match command::run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if terminal::is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            terminal::print_error(&error);
            error.downcast_ref::<Interrupted>().map_or(ExitCode::FAILURE, |interrupted| interrupted.exit_code())
        }
    };
    messages::flush();
    code
}
