//! The command `yfslam`.
//!
//! ```text
//! arguments ─cli─► command/* ─► source (folder, synthetic world) ─► pipeline (Slam, what became of each frame) ─► output (files)
//! ```

mod accuracy;
mod bench;
mod cli;
mod command;
mod cpu;
mod detector;
mod draw;
mod html;
mod map;
mod moments;
mod output;
mod overlay;
mod pipeline;
mod progress;
mod report;
mod settings;
mod source;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    match command::run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if terminal::is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            terminal::error(&error);
            ExitCode::FAILURE
        }
    }
}
