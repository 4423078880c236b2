//! `yfslam convert`: a trajectory in another format.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use yfslam_io::trajectory::{TrajectoryFormat, write_trajectory_as};

use crate::input::trajectory::read_compared;
use crate::ui::terminal::{Terminal, print};

const HELP: &str = "\
Examples:
  yfslam convert trajectory.txt trajectory.csv --to euroc
  yfslam convert poses/00.txt 00.txt --to tum --times sequences/00/times.txt";

/// Convert a trajectory between the formats of TUM, EuRoC and KITTI.
///
/// The format of the input is recognised by its content; poses and frames stay as they are.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct ConvertArgs {
    /// Trajectory to read.
    input: PathBuf,
    /// File to write.
    output: PathBuf,
    /// Format to write.
    #[arg(long, value_enum, value_name = "FORMAT")]
    to: FormatArg,
    /// Times of the poses of a file in the format of KITTI, in seconds, one in each line.
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
}

/// Formats of trajectories.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    /// Seconds, position, quaternion x y z w.
    Tum,
    /// Nanoseconds, position, quaternion w x y z, with commas.
    Euroc,
    /// Twelve numbers of a matrix, without times.
    Kitti,
}

pub fn run(args: &ConvertArgs, terminal: Terminal) -> Result<()> {
    let same = args.input.canonicalize().ok().zip(args.output.canonicalize().ok()).is_some_and(|(a, b)| a == b);
    ensure!(!same, "{} is input and output; give another output", args.input.display());
    let poses = read_compared(&[&args.input], args.times.as_deref(), terminal)?.pop().unwrap_or_default();
    let format = match args.to {
        FormatArg::Tum => TrajectoryFormat::Tum,
        FormatArg::Euroc => TrajectoryFormat::Euroc,
        FormatArg::Kitti => TrajectoryFormat::Kitti,
    };
    write_trajectory_as(&args.output, &poses, format)?;
    print(&format!("{} poses written to {}\n", poses.len(), args.output.display()))
}
