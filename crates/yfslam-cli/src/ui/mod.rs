//! What the user sees: the terminal and the progress of a run.

pub mod command_line;
pub mod progress;
pub mod terminal;
pub mod verbosity;
