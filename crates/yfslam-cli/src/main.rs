//! The command `yfslam`.
//!
//! ```text
//! command ─► output ─► run ─► input ─► ui ─► stats        (and draw, which uses none of the others)
//! ```
//!
//! An arrow points from a folder to the folders that it may use; `tests/structure.rs` checks it.

mod command;
mod draw;
mod input;
mod output;
mod run;
mod stats;
mod ui;

use std::process::ExitCode;

use clap::Parser;

use ui::terminal;

fn main() -> ExitCode {
    let cli = command::cli::Cli::parse();
    match command::run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if terminal::is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            terminal::error(&error);
            ExitCode::FAILURE
        }
    }
}
