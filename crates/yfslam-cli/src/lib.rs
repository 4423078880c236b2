//! The command `yfslam`, as a library, so that other packages can carry it: [`run_program`] is its `main`.
//!
//! ```text
//! command ─► output ─► run ─► input ─► ui ─► stats        (and draw, which uses none of the others)
//! ```
//!
//! An arrow points from a folder to the folders that it may use; `tests/structure.rs` checks it.
//!
//! [`recording`] is the input of `yfslam run`, for the Python package.
#![forbid(unsafe_code)]

mod command;
mod draw;
mod input;
mod output;
pub mod recording;
mod run;
mod stats;
mod ui;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;

use ui::interrupt::Interrupted;
pub use ui::program::{ProgramFiles, set_files};
use ui::{messages, terminal};

/// Runs the program with these arguments, the first of which is its name, and returns its exit code. Help and wrong arguments end the
/// process.
pub fn run_program(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = command::cli::Cli::parse_from(arguments);
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
