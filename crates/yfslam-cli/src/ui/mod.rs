//! What the user sees and does: the terminal, the progress of a run, failures that do not end it, and signals that do.

pub mod command_line;
pub mod failures;
pub mod interrupt;
pub mod messages;
pub mod program;
pub mod progress;
pub mod terminal;
pub mod verbosity;
