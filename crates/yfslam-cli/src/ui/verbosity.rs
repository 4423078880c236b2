//! How much the program prints.

use clap::{ArgAction, Args};

/// How much the program prints.
#[derive(Args, Clone, Copy, Debug)]
pub struct Verbosity {
    /// Print only warnings and errors.
    #[arg(short, long, global = true, display_order = 900)]
    pub quiet: bool,
    /// Print more; give it twice for still more.
    #[arg(short, long, global = true, action = ArgAction::Count, conflicts_with = "quiet", display_order = 901)]
    pub verbose: u8,
}
