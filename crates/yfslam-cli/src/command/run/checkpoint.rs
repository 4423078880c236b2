//! `--checkpoint`: the results so far are saved at intervals, so that a killed run loses no more than one interval, and `--resume`
//! goes on from them.

use std::time::{Duration, Instant};

/// Longest interval, s: about a month. A longer one would be a mistake.
const MAX_S: f64 = 3e6;

/// The times of the checkpoints.
pub struct Checkpoints {
    /// `None` without checkpoints.
    every: Option<Duration>,
    last: Instant,
}

impl Checkpoints {
    pub fn new(every: Option<Duration>) -> Self {
        Self { every, last: Instant::now() }
    }

    /// Makes a checkpoint with `save`, if there are to be checkpoints.
    pub fn save(&self, save: impl FnOnce()) {
        if self.every.is_some() {
            save();
        }
    }

    /// Makes a checkpoint with `save`, if one is due. The next interval begins after it, so that saving never takes all of the time.
    pub fn save_if_due(&mut self, save: impl FnOnce()) {
        if self.every.is_some_and(|every| self.last.elapsed() >= every) {
            save();
            self.last = Instant::now();
        }
    }
}

/// Parses an interval in seconds.
///
/// # Errors
/// It is not a positive number.
pub fn parse_interval(text: &str) -> Result<Duration, String> {
    let seconds: Option<f64> = text.parse().ok().filter(|seconds| *seconds > 0.0 && *seconds <= MAX_S);
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "give a positive number of seconds, such as 30".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_is_a_positive_number_of_seconds() {
        assert_eq!(parse_interval("0.5"), Ok(Duration::from_millis(500)));
        for text in ["0", "-1", "nan", "inf", "1e9", "soon", ""] {
            assert!(parse_interval(text).is_err(), "{text}");
        }
    }

    #[test]
    fn without_an_interval_nothing_is_saved() {
        Checkpoints::new(None).save_if_due(|| panic!("not asked for"));
        let mut saved = 0;
        Checkpoints::new(Some(Duration::ZERO)).save_if_due(|| saved += 1);
        assert_eq!(saved, 1);
    }
}
