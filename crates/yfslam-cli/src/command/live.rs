//! `yfslam live`: tracks frames as they come.

use anyhow::Result;
use clap::Args;

use crate::command::run::{self, Pace, RunArgs};
use crate::ui::terminal::Terminal;

const HELP: &str = "\
Examples:
  yfslam live rgbd_bonn_crowd --camera bonn            plays a recording at real time, as a robot would see it
  yfslam live lab.mcap --rate 2 --save-map lab.map     twice as fast
  yfslam live lab.mcap --lockstep                      every frame, with the same results as `yfslam run lab.mcap`
  capture | yfslam live - --save-map lab.map           frames of another program

  Mapping runs on its own thread. A frame that comes while the one before is tracked waits; if a newer one comes, it is dropped and
  counted in run.json, so that the pose is never older than one frame. All other options and files are those of `yfslam run`.

Standard input (-):
  The sender names the camera in its first bytes, then sends frames, in the format that the chapter on robots of the manual describes.

Signals:
  After SIGINT (Ctrl-C) or SIGTERM, trajectory and map are saved, as after the last frame. A second signal ends the program at once.";

/// Highest rate: more would be a mistake.
const MAX_RATE: f64 = 1000.0;

/// Track frames as they come: a recording at real time, or the frames of another program.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct LiveArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Play a recording at this multiple of real time.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = parse_rate, help_heading = "Live")]
    rate: f64,
    /// Use every frame however long it takes, with the results of `yfslam run`.
    #[arg(long, conflicts_with = "rate", help_heading = "Live")]
    lockstep: bool,
}

pub fn run(args: &LiveArgs, terminal: Terminal) -> Result<()> {
    let pace = if args.lockstep { Pace::EveryFrame } else { Pace::Live { rate: args.rate } };
    run::run_at(&args.run, pace, terminal)
}

fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| *rate > 0.0 && *rate <= MAX_RATE);
    rate.ok_or_else(|| format!("give a number above 0 and up to {MAX_RATE}, such as 1"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_a_positive_number() {
        assert_eq!(parse_rate("0.5"), Ok(0.5));
        for text in ["0", "-1", "nan", "inf", "fast", "1e9"] {
            assert!(parse_rate(text).is_err(), "{text}");
        }
    }
}
