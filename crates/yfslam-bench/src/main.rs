//! The program `yfslam-bench`.
#![allow(clippy::print_stdout, reason = "the tables are the output of this program")]

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, Parser, Subcommand};
use yfslam_bench::{dense, places, render, root, row, topics};

/// Measures yfslam and writes the pages of results.
#[derive(Parser)]
#[command(name = "yfslam-bench", version)]
struct Cli {
    #[command(subcommand)]
    command: Subcommands,
}

#[derive(Subcommand)]
enum Subcommands {
    /// Measure a topic, or all of them: what the records do not have for this commit, network and machine.
    Measure(MeasureArgs),
    /// Write the pages in docs/results and the table of README.md from the records.
    Render(RenderArgs),
    /// Compare the pages with the records; fails if they differ.
    Check,
    /// Run an experiment on loops, relocalisation, long or live runs, and print its table.
    Places(places::Arguments),
    /// Compare dense maps of rendered worlds with the exact world, and print the table.
    Dense(dense::Arguments),
}

#[derive(Args)]
struct RenderArgs {
    /// Folder of the records [default: docs/results/data].
    #[arg(long)]
    data: Option<PathBuf>,
    /// Write the pages to this folder instead, also those of records that were measured with --quick.
    #[arg(long)]
    preview: Option<PathBuf>,
}

#[derive(Args)]
struct MeasureArgs {
    /// The topic: all, recordings, synthetic, monocular, stereo, shutter, cost, instructions, dense, loops, ablation or faults.
    topic: String,
    /// Folder of the recordings, as CONTRIBUTING.md describes it [default: YFSLAM_DATA, else ../shared/data].
    #[arg(long)]
    data: Option<PathBuf>,
    /// Folder of the records [default: docs/results/data].
    #[arg(long)]
    out: Option<PathBuf>,
    /// The program to measure [default: the release build of this project, which is built first].
    #[arg(long)]
    yfslam: Option<PathBuf>,
    /// Try the topic with tiny settings. The figures are no results, so --out must name another folder.
    #[arg(long)]
    quick: bool,
}

fn main() -> Result<()> {
    match Cli::parse().command {
        Subcommands::Measure(arguments) => measure(&arguments),
        Subcommands::Render(arguments) => {
            let root = root();
            let data = arguments.data.unwrap_or_else(|| root.join(render::DATA));
            for page in render::write(&root, &data, arguments.preview.as_deref())? {
                println!("written: {}", page.display());
            }
            Ok(())
        }
        Subcommands::Check => render::check(&root()),
        Subcommands::Places(arguments) => {
            print!("{}", row::table(&places::measure(&arguments)?));
            Ok(())
        }
        Subcommands::Dense(arguments) => {
            print!("{}", row::table(&dense::measure(&arguments)?));
            Ok(())
        }
    }
}

fn measure(arguments: &MeasureArgs) -> Result<()> {
    let root = root();
    ensure!(!arguments.quick || arguments.out.is_some(), "--quick needs --out: its figures are no results");
    let chosen = topics::named(&arguments.topic)?;
    let program = match &arguments.yfslam {
        Some(path) => path.clone(),
        None => build(&root)?,
    };
    let data = arguments.data.clone().or_else(|| std::env::var_os("YFSLAM_DATA").map(PathBuf::from));
    let data = data.unwrap_or_else(|| root.join("../shared/data"));
    let data = data.canonicalize().unwrap_or(data);
    let work = std::env::temp_dir().join(format!("yfslam-bench-{}", std::process::id()));
    let setup = topics::setup(&root, program, data, work.clone(), arguments.quick)?;
    println!("measuring {}", setup.state);
    let records = arguments.out.clone().unwrap_or_else(|| root.join(render::DATA));
    let mut failures = Vec::new();
    for topic in chosen {
        failures.extend(topics::measure(topic, &setup, &records, &|text| println!("{text}"))?);
    }
    let _ = std::fs::remove_dir_all(work);
    if !failures.is_empty() {
        bail!("{} parts could not be measured:\n{}", failures.len(), failures.join("\n"));
    }
    Ok(())
}

/// Builds the program and returns its path.
fn build(root: &Path) -> Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let words = ["build", "--release", "--quiet", "-p", "yfslam-cli"];
    let status = Command::new(cargo).current_dir(root).args(words).status().context("cannot run cargo")?;
    ensure!(status.success(), "cargo could not build the program");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    Ok(target.join("release/yfslam"))
}
