//! A row of figures: what was measured, and what came of it.

use serde_json::Value;

use crate::render::Table;

/// What was measured and its figures, in the order in which they are printed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// What was measured.
    pub case: Vec<(&'static str, String)>,
    /// The figures by name; names end with the unit.
    pub figures: Vec<(&'static str, Value)>,
}

impl Row {
    /// An empty row.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a part of the case.
    #[must_use]
    pub fn case(mut self, key: &'static str, value: impl ToString) -> Self {
        self.case.push((key, value.to_string()));
        self
    }

    /// Adds a figure. Numbers that are not finite count as missing.
    #[must_use]
    pub fn figure(mut self, key: &'static str, value: impl Into<Value>) -> Self {
        self.figures.push((key, value.into()));
        self
    }
}

/// Rows of the same keys as a table for a terminal.
pub fn table(rows: &[Row]) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let keys = first.case.iter().map(|(key, _)| *key).chain(first.figures.iter().map(|(key, _)| *key));
    let mut table = Table::new(keys);
    for row in rows {
        let figures = row.figures.iter().map(|(_, value)| cell(value));
        table.row(row.case.iter().map(|(_, value)| value.clone()).chain(figures));
    }
    table.to_string()
}

fn cell(value: &Value) -> String {
    match value {
        Value::Null => "–".into(),
        Value::Number(number) => match number.as_f64() {
            Some(value) if number.is_f64() => format!("{value:.4}"),
            _ => number.to_string(),
        },
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
