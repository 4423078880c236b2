//! What the program says: results on standard output, everything else on standard error.

use std::io::{self, IsTerminal, Write};

use anyhow::Result;

use crate::ui::verbosity::Verbosity;

/// Says things as loudly as the user wants.
#[derive(Clone, Copy, Debug)]
pub struct Terminal {
    verbosity: Verbosity,
}

impl Terminal {
    /// Starts logging too, at the level that `verbosity` asks for.
    pub fn new(verbosity: Verbosity) -> Self {
        let level = match verbosity.verbose {
            0 => tracing::Level::WARN,
            1 => tracing::Level::INFO,
            2 => tracing::Level::DEBUG,
            _ => tracing::Level::TRACE,
        };
        // Fails only if logging was started before, and then it runs.
        let _ = tracing_subscriber::fmt().with_max_level(level).with_writer(io::stderr).without_time().try_init();
        Self { verbosity }
    }

    /// Whether progress and notes are unwanted.
    pub fn is_quiet(self) -> bool {
        self.verbosity.quiet
    }

    /// Whether progress can be drawn in place: log lines would tear it.
    pub fn draws(self) -> bool {
        !self.is_quiet() && self.verbosity.verbose == 0 && io::stderr().is_terminal()
    }

    /// A result that is not printed if the user wants silence.
    pub fn result(self, text: &str) -> Result<()> {
        if self.is_quiet() { Ok(()) } else { print(text) }
    }

    /// Something worth knowing.
    pub fn note(self, text: &str) {
        if !self.is_quiet() {
            say("note", text);
        }
    }

    /// Something that may be wrong.
    pub fn warn(self, text: &str) {
        say("warning", text);
    }
}

/// Prints what the user asked for.
pub fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// Why the program ends without success.
pub fn error(error: &anyhow::Error) {
    say("error", &explain(error));
}

/// The error and its causes, without those that the error before has told already.
pub fn explain(error: &anyhow::Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |told, cause| match told {
        told if told.is_empty() => cause,
        told if told.contains(&cause) => told,
        told => format!("{told}: {cause}"),
    })
}

/// Whether the reader of our output has gone, as `head` does: no failure of ours.
pub fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

fn say(kind: &str, text: &str) {
    // Nobody is left to tell if standard error is closed.
    let _ = writeln!(io::stderr().lock(), "{kind}: {text}");
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    use super::*;

    #[test]
    fn a_cause_is_told_once() {
        let error = anyhow!("no such file").context("cannot read x: no such file; check the path").context("no run");
        assert_eq!(explain(&error), "no run: cannot read x: no such file; check the path");
    }
}
