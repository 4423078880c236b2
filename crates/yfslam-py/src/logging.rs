//! Messages of the libraries in Python's `logging`, under the name `yfslam`.
//!
//! Messages arise on any thread, also while another one holds the interpreter's lock and waits. So they wait in a queue until the next call
//! from Python ends, which hands them over on its own thread.

use std::collections::VecDeque;
use std::fmt::{Debug, Write};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;

/// Messages that wait at most; later ones are dropped.
const CAPACITY: usize = 1000;

/// Levels of Python.
const DEBUG: u8 = 10;
const INFO: u8 = 20;
const WARNING: u8 = 30;
const ERROR: u8 = 40;

static WAITING: Mutex<VecDeque<(u8, String)>> = Mutex::new(VecDeque::new());
/// Level below which nothing is kept.
static LEVEL: AtomicU8 = AtomicU8::new(WARNING);

/// Begins to collect the messages of the libraries.
pub fn begin() {
    // Fails only if the process has a subscriber already.
    let _ = tracing::subscriber::set_global_default(Collector);
}

/// Keeps a warning until [`hand_over`].
pub fn warn(text: String) {
    push(WARNING, text);
}

/// Keeps an information until [`hand_over`].
pub fn info(text: String) {
    push(INFO, text);
}

fn push(level: u8, text: String) {
    if level < LEVEL.load(Ordering::Relaxed) {
        return;
    }
    let mut waiting = WAITING.lock().unwrap_or_else(PoisonError::into_inner);
    if waiting.len() < CAPACITY {
        waiting.push_back((level, text));
    }
}

/// Asks the logger which messages it wants.
pub fn follow_level(py: Python<'_>) -> PyResult<()> {
    let level: i64 = logger(py)?.call_method0("getEffectiveLevel")?.extract()?;
    LEVEL.store(u8::try_from(level.clamp(0, 255)).unwrap_or(u8::MAX), Ordering::Relaxed);
    Ok(())
}

/// Hands the messages that wait to the logger.
pub fn hand_over(py: Python<'_>) -> PyResult<()> {
    let waiting = std::mem::take(&mut *WAITING.lock().unwrap_or_else(PoisonError::into_inner));
    if waiting.is_empty() {
        return Ok(());
    }
    let logger = logger(py)?;
    for (level, text) in waiting {
        logger.call_method1("log", (level, "%s", text))?;
    }
    Ok(())
}

fn logger(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    py.import("logging")?.call_method1("getLogger", ("yfslam",))
}

/// Takes the events of the libraries.
struct Collector;

impl tracing::Subscriber for Collector {
    fn enabled(&self, metadata: &tracing::Metadata<'_>) -> bool {
        level_of(metadata) >= LEVEL.load(Ordering::Relaxed)
    }

    // The logger may change its level at any time.
    fn register_callsite(&self, _: &'static tracing::Metadata<'static>) -> tracing::subscriber::Interest {
        tracing::subscriber::Interest::sometimes()
    }

    fn new_span(&self, _: &tracing::span::Attributes<'_>) -> tracing::span::Id {
        tracing::span::Id::from_u64(1)
    }

    fn record(&self, _: &tracing::span::Id, _: &tracing::span::Record<'_>) {}

    fn record_follows_from(&self, _: &tracing::span::Id, _: &tracing::span::Id) {}

    fn event(&self, event: &tracing::Event<'_>) {
        let mut text = String::new();
        event.record(&mut Fields(&mut text));
        push(level_of(event.metadata()), text);
    }

    fn enter(&self, _: &tracing::span::Id) {}

    fn exit(&self, _: &tracing::span::Id) {}
}

fn level_of(metadata: &tracing::Metadata<'_>) -> u8 {
    match *metadata.level() {
        tracing::Level::ERROR => ERROR,
        tracing::Level::WARN => WARNING,
        tracing::Level::INFO => INFO,
        _ => DEBUG,
    }
}

/// Writes the message of an event, then its other fields.
struct Fields<'a>(&'a mut String);

impl tracing::field::Visit for Fields<'_> {
    fn record_debug(&mut self, field: &tracing::field::Field, value: &dyn Debug) {
        if field.name() == "message" {
            self.0.insert_str(0, &format!("{value:?}"));
        } else {
            // Writing to a string does not fail.
            let _ = write!(self.0, " {}={value:?}", field.name());
        }
    }
}
