//! The command `yfslam`.
//!
//! ```text
//! arguments ─cli─► command/* ─► source (folder, world) ─► boxes ─► lane, one a method (pipeline: Slam, tallies) ─► output (files)
//! ```

mod accuracy;
mod apart;
mod bench;
mod boxes;
mod class_legend;
mod cli;
mod command;
mod cpu;
mod dense;
mod dense_picture;
mod detector;
mod draw;
mod found;
mod html;
mod lane;
mod map;
mod moments;
mod output;
mod overlay;
mod pipeline;
mod progress;
mod report;
mod runs;
mod settings;
mod source;
mod summary;
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
