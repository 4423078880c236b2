//! `yfslam convert`: a trajectory in another format.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use yfslam_io::trajectory::{TrajectoryFormat, write_trajectory_as};

use crate::input::trajectory::{Compared, read_compared};
use crate::ui::terminal::{Terminal, print};

const HELP: &str = "\
Examples:
  yfslam convert trajectory.txt trajectory.csv --to euroc
  yfslam convert poses/00.txt 00.txt --to tum --times sequences/00/times.txt
  yfslam convert lab.mcap mocap.txt --to tum --topic /mocap/pose
  yfslam convert lab.mcap base.txt --to tum --topic /tf:map.base_link";

/// Convert a trajectory between the formats of TUM, EuRoC and KITTI, or from a bag.
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
    /// Topic of a bag: poses, odometry or transforms; of TF with two frames, as in /tf:map.base_link [default: the only one].
    #[arg(long, value_name = "TOPIC")]
    topic: Option<String>,
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
    /// Nanoseconds, position, quaternion x y z w, with commas and a header.
    VslamLab,
}

pub fn run(args: &ConvertArgs, terminal: Terminal) -> Result<()> {
    let same = args.input.canonicalize().ok().zip(args.output.canonicalize().ok()).is_some_and(|(a, b)| a == b);
    ensure!(!same, "{} is input and output; give another output", args.input.display());
    let input = Compared::of(&args.input, &args.topic, "--topic");
    let poses = read_compared(&[input], args.times.as_deref(), terminal)?.pop().unwrap_or_default();
    let format = match args.to {
        FormatArg::Tum => TrajectoryFormat::Tum,
        FormatArg::Euroc => TrajectoryFormat::Euroc,
        FormatArg::Kitti => TrajectoryFormat::Kitti,
        FormatArg::VslamLab => TrajectoryFormat::VslamLab,
    };
    write_trajectory_as(&args.output, &poses, format)?;
    print(&format!("{} poses written to {}\n", poses.len(), args.output.display()))
}
