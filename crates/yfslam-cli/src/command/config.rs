//! `yfslam config`: every constant of the system with its meaning.

use anyhow::Result;
use clap::Args;

use crate::input::settings::{MethodArg, SettingsArgs};
use crate::ui::terminal::print;

const EXAMPLES: &str = "\
Examples:
  yfslam config > yfslam.toml         change what you like, delete the rest
  yfslam run DIR --config yfslam.toml
  yfslam config --config yfslam.toml  see what a file amounts to";

/// Print the configuration, each key with its meaning, unit and source.
///
/// Without options these are the defaults; with options, what they amount to.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct ConfigArgs {
    /// How moving things are kept out [default: full].
    #[arg(long, value_enum, value_name = "METHOD", help_heading = "System")]
    method: Option<MethodArg>,
    #[command(flatten)]
    settings: SettingsArgs,
}

pub fn run(args: &ConfigArgs) -> Result<()> {
    let mut config = args.settings.resolve()?;
    config.dynamic.method = args.method.map_or(config.dynamic.method, MethodArg::method);
    print(&config.to_commented_toml()?)
}
