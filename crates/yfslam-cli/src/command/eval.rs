//! `yfslam eval`: compares an estimated trajectory with the ground truth.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde::Serialize;
use yfslam_eval::{
    AlignmentKind, Calibration, Delta, EvalOptions, Evaluation, RpeOptions, StampedPose, Statistics, calibrate,
    evaluate, improvement_percent,
};
use yfslam_report::{Table, TableStyle, evaluation_table};

use crate::input::trajectory::{Compared, read_compared};
use crate::output::plots::{Plotted, figures, name_of, write_figures};
use crate::run::evaluation::{EvaluationArgs, ScaleSource, evaluate_possible, scale_warning};
use crate::ui::terminal::{Terminal, print};

const HELP: &str = "\
Examples:
  yfslam eval groundtruth.txt yfslam-out/walk/trajectory.txt
  yfslam eval groundtruth.txt yf.txt --versus none.txt       improvement, equation 3 of the YF-SLAM paper
  yfslam eval groundtruth.txt live.txt --delta 1f --delta 0.5m --json
  yfslam eval groundtruth.txt mono.txt --align sim3
  yfslam eval poses/00.txt kitti.txt --times sequences/00/times.txt
  yfslam eval data.csv trajectory.txt --calibrate            lever arm and time offset to the body of the ground truth
  yfslam eval lab.bag lab.bag --truth-topic /mocap/pose --topic /odom
  yfslam eval lab.mcap trajectory.txt --truth-topic /tf:map.camera_link

File formats, recognised by their content, in any combination:
  TUM     `t tx ty tz qx qy qz qw` in each line, with blanks or commas
  EuRoC   `nanoseconds,px,py,pz,qw,qx,qy,qz,…`, with commas
  KITTI   twelve numbers of a matrix in each line, without a time; also sixteen
  bag     .bag, .mcap, .db3 or a folder of rosbag2, with PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped or TF;
          /tf:map.base_link is the pose of base_link in map, composed of all transforms between them, also of /tf_static

Other tools:
  The errors equal those of the tools of the TUM RGB-D benchmark and of evo. For --max-difference-ms, the former use 20, the latter 10;
  the ground truth of Bonn needs 20. `yfslam ape` and `yfslam rpe` take the options of evo.";

/// Compute the absolute (ATE, also called APE) and relative (RPE) error of an estimated trajectory.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct EvalArgs {
    /// Ground truth in the format of TUM, EuRoC or KITTI, or a bag.
    groundtruth: PathBuf,
    /// Estimated trajectory in one of these formats.
    estimate: PathBuf,
    /// Another estimate; the improvement of the first one over it is printed.
    #[arg(long, value_name = "OTHER")]
    versus: Option<PathBuf>,
    #[command(flatten)]
    evaluation: EvaluationArgs,
    /// Interval of the relative error in frames (1f), seconds (1s) or metres (0.5m); can be given several times [default: 1f 1s].
    #[arg(long, value_name = "INTERVAL", help_heading = "Evaluation")]
    delta: Vec<Interval>,
    /// Start an interval at every pose and not only where the last one ended; intervals in seconds always do.
    #[arg(long, help_heading = "Evaluation")]
    all_pairs: bool,
    /// Times of the poses of files in the format of KITTI, in seconds, one in each line.
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    /// Topic of the ground truth in a bag: poses, odometry or transforms; of TF with two frames, as in /tf:map.base_link [default: the only one].
    #[arg(long, value_name = "TOPIC", help_heading = "Bags")]
    truth_topic: Option<String>,
    /// Topic of the estimate in a bag.
    #[arg(long, value_name = "TOPIC", help_heading = "Bags")]
    topic: Option<String>,
    /// Topic of the other estimate in a bag.
    #[arg(long, value_name = "TOPIC", requires = "versus", help_heading = "Bags")]
    versus_topic: Option<String>,
    /// Also fit lever arm, time offset and scale between the body of the ground truth and the camera; the error that remains is printed
    /// apart, because it has more free parameters than the usual one.
    #[arg(long, help_heading = "Evaluation")]
    calibrate: bool,
    /// Write figures of trajectories and errors into this folder, as SVG and PDF.
    #[arg(long, value_name = "DIR")]
    plots: Option<PathBuf>,
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
}

impl EvalArgs {
    /// Returns the files in the order ground truth, estimate, other estimate.
    fn compared(&self) -> Vec<Compared<'_>> {
        let truth = Compared::of(&self.groundtruth, &self.truth_topic, "--truth-topic");
        let estimate = Compared::of(&self.estimate, &self.topic, "--topic");
        let other = self.versus.as_ref().map(|path| Compared::of(path, &self.versus_topic, "--versus-topic"));
        [truth, estimate].into_iter().chain(other).collect()
    }
}

/// An interval as the user writes it.
#[derive(Clone, Copy, Debug)]
struct Interval(Delta);

impl FromStr for Interval {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refuse = || format!("'{text}' is not an interval; write frames as 1f, seconds as 1s, metres as 0.5m");
        let (number, unit) = text.split_at_checked(text.len().saturating_sub(1)).ok_or_else(refuse)?;
        let positive = || number.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite()).ok_or_else(refuse);
        Ok(Self(match unit {
            "f" => Delta::Frames(number.parse().ok().filter(|n| *n > 0).ok_or_else(refuse)?),
            "s" => Delta::Seconds(positive()?),
            "m" => Delta::Metres(positive()?),
            _ => return Err(refuse()),
        }))
    }
}

impl Interval {
    /// Returns the options with the default choice of pairs.
    fn options(self) -> RpeOptions {
        match self.0 {
            Delta::Seconds(_) => RpeOptions { delta: self.0, ..RpeOptions::per_second() },
            Delta::Frames(_) | Delta::Metres(_) => RpeOptions::new(self.0, false),
        }
    }
}

/// The output as JSON.
#[derive(Serialize)]
struct Comparison {
    estimate: Evaluation,
    #[serde(skip_serializing_if = "Option::is_none")]
    versus: Option<Evaluation>,
    #[serde(skip_serializing_if = "Option::is_none")]
    improvement_percent: Option<Vec<Improvement>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    calibration: Option<Calibration>,
}

/// Improvement of the estimate over the other one, % (equation 3 of the paper); `null` where it is undefined.
#[derive(Serialize)]
struct Improvement {
    error: String,
    rmse: Option<f64>,
    mean: Option<f64>,
    median: Option<f64>,
    std: Option<f64>,
}

pub fn run(args: &EvalArgs, terminal: Terminal) -> Result<()> {
    let files = read_compared(&args.compared(), args.times.as_deref(), terminal)?;
    let [truth, estimate, others @ ..] = &files[..] else {
        bail!("give the ground truth and the estimated trajectory")
    };
    if let Some(warning) = swapped(&args.groundtruth, &args.estimate) {
        terminal.warn(&warning);
    }
    let max_diff_ns = args.evaluation.max_diff_ns()?;
    let evaluated = |path: &Path, estimate: &[StampedPose]| -> Result<Evaluation> {
        let options = options(args, max_diff_ns);
        // A requested interval must exist; a default one may be missing.
        let evaluation = if args.delta.is_empty() {
            evaluate_possible(truth, estimate, options)
        } else {
            evaluate(truth, estimate, &options)
        };
        evaluation.with_context(|| format!("cannot evaluate {} against {}", path.display(), args.groundtruth.display()))
    };
    let evaluation = evaluated(&args.estimate, estimate)?;
    if let Some(warning) =
        scale_warning(&evaluation, ScaleSource::Unknown).filter(|_| evaluation.ate.alignment.kind == AlignmentKind::Se3)
    {
        terminal.warn(&warning);
    }
    let versus = args.versus.as_deref().zip(others.first()).map(|(path, other)| evaluated(path, other)).transpose()?;
    if let Some(folder) = &args.plots {
        let plotted = |path: &Path, trajectory, evaluation| Plotted { name: name_of(path), trajectory, evaluation };
        let second = args.versus.as_deref().zip(others.first()).zip(versus.as_ref());
        let second = second.map(|((path, other), versus)| plotted(path, other, versus));
        let estimates: Vec<Plotted> =
            [plotted(&args.estimate, estimate, &evaluation)].into_iter().chain(second).collect();
        let figures = figures(&name_of(&args.groundtruth), truth, &estimates);
        write_figures(folder, "", &figures)?;
        terminal.note(&format!("{} figures written to {}, each as SVG and PDF", figures.len(), folder.display()));
    }
    let improvement_percent = versus.as_ref().map(|versus| improvements(&evaluation, versus));
    let calibration = args.calibrate.then(|| calibrate(truth, estimate, max_diff_ns)).transpose();
    let calibration = calibration.with_context(|| format!("cannot calibrate {}", args.estimate.display()))?;
    let comparison = Comparison { estimate: evaluation, versus, improvement_percent, calibration };
    if args.json {
        return print(&(serde_json::to_string_pretty(&comparison)? + "\n"));
    }
    let calibrated = comparison.calibration.as_ref().map_or_else(String::new, describe_calibration);
    print(&(text(args, &comparison) + &calibrated))
}

/// Notices a ground truth in the place of the estimate, by the names of the files.
fn swapped(truth: &Path, estimate: &Path) -> Option<String> {
    let is_truth = |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let words: Vec<&str> = name.split(|c: char| !c.is_ascii_alphanumeric()).collect();
        name.contains("groundtruth")
            || name.contains("ground_truth")
            || words.contains(&"gt")
            || words.contains(&"truth")
    };
    let is_result = |path: &Path| path.with_file_name("run.json").is_file();
    (is_truth(estimate) && !is_truth(truth) || is_result(truth) && !is_result(estimate)).then(|| {
        format!(
            "{} looks like the ground truth and {} like an estimate; the ground truth is the first argument",
            estimate.display(),
            truth.display()
        )
    })
}

/// Describes a calibration, apart from the errors of the trajectory.
fn describe_calibration(calibration: &Calibration) -> String {
    let Calibration { lever_arm_m: [x, y, z], lever_arm_sd_m, time_offset_s, scale, translation_m } = calibration;
    let [sd_x, sd_y, sd_z] = lever_arm_sd_m.map(|sd| format!("{:.1}", sd * 1e3));
    format!(
        "\nwith lever arm, time offset and scale fitted (not comparable with the errors above):\n\
         \x20 body of the ground truth in the camera frame: {:.1} {:.1} {:.1} mm (standard deviations {sd_x} {sd_y} {sd_z} mm)\n\
         \x20 time to add to the estimate: {:.1} ms; scale: {scale:.4}\n\
         \x20 remaining error (m): RMSE {:.4}, mean {:.4}, median {:.4}, n {}\n",
        x * 1e3,
        y * 1e3,
        z * 1e3,
        time_offset_s * 1e3,
        translation_m.rmse,
        translation_m.mean,
        translation_m.median,
        translation_m.count
    )
}

/// Returns which errors to compute.
fn options(args: &EvalArgs, max_diff_ns: u64) -> EvalOptions {
    let mut options = EvalOptions { max_diff_ns, alignment: args.evaluation.alignment(true), ..Default::default() };
    if !args.delta.is_empty() {
        options.rpe = args.delta.iter().map(|interval| interval.options()).collect();
    }
    for rpe in &mut options.rpe {
        rpe.all_pairs |= args.all_pairs;
    }
    options
}

/// Returns names and statistics of the errors, in the order of the table.
fn errors(evaluation: &Evaluation) -> Vec<(String, Statistics)> {
    let mut errors = vec![("ATE (m)".to_owned(), evaluation.ate.translation_m)];
    for rpe in &evaluation.rpe {
        errors.push((format!("RPE per {} (m)", rpe.options.delta), rpe.translation_m));
        errors.push((format!("RPE per {} (deg)", rpe.options.delta), rpe.rotation_deg));
    }
    errors
}

fn improvements(ours: &Evaluation, original: &Evaluation) -> Vec<Improvement> {
    let originals = errors(original);
    let improvement = |(error, ours): (String, Statistics)| {
        let (_, original) = originals.iter().find(|(name, _)| *name == error)?;
        Some(Improvement {
            rmse: improvement_percent(ours.rmse, original.rmse),
            mean: improvement_percent(ours.mean, original.mean),
            median: improvement_percent(ours.median, original.median),
            std: improvement_percent(ours.std, original.std),
            error,
        })
    };
    errors(ours).into_iter().filter_map(improvement).collect()
}

fn text(args: &EvalArgs, comparison: &Comparison) -> String {
    let (Some(other), Some(versus), Some(improvements)) =
        (&args.versus, &comparison.versus, &comparison.improvement_percent)
    else {
        return evaluation_table(&comparison.estimate, TableStyle::Plain);
    };
    let mut table = Table::new(["improvement (%)", "RMSE", "mean", "median", "S.D."]);
    for i in improvements {
        let figures = [i.rmse, i.mean, i.median, i.std].map(|v| v.map_or("-".to_owned(), |v| format!("{v:.2}")));
        table.push([i.error.clone()].into_iter().chain(figures));
    }
    format!(
        "{}\n{}\n{}\n{}\nimprovement of the first over the second, (1 - ours / other) · 100\n{}",
        args.estimate.display(),
        evaluation_table(&comparison.estimate, TableStyle::Plain),
        other.display(),
        evaluation_table(versus, TableStyle::Plain),
        table.render(TableStyle::Plain)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_read_with_their_unit_and_anything_else_is_refused() {
        assert_eq!("1f".parse::<Interval>().unwrap().0, Delta::Frames(1));
        assert_eq!("2.5s".parse::<Interval>().unwrap().0, Delta::Seconds(2.5));
        assert_eq!("0.5m".parse::<Interval>().unwrap().0, Delta::Metres(0.5));
        for text in ["", "f", "1", "0f", "1.5f", "-1s", "nanm", "infs", "1é", "1 s s"] {
            assert!(text.parse::<Interval>().unwrap_err().contains(text), "{text}");
        }
    }
}
