//! What the user sees: the terminal and the progress of a run.

pub mod progress;
pub mod terminal;
pub mod verbosity;
