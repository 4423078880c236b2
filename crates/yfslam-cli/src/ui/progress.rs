//! Progress on standard error: a bar on a terminal, else a line every few seconds; nothing with `--quiet`.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use yfslam::TrackingState;

use super::messages;
use super::terminal::Terminal;
use crate::stats::tally::FrameTally;

/// Time between two lines without a bar.
const LINE_EVERY: Duration = Duration::from_secs(5);
/// Time over which the frame rate is measured.
const RATE_OVER: Duration = Duration::from_millis(500);

/// Progress of a run.
pub struct Progress {
    label: String,
    total: usize,
    bar: Option<ProgressBar>,
    lines: bool,
    last_line: Instant,
    rate_since: (Instant, usize),
    /// Unknown at first.
    fps: Option<f64>,
}

impl Progress {
    /// Starts the progress of `total` items.
    pub fn new(terminal: Terminal, label: &str, total: usize) -> Self {
        let style = ProgressStyle::with_template("{prefix} [{bar:32}] {pos}/{len}  {msg}  {eta} left");
        let bar = terminal.draws().then(|| {
            let bar = ProgressBar::new(total as u64).with_prefix(label.to_owned());
            // The template is constant; if it could not be parsed, the default style would be used.
            if let Ok(style) = style { bar.with_style(style.progress_chars("=> ")) } else { bar }
        });
        let now = Instant::now();
        Self {
            label: label.to_owned(),
            total,
            lines: bar.is_none() && !terminal.is_quiet(),
            bar,
            last_line: now,
            rate_since: (now, 0),
            fps: None,
        }
    }

    /// Reports one more frame.
    pub fn frame(&mut self, frames: &FrameTally, state: TrackingState) {
        let state = match state {
            TrackingState::NotInitialized => "initialising",
            TrackingState::Tracking => "tracking",
            TrackingState::Lost => "lost",
        };
        self.frames(frames.total(), || format!("  {state}  {:5.1} % tracked", frames.tracked_percent()));
    }

    /// Reports that `now` frames are done, with the frame rate and a text.
    pub fn frames(&mut self, now: usize, text: impl Fn() -> String) {
        let (since, done) = self.rate_since;
        if since.elapsed() >= RATE_OVER {
            self.fps = Some((now - done) as f64 / since.elapsed().as_secs_f64());
            self.rate_since = (Instant::now(), now);
        }
        let fps = self.fps.map_or("    -".to_owned(), |fps| format!("{fps:5.1}"));
        self.at(now, "frames", || format!("{fps} fps{}", text()));
    }

    /// Reports that `now` items are done, with a text.
    pub fn at(&mut self, now: usize, items: &str, message: impl Fn() -> String) {
        if let Some(bar) = &self.bar {
            bar.set_position(now as u64);
            bar.set_message(message());
        } else if self.lines && self.last_line.elapsed() >= LINE_EVERY {
            let line = format!("{}: {now}/{} {items}  {}\n", self.label, self.total, message());
            self.last_line = Instant::now();
            messages::write(line.into_bytes());
        }
    }

    /// Removes the bar.
    pub fn finish(self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
