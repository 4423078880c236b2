//! Signals that ask the program to end: SIGINT, which Ctrl-C sends, and SIGTERM.
//!
//! A command that watches them ends in order after the first one and keeps what it has computed; the second one ends the program at once.
//! In commands that do not watch them, the first one does.

use std::fmt;
use std::io;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use anyhow::{Context, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// The exit code of a program that a signal has ended is this number plus that of the signal, by the convention of shells.
const EXIT_CODE_BASE: i32 = 128;

/// The signal that has asked the program to end, once there is one.
#[derive(Clone, Debug)]
pub struct Interrupt(Arc<AtomicUsize>);

/// A signal has asked the program to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interrupted {
    signal: i32,
}

impl Interrupt {
    /// Begins to watch the signals.
    ///
    /// # Errors
    /// The system refuses it.
    pub fn watch() -> Result<Self> {
        let (asked, number) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        let register = |signal: i32| -> io::Result<()> {
            // Actions run in this order: only the second signal finds the flag set.
            flag::register_conditional_shutdown(signal, EXIT_CODE_BASE + signal, asked.clone())?;
            flag::register(signal, asked.clone())?;
            flag::register_usize(signal, number.clone(), signal as usize)?;
            Ok(())
        };
        [SIGINT, SIGTERM].into_iter().try_for_each(register).context("cannot watch the signals SIGINT and SIGTERM")?;
        Ok(Self(number))
    }

    /// Returns the signal, if there was one.
    pub fn received(&self) -> Option<Interrupted> {
        let signal = i32::try_from(self.0.load(Ordering::SeqCst)).unwrap_or_default();
        (signal != 0).then_some(Interrupted { signal })
    }

    /// Does nothing until there was a signal.
    ///
    /// # Errors
    /// There was one.
    pub fn check(&self) -> Result<(), Interrupted> {
        self.received().map_or(Ok(()), Err)
    }
}

impl Interrupted {
    /// Returns the signal that ended a process with this exit code, if one did.
    pub fn of_exit_code(code: i32) -> Option<Self> {
        let signal = code - EXIT_CODE_BASE;
        [SIGINT, SIGTERM].contains(&signal).then_some(Self { signal })
    }

    /// Returns the exit code of this program.
    pub fn exit_code(self) -> ExitCode {
        u8::try_from(EXIT_CODE_BASE + self.signal).map_or(ExitCode::FAILURE, ExitCode::from)
    }
}

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "interrupted by {}", if self.signal == SIGTERM { "SIGTERM" } else { "SIGINT" })
    }
}

impl std::error::Error for Interrupted {}
