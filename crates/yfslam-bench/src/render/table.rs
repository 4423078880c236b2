//! Markdown tables, and the rule that one table holds one state of the project.

use anyhow::{Result, ensure};

use crate::record::{Record, State};

/// A Markdown table.
#[derive(Clone, Debug, Default)]
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with the given headers.
    pub fn new<S: ToString>(headers: impl IntoIterator<Item = S>) -> Self {
        Self { rows: vec![headers.into_iter().map(|text| text.to_string()).collect()] }
    }

    /// Adds a row.
    pub fn row<S: ToString>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(|text| text.to_string()).collect());
    }

    /// Whether the table has headers only.
    pub fn is_empty(&self) -> bool {
        self.rows.len() < 2
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, row) in self.rows.iter().enumerate() {
            let cells: Vec<_> = row.iter().map(|text| text.replace('|', "\\|")).collect();
            writeln!(f, "| {} |", cells.join(" | "))?;
            if index == 0 {
                writeln!(f, "|{}", "---|".repeat(row.len()))?;
            }
        }
        Ok(())
    }
}

/// The one state that all records were measured on; `None` if there are no records.
///
/// # Errors
/// The records are of different states, which one table must not mix; the error names them.
pub fn one_state<'a>(records: impl IntoIterator<Item = &'a Record>) -> Result<Option<&'a State>> {
    let mut states: Vec<&State> = records.into_iter().map(|record| &record.state).collect();
    states.sort_unstable();
    states.dedup();
    let named: Vec<String> = states.iter().map(ToString::to_string).collect();
    ensure!(
        states.len() < 2,
        "one table would mix records of different states: {}. Measure the topic again on one state",
        named.join("; ")
    );
    Ok(states.first().copied())
}

/// The median, the least and the greatest of some values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The least value.
    pub min: f64,
    /// The greatest value.
    pub max: f64,
}

impl Spread {
    /// The spread of the values that are there; `None` of none.
    pub fn of(values: impl IntoIterator<Item = Option<f64>>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().flatten().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let (min, max) = (*values.first()?, *values.last()?);
        let upper = values.len() / 2;
        let median =
            if values.len().is_multiple_of(2) { (values[upper - 1] + values[upper]) / 2.0 } else { values[upper] };
        Some(Self { median, min, max })
    }

    /// `median (min–max)` with the given number of decimals; the median alone where all values are the same.
    pub fn text(spread: Option<Self>, decimals: usize) -> String {
        let Some(Self { median, min, max }) = spread else { return "–".into() };
        if min.to_bits() == max.to_bits() {
            return format!("{median:.decimals$}");
        }
        format!("{median:.decimals$} ({min:.decimals$}–{max:.decimals$})")
    }

    /// The median alone.
    pub fn middle(spread: Option<Self>, decimals: usize) -> String {
        spread.map_or("–".into(), |spread| format!("{:.decimals$}", spread.median))
    }
}

/// A number with the given decimals; a dash if there is none.
pub fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".into(), |value| format!("{value:.decimals$}"))
}

/// A share as a percentage.
pub fn percent(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".into(), |value| format!("{:.decimals$} %", 100.0 * value))
}

/// The different values of a part of the case, in the order of their first appearance.
pub fn values<'a>(records: &[&'a Record], key: &str) -> Vec<&'a str> {
    let mut values = Vec::new();
    for record in records {
        let value = record.case(key);
        if !values.contains(&value) {
            values.push(value);
        }
    }
    values
}

/// The methods of the records, in the order of the tables: from no filter to the default.
pub fn methods<'a>(records: &[&'a Record]) -> Vec<&'a str> {
    let order =
        |method: &&str| ["none", "boxes", "yf", "ds", "dyna", "dms", "full"].iter().position(|name| name == method);
    let mut methods = values(records, "method");
    methods.sort_by_key(order);
    methods
}

/// The records whose case has these values.
pub fn select<'a>(records: &[&'a Record], case: &[(&str, &str)]) -> Vec<&'a Record> {
    records.iter().filter(|record| case.iter().all(|(key, value)| record.case(key) == *value)).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Machine;
    use crate::row::Row;

    fn record(commit: &str, network: &str) -> Record {
        let machine = Machine { cpu: "CPU".into(), cores: 2, simd: "AVX2".into() };
        let state = State { commit: commit.into(), network: network.into(), machine };
        Record::new(state, "job", false, String::new(), Row::new())
    }

    #[test]
    fn a_table_of_two_commits_or_two_networks_is_refused_and_both_are_named() {
        let [a, b, c] = [record("aaa", "n1"), record("bbb", "n1"), record("aaa", "n2")];
        assert_eq!(one_state([&a, &a]).unwrap(), Some(&a.state));
        assert!(one_state([]).unwrap().is_none());
        let error = one_state([&a, &b]).unwrap_err().to_string();
        assert!(error.contains("aaa") && error.contains("bbb"), "{error}");
        let error = one_state([&a, &c]).unwrap_err().to_string();
        assert!(error.contains("n1") && error.contains("n2"), "{error}");
    }

    #[test]
    fn the_median_of_an_even_number_lies_between_the_middle_two() {
        let spread = Spread::of([Some(4.0), None, Some(1.0), Some(2.0), Some(3.0)]).unwrap();
        assert_eq!(spread, Spread { median: 2.5, min: 1.0, max: 4.0 });
        assert_eq!(Spread::text(Some(spread), 1), "2.5 (1.0–4.0)");
        assert_eq!(Spread::text(Spread::of([None]), 1), "–");
    }
}
