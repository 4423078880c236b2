//! Failures that do not end a command.

use anyhow::{Error, Result, ensure};

use super::terminal::Terminal;

/// Outputs that cannot be written: each is reported at once, everything else is written all the same, and the command fails at its end.
#[derive(Debug)]
pub struct Failures {
    terminal: Terminal,
    count: usize,
}

impl Failures {
    pub fn new(terminal: Terminal) -> Self {
        Self { terminal, count: 0 }
    }

    /// Returns the value, or reports the error.
    pub fn keep<T, E: Into<Error>>(&mut self, result: Result<T, E>) -> Option<T> {
        match result {
            Ok(value) => Some(value),
            Err(error) => {
                self.terminal.error(&error.into());
                self.count += 1;
                None
            }
        }
    }

    /// Counts those of another part of the work, too.
    pub fn add(&mut self, other: &Self) {
        self.count += other.count;
    }

    /// Does nothing if everything was written.
    ///
    /// # Errors
    /// Something was not.
    pub fn check(&self) -> Result<()> {
        let outputs = if self.count == 1 { "1 output" } else { &format!("{} outputs", self.count) };
        ensure!(self.count == 0, "{outputs} could not be written, as reported above; everything else was written");
        Ok(())
    }
}
