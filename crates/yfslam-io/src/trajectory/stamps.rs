//! Time stamps of a whole file, in seconds, milliseconds, microseconds or nanoseconds.
//!
//! The unit is that with which the usual step between two stamps is a plausible period; decimal seconds below 10¹¹ are always seconds.

use std::path::Path;

use crate::error::{Error, Result};
use crate::time::{StampError, parse_stamp_in};

/// A stamp of this size is no time in seconds: it would be in the year 5138.
const SECONDS_LIMIT: f64 = 1e11;

/// Longest plausible step between two poses, s.
const MAX_STEP_S: f64 = 10.0;

/// Units, as the power of ten of nanoseconds, with their names.
const UNITS: [(i64, &str); 4] = [(9, "seconds"), (6, "milliseconds"), (3, "microseconds"), (0, "nanoseconds")];

/// The stamps of a file.
#[derive(Debug)]
pub struct Stamps {
    pub stamps_ns: Vec<i64>,
    /// The unit, if it is not seconds.
    pub note: Option<String>,
}

/// Parses the stamps of a file, each with the number of its line.
///
/// # Errors
/// A stamp is not a number, or beyond 292 years in every unit.
pub fn parse_all<'a>(stamps: impl Iterator<Item = (usize, &'a str)>, path: &Path) -> Result<Stamps> {
    let stamps: Vec<(usize, &str)> = stamps.collect();
    let (power, name) = unit(&stamps);
    let parse = |&(line, text): &(usize, &str)| {
        parse_stamp_in(text, power).map_err(|error: StampError| {
            Error::line(path, line, format!("stamp '{text}' {error}"), "write it as decimal seconds")
        })
    };
    let stamps_ns = stamps.iter().map(parse).collect::<Result<_>>()?;
    Ok(Stamps { stamps_ns, note: (power != 9).then(|| format!("the time stamps are taken for {name}")) })
}

fn unit(stamps: &[(usize, &str)]) -> (i64, &'static str) {
    let values: Vec<f64> = stamps.iter().filter_map(|(_, text)| text.parse().ok()).collect();
    let is_whole = stamps.iter().all(|(_, text)| text.bytes().all(|c| c.is_ascii_digit() || c == b'-'));
    let is_large = values.iter().any(|value| value.abs() >= SECONDS_LIMIT);
    let [seconds, .., nanoseconds] = UNITS;
    if !is_whole && !is_large {
        return seconds;
    }
    let mut steps: Vec<f64> =
        values.windows(2).map(|pair| (pair.last().zip(pair.first())).map_or(0.0, |(b, a)| (b - a).abs())).collect();
    steps.retain(|step| *step > 0.0);
    steps.sort_unstable_by(f64::total_cmp);
    let Some(median) = steps.get(steps.len() / 2) else { return if is_large { nanoseconds } else { seconds } };
    // Nanoseconds since 1970 every 5 ms would be microseconds every 5 s by their step alone, but such times do not exist.
    let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let plausible = |(power, _): &(i64, &str)| {
        median * 10f64.powi(*power as i32 - 9) <= MAX_STEP_S && largest * 10f64.powi(*power as i32) < i64::MAX as f64
    };
    // Seconds are out of the question for large stamps, whatever their step.
    UNITS.into_iter().skip(usize::from(is_large)).find(plausible).unwrap_or(if is_large {
        nanoseconds
    } else {
        seconds
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamps(texts: &[&str]) -> (Vec<i64>, Option<String>) {
        let parsed = parse_all(texts.iter().enumerate().map(|(at, text)| (at + 1, *text)), Path::new("t.txt")).unwrap();
        (parsed.stamps_ns, parsed.note)
    }

    #[test]
    fn the_unit_is_that_of_a_plausible_period() {
        let second = 1_000_000_000i64;
        for (texts, first_ns, word) in [
            (["1305031102.175304", "1305031102.211214"], 1_305_031_102_175_304_000, None),
            (["1403636579763555584", "1403636579813555456"], 1_403_636_579_763_555_584, Some("nanoseconds")),
            (["1403636579763555584", "1403636579768555776"], 1_403_636_579_763_555_584, Some("nanoseconds")),
            (["1.403636579763555584e+18", "1.403636579813555456e+18"], 1_403_636_579_763_555_584, Some("nanoseconds")),
            (["1403636579763555", "1403636579813555"], 1_403_636_579_763_555_000, Some("microseconds")),
            (["1403636579763", "1403636579813"], 1_403_636_579_763_000_000, Some("milliseconds")),
            (["50000000", "100000000"], 50_000_000, Some("nanoseconds")),
            (["33", "66"], 33_000_000, Some("milliseconds")),
            (["0", "1"], 0, None),
            (["7", "8"], 7 * second, None),
            (["100000.5", "200000.5"], 100_000_500_000_000, None),
        ] {
            let (found, note) = stamps(&texts);
            assert_eq!(found[0], first_ns, "{texts:?}");
            assert_eq!(note.is_some(), word.is_some(), "{texts:?}: {note:?}");
            assert!(
                word.is_none_or(|word| note.as_deref().is_some_and(|note| note.contains(word))),
                "{texts:?}: {note:?}"
            );
        }
    }
}
