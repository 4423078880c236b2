//! Messages: results on standard output, everything else on standard error.

use std::io::{self, IsTerminal, Write};

use anyhow::Result;

use super::messages::{self, MessageWriter};
use super::verbosity::Verbosity;

/// Prints results, notes and warnings, depending on the verbosity.
#[derive(Clone, Copy, Debug)]
pub struct Terminal {
    verbosity: Verbosity,
}

impl Terminal {
    /// Sets up messages and logging.
    pub fn new(verbosity: Verbosity) -> Self {
        let level = match verbosity.verbose {
            0 => tracing::Level::WARN,
            1 => tracing::Level::INFO,
            2 => tracing::Level::DEBUG,
            _ => tracing::Level::TRACE,
        };
        // A line that could not be written would be reported on standard error, too, with a panic where that fails.
        let log = tracing_subscriber::fmt().with_max_level(level).without_time().log_internal_errors(false);
        // Fails only if logging is set up already.
        let _ = log.with_writer(|| MessageWriter).try_init();
        Self { verbosity }
    }

    /// Prints only warnings and errors; logging stays as the process has set it up.
    pub fn quiet() -> Self {
        Self { verbosity: Verbosity { quiet: true, verbose: 0 } }
    }

    /// Returns whether progress and notes are suppressed.
    pub fn is_quiet(self) -> bool {
        self.verbosity.quiet
    }

    /// Returns whether progress is drawn in place, which log lines would disturb.
    pub fn draws(self) -> bool {
        !self.is_quiet() && self.verbosity.verbose == 0 && io::stderr().is_terminal()
    }

    /// Prints a result, unless the user chose `--quiet`.
    ///
    /// # Errors
    /// Standard output cannot be written. Commands write their files before they print.
    pub fn result(self, text: &str) -> Result<()> {
        if self.is_quiet() { Ok(()) } else { print(text) }
    }

    /// Prints a note.
    pub fn note(self, text: &str) {
        if !self.is_quiet() {
            print_message("note", text);
        }
    }

    /// Prints a warning.
    pub fn warn(self, text: &str) {
        print_message("warning", text);
    }

    /// Prints an error that does not end the program.
    pub fn error(self, error: &anyhow::Error) {
        print_error(error);
    }
}

/// Prints to standard output.
pub fn print(text: &str) -> Result<()> {
    // On a terminal, messages come before the results that follow them.
    messages::flush();
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// Prints an error.
pub fn print_error(error: &anyhow::Error) {
    print_message("error", &explain(error));
}

/// Returns the error with its causes; a cause that is part of the message before it is left out.
pub fn explain(error: &anyhow::Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |text, cause| match text {
        text if text.is_empty() => cause,
        text if text.contains(&cause) => text,
        text => format!("{text}: {cause}"),
    })
}

/// Returns whether the reader of the output has ended, such as `head`, which is not an error.
pub fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

fn print_message(kind: &str, text: &str) {
    messages::write(format!("{kind}: {text}\n").into_bytes());
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    use super::*;

    #[test]
    fn a_cause_is_printed_once() {
        let error = anyhow!("no such file").context("cannot read x: no such file; check the path").context("no run");
        assert_eq!(explain(&error), "no run: cannot read x: no such file; check the path");
    }
}
