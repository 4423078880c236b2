//! Measures yfslam and writes the pages of results.
#![allow(clippy::print_stdout, reason = "the tables are the output of this program")]

mod dense;
mod places;

use anyhow::Result;
use clap::{Parser, Subcommand};

#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Loops, relocalisation, long and live runs.
    Places(places::Arguments),
    /// Dense maps against the exact world.
    Dense(dense::Arguments),
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Places(arguments) => places::run(arguments),
        Command::Dense(arguments) => dense::run(arguments),
    }
}
