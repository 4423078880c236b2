//! Figures of a run: counts, durations, processor time.

pub mod cpu;
pub mod health;
pub mod process;
pub mod readout;
pub mod recognition;
pub mod skip;
pub mod stages;
pub mod tally;
mod threads;
