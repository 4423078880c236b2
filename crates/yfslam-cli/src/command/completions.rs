//! `yfslam completions`: a completion script for a shell.

use anyhow::Result;
use clap::{Args, Command};
use clap_complete::Shell;

use crate::ui::terminal::print;

const HELP: &str = "\
Examples:
  yfslam completions bash > ~/.local/share/bash-completion/completions/yfslam
  yfslam completions zsh > ~/.zfunc/_yfslam
  yfslam completions fish > ~/.config/fish/completions/yfslam.fish";

/// Print a completion script for a shell.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: Shell,
}

pub fn run(args: &CompletionsArgs, mut command: Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "yfslam", &mut script);
    print(&String::from_utf8_lossy(&script))
}
