//! The records of measurements: what was run, on which state of the project, and the figures.
//!
//! A topic has one file, `docs/results/data/TOPIC.json`: a list with one record a line, so that a change of one record is a change of
//! one line.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::row::Row;

/// The state of the project and the machine on which a record was measured.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct State {
    /// Commit of the program: the last one that changed what is built.
    pub commit: String,
    /// The network: `embedded NNNNNNNNNNNN` or `official COCO weights NNNNNNNNNNNN`, with the first digits of its SHA-256.
    pub network: String,
    /// The machine.
    pub machine: Machine,
}

/// A machine.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Machine {
    /// Model of the processor.
    pub cpu: String,
    /// Number of cores that this process may use.
    pub cores: usize,
    /// The widest vector instructions.
    pub simd: String,
}

impl std::fmt::Display for State {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Machine { cpu, cores, simd } = &self.machine;
        write!(f, "commit `{}`, network {}, {cpu} ({cores} cores, {simd})", self.commit, self.network)
    }
}

/// One measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The state of the project and the machine.
    #[serde(flatten)]
    pub state: State,
    /// Day of the measurement, UTC.
    pub date: String,
    /// The part of the topic that gave this record, and all others of that name, at once.
    pub job: String,
    /// The command that gives the figures; `DATA` and `OUT` stand for folders.
    pub command: String,
    /// A trial with tiny settings: its figures are no results.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub quick: bool,
    /// What was measured: sequence, method, seed and the like.
    pub case: BTreeMap<String, String>,
    /// The figures by name; names end with the unit.
    pub figures: BTreeMap<String, Value>,
}

impl Record {
    /// A record of a row of figures.
    pub fn new(state: State, job: &str, quick: bool, command: String, row: Row) -> Self {
        let case = row.case.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        let figures = row.figures.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        Self { state, date: today(), job: job.to_owned(), command, quick, case, figures }
    }

    /// A part of the case; empty if the record does not have it.
    pub fn case(&self, key: &str) -> &str {
        self.case.get(key).map_or("", String::as_str)
    }

    /// A figure, if it was measured.
    pub fn figure(&self, key: &str) -> Option<f64> {
        self.figures.get(key)?.as_f64()
    }

    /// A figure that is a text, such as the reason of a failure.
    pub fn text(&self, key: &str) -> Option<&str> {
        self.figures.get(key)?.as_str()
    }
}

/// Reads the records of a topic; none if there is no file.
///
/// # Errors
/// The file cannot be read or is not a list of records.
pub fn read(path: &Path) -> Result<Vec<Record>> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is not a list of records", path.display()))
}

/// Writes the records of a topic, whole or not at all.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, records: &[Record]) -> Result<()> {
    let lines = records.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>()?;
    let text = format!("[\n{}\n]\n", lines.join(",\n"));
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let part = path.with_extension("json.part");
    std::fs::write(&part, text).with_context(|| format!("cannot write {}", part.display()))?;
    std::fs::rename(&part, path).with_context(|| format!("cannot write {}", path.display()))
}

/// Today, UTC, as year-month-day.
fn today() -> String {
    let seconds = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |time| time.as_secs());
    date_of_day(seconds / 86_400)
}

/// The date of a day counted from 1970-01-01, by the Gregorian calendar.
fn date_of_day(day: u64) -> String {
    let leap = |year: u64| year.is_multiple_of(4) && !year.is_multiple_of(100) || year.is_multiple_of(400);
    let (mut year, mut rest) = (1970, day);
    while rest >= 365 + u64::from(leap(year)) {
        rest -= 365 + u64::from(leap(year));
        year += 1;
    }
    let days = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while rest >= days[month] {
        rest -= days[month];
        month += 1;
    }
    format!("{year}-{:02}-{:02}", month + 1, rest + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_follow_the_calendar() {
        assert_eq!(date_of_day(0), "1970-01-01");
        assert_eq!(date_of_day(11_016), "2000-02-29");
        assert_eq!(date_of_day(20_787), "2026-11-30");
    }

    #[test]
    fn records_are_read_as_they_were_written() {
        let machine = Machine { cpu: "CPU".into(), cores: 2, simd: "AVX2".into() };
        let state = State { commit: "c".into(), network: "n".into(), machine };
        let row = Row::new().case("method", "full").figure("ate_m", 0.0105).figure("missing", None::<f64>);
        let record = Record::new(state, "job", true, "yfslam run".into(), row);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("data/topic.json");
        assert!(read(&path).unwrap().is_empty());
        write(&path, &[record.clone(), record.clone()]).unwrap();
        assert_eq!(read(&path).unwrap(), [record.clone(), record]);
    }
}
