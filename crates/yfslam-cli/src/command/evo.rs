//! `yfslam ape` and `yfslam rpe`: one error of a trajectory, with the options of the tool evo.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use yfslam_eval::{AlignmentKind, Delta, Match, RpeOptions, Statistics, associate, ate, rpe};
use yfslam_report::{TableStyle, errors_table, rpe_errors};

use crate::input::trajectory::{Compared, read_compared};
use crate::ui::terminal::{Terminal, print};

const APE_HELP: &str = "\
Examples:
  yfslam ape groundtruth.txt trajectory.txt -a
  yfslam ape tum groundtruth.txt mono.txt -as
  yfslam ape bag lab.bag /mocap/pose /odom -a

Difference from evo:
  The trajectories are always aligned, with or without -a. `yfslam eval` prints all errors at once.";

const RPE_HELP: &str = "\
Examples:
  yfslam rpe groundtruth.txt trajectory.txt -r angle_deg
  yfslam rpe tum groundtruth.txt trajectory.txt -d 1 -u s --all_pairs

Difference from evo:
  The unit s (seconds) is added. With -r full, both errors are printed, each in its unit. `yfslam eval` prints all errors at once.";

/// Compute the absolute trajectory error (ATE, or APE in evo), with the options of evo.
#[derive(Args, Debug)]
#[command(after_help = APE_HELP)]
pub struct ApeArgs {
    #[command(flatten)]
    common: CommonArgs,
}

/// Compute the relative pose error (RPE), with the options of evo.
#[derive(Args, Debug)]
#[command(after_help = RPE_HELP)]
pub struct RpeArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// Interval between two poses.
    #[arg(short, long, value_name = "N", default_value_t = 1.0)]
    delta: f64,
    /// Unit of the interval: frames, seconds or metres.
    #[arg(short = 'u', long = "delta_unit", value_enum, default_value = "f")]
    unit: Unit,
    /// Start an interval at every pose and not only where the last one ended.
    #[arg(long = "all_pairs")]
    all_pairs: bool,
}

/// Options of both commands.
#[derive(Args, Debug)]
struct CommonArgs {
    /// Ground truth, then the estimated trajectory, in the format of TUM, EuRoC or KITTI; the word `tum`, `euroc` or `kitti` may come
    /// before them. After the word `bag`, a bag and two of its topics.
    #[arg(value_name = "FILE", num_args = 2..=4, required = true)]
    files: Vec<PathBuf>,
    /// Align the trajectories by rotation and translation.
    #[arg(short, long)]
    align: bool,
    /// Correct the scale, too; only together with -a.
    #[arg(short = 's', long = "correct_scale", requires = "align")]
    correct_scale: bool,
    /// Bring the first poses together instead.
    #[arg(long = "align_origin", conflicts_with = "align")]
    align_origin: bool,
    /// Which part of the error is computed.
    #[arg(short = 'r', long = "pose_relation", value_enum, default_value = "trans_part")]
    relation: Relation,
    /// Largest difference between the time stamps of an estimated and a true pose, s.
    #[arg(long = "t_max_diff", value_name = "S", default_value_t = 0.01)]
    t_max_diff: f64,
    /// Not supported.
    #[arg(short, long, hide = true)]
    plot: bool,
    /// Not supported.
    #[arg(long = "save_results", value_name = "FILE", hide = true)]
    save_results: Option<PathBuf>,
}

/// Parts of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
enum Relation {
    /// Translation, m.
    TransPart,
    /// Rotation, degrees.
    AngleDeg,
    /// Translation and rotation.
    Full,
}

/// Units of an interval.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Unit {
    /// Frames.
    F,
    /// Seconds.
    S,
    /// Metres.
    M,
}

pub fn run_ape(args: &ApeArgs, terminal: Terminal) -> Result<()> {
    ensure!(
        args.common.relation == Relation::TransPart,
        "`yfslam ape` computes the error of translation only; use -r trans_part, or `yfslam rpe` for rotation"
    );
    let (matches, path) = args.common.matches(terminal)?;
    let kind = match (args.common.correct_scale, args.common.align_origin) {
        (_, true) => AlignmentKind::Origin,
        (true, false) => AlignmentKind::Sim3,
        (false, false) => AlignmentKind::Se3,
    };
    let error = ate(&matches, kind).with_context(|| cannot_evaluate(path))?;
    print_errors([(format!("ATE, {kind} (m)"), error.translation_m)], matches.len())
}

pub fn run_rpe(args: &RpeArgs, terminal: Terminal) -> Result<()> {
    let options = RpeOptions::new(args.interval()?, args.all_pairs || matches!(args.unit, Unit::S));
    let (mut matches, path) = args.common.matches(terminal)?;
    if args.common.correct_scale {
        matches = ate(&matches, AlignmentKind::Sim3).with_context(|| cannot_evaluate(path))?.alignment.scaled(&matches);
    }
    let [translation, rotation] = rpe_errors(&rpe(&matches, &options).with_context(|| cannot_evaluate(path))?);
    let errors = match args.common.relation {
        Relation::TransPart => vec![translation],
        Relation::AngleDeg => vec![rotation],
        Relation::Full => vec![translation, rotation],
    };
    print_errors(errors, matches.len())
}

impl RpeArgs {
    fn interval(&self) -> Result<Delta> {
        ensure!(self.delta > 0.0 && self.delta.is_finite(), "--delta is {}; give a positive number", self.delta);
        Ok(match self.unit {
            Unit::S => Delta::Seconds(self.delta),
            Unit::M => Delta::Metres(self.delta),
            Unit::F if self.delta.fract() == 0.0 => Delta::Frames(self.delta as usize),
            Unit::F => bail!("--delta is {} frames; give a whole number, or another unit with -u", self.delta),
        })
    }
}

impl CommonArgs {
    /// Reads and associates the trajectories; returns the file of the estimate beside the matches.
    fn matches(&self, terminal: Terminal) -> Result<(Vec<Match>, &Path)> {
        ensure!(!self.plot, "--plot is not supported; `yfslam run --report` writes a page with figures");
        ensure!(
            self.save_results.is_none(),
            "--save_results is not supported; `yfslam eval --json` prints all results"
        );
        let ([truth, estimate], [truth_topic, topic]) = self.files()?;
        ensure!(
            (0.0..=1e6).contains(&self.t_max_diff),
            "--t_max_diff is {}; give seconds, such as 0.01",
            self.t_max_diff
        );
        let max_diff_ns = (self.t_max_diff * 1e9) as u64;
        let flag = "`yfslam ape bag BAG TRUTH-TOPIC TOPIC`";
        let file = |path, topic| Compared { path, topic, flag };
        let files = read_compared(&[file(truth, truth_topic), file(estimate, topic)], None, terminal)?;
        let [reference, poses] = &files[..] else { bail!("give the ground truth and the estimated trajectory") };
        let matches = associate(reference, poses, max_diff_ns).with_context(|| cannot_evaluate(estimate))?;
        Ok((matches, estimate))
    }
}

/// Two files, and their topics.
type Pair<'a> = ([&'a Path; 2], [Option<&'a str>; 2]);

impl CommonArgs {
    /// Returns the files of ground truth and estimate and, where both are topics of one bag, the topics.
    fn files(&self) -> Result<Pair<'_>> {
        let is_bag = |format: &Path| ["bag", "bag2", "mcap"].iter().any(|known| format.as_os_str() == *known);
        let is_text = |format: &Path| ["tum", "kitti", "euroc"].iter().any(|known| format.as_os_str() == *known);
        match &self.files[..] {
            [truth, estimate] => Ok(([truth, estimate], [None, None])),
            [format, bag, truth, estimate] if is_bag(format) => Ok(([bag, bag], [truth.to_str(), estimate.to_str()])),
            [format, truth, estimate] if is_text(format) => Ok(([truth, estimate], [None, None])),
            [format, ..] if is_bag(format) || is_text(format) => {
                bail!("give two files after {}, or after bag a file and two topics", format.display())
            }
            [format, ..] => {
                bail!(
                    "the format {} is not supported; give tum, kitti or euroc, bag with two topics, or leave it out",
                    format.display()
                )
            }
            [] => bail!("give the ground truth and the estimated trajectory"),
        }
    }
}

fn cannot_evaluate(path: &Path) -> String {
    format!("cannot evaluate {}", path.display())
}

fn print_errors(errors: impl IntoIterator<Item = (String, Statistics)>, matches: usize) -> Result<()> {
    print(&format!("{}\n{matches} pairs of poses\n", errors_table(errors).render(TableStyle::Plain)))
}
