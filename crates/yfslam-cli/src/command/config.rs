//! `yfslam config`: the configuration with the meaning of each key.

use anyhow::Result;
use clap::Args;

use crate::input::settings::{MethodArg, SettingsArgs};
use crate::ui::terminal::print;

const HELP: &str = "\
Examples:
  yfslam config > yfslam.toml    prints all settings; change some, and delete the rest
  yfslam run DIR -c yfslam.toml
  yfslam config -c yfslam.toml   prints all settings as the file changes them";

/// Print the configuration, each key with its meaning, unit and source.
///
/// Without options, these are the defaults.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct ConfigArgs {
    /// Method for dynamic scenes [default: full].
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
