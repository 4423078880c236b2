//! The content of a camera file as keys and words, whatever its syntax.
//!
//! In: keys with points between the levels (`Camera.fx`, `cam0.intrinsics`), each with a word or a list of words. Out: numbers, with
//! errors that name the file, the line, the key and the value. Keys that were not asked for are reported as unused.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Words of a key: one, or those of a list or matrix, row by row.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Word(String),
    List(Vec<String>),
}

/// A key with its value.
#[derive(Clone, Debug)]
struct Entry {
    key: String,
    value: Value,
    /// Line, from 1; 0 if it is unknown.
    line: usize,
    used: bool,
    /// Line on which the key has another value.
    contradicted_on: Option<usize>,
}

/// All keys of a camera file.
#[derive(Clone, Debug)]
pub struct Settings {
    entries: Vec<Entry>,
    index: HashMap<String, usize>,
    pub path: PathBuf,
    /// What was borne and is worth knowing.
    pub notes: Vec<String>,
}

impl Settings {
    pub fn new(path: &Path) -> Self {
        Self { entries: Vec::new(), index: HashMap::new(), path: path.into(), notes: Vec::new() }
    }

    /// Adds a key. The same key with the same value is borne; with another value it is refused when it is asked for.
    pub fn insert(&mut self, key: String, value: Value, line: usize) {
        if let Some(entry) = self.index.get(&key).and_then(|&at| self.entries.get_mut(at)) {
            if same(&entry.value, &value) {
                self.notes.push(format!(
                    "the key {key} is given twice with the same value, on the lines {} and {line}",
                    entry.line
                ));
            } else {
                entry.contradicted_on = Some(line);
            }
            return;
        }
        self.index.insert(key.clone(), self.entries.len());
        self.entries.push(Entry { key, value, line, used: false, contradicted_on: None });
    }

    pub fn has(&self, key: &str) -> bool {
        self.index.contains_key(key)
    }

    /// Returns the first of `keys` that the file has.
    pub fn first<'k>(&self, keys: &[&'k str]) -> Option<&'k str> {
        keys.iter().copied().find(|key| self.has(key))
    }

    /// Returns whether a key begins with `prefix`.
    pub fn has_prefix(&self, prefix: &str) -> bool {
        self.first_with_prefix(prefix).is_some()
    }

    /// Returns the first key that begins with `prefix`.
    pub fn first_with_prefix(&self, prefix: &str) -> Option<&str> {
        self.entries.iter().map(|entry| entry.key.as_str()).find(|key| key.starts_with(prefix))
    }

    /// Returns the keys of the first level, in the order of the file.
    pub fn roots(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|entry| entry.key.split('.').next().unwrap_or_default())
    }

    /// Returns the keys that no reader asked for, sorted.
    pub fn unused(&self) -> Vec<String> {
        let mut keys: Vec<String> =
            self.entries.iter().filter(|entry| !entry.used).map(|entry| entry.key.clone()).collect();
        keys.sort_unstable();
        keys
    }

    /// Returns the value of `key` and its line.
    fn get(&mut self, key: &str) -> Result<Option<(Value, usize)>> {
        let Some(entry) = self.index.get(key).and_then(|&at| self.entries.get_mut(at)) else { return Ok(None) };
        entry.used = true;
        if let Some(line) = entry.contradicted_on {
            let problem = format!("the key '{key}' is given on line {} already, with another value", entry.line);
            return Err(Error::line(&self.path, line, problem, "remove one of the two lines"));
        }
        Ok(Some((entry.value.clone(), entry.line)))
    }

    /// Returns the text of the first of `keys` that is given.
    pub fn text(&mut self, keys: &[&str]) -> Result<Option<String>> {
        let Some(key) = self.first(keys) else { return Ok(None) };
        Ok(self.get(key)?.map(|(value, _)| match value {
            Value::Word(word) => word,
            Value::List(words) => words.join(" "),
        }))
    }

    /// Returns the first of `keys` that is given, as a finite number.
    pub fn number(&mut self, keys: &[&str]) -> Result<Option<f64>> {
        let Some(key) = self.first(keys) else { return Ok(None) };
        let Some((value, line)) = self.get(key)? else { return Ok(None) };
        match value {
            Value::Word(word) => number(&word).map(Some).ok_or_else(|| self.not_a_number(key, &word, line)),
            Value::List(words) => {
                let problem = format!("{key} is a list of {} values, not one number", words.len());
                Err(self.error_at(line, problem, "write one number"))
            }
        }
    }

    /// As [`Settings::number`], but the key must be there; the first name stands in the message.
    pub fn required(&mut self, keys: &[&str]) -> Result<f64> {
        let found = self.number(keys)?;
        found.ok_or_else(|| self.missing(keys.first().copied().unwrap_or_default()))
    }

    /// Returns the numbers of the first of `keys` that is given: a list, or the `data` of a matrix.
    pub fn numbers(&mut self, keys: &[&str]) -> Result<Option<Vec<f64>>> {
        let named: Vec<String> = keys.iter().flat_map(|key| [(*key).to_owned(), format!("{key}.data")]).collect();
        let Some(key) = named.iter().find(|key| self.has(key)) else { return Ok(None) };
        for part in ["rows", "cols", "dt", "type_id"] {
            let _ = self.get(&key.replace(".data", &format!(".{part}")))?;
        }
        let Some((value, line)) = self.get(key)? else { return Ok(None) };
        let words = match value {
            Value::List(words) => words,
            Value::Word(word) => {
                word.split([' ', ',', '\t']).filter(|word| !word.is_empty()).map(str::to_owned).collect()
            }
        };
        let numbers: Result<Vec<f64>> =
            words.iter().map(|word| number(word).ok_or_else(|| self.not_a_number(key, word, line))).collect();
        numbers.map(Some)
    }

    /// As [`Settings::numbers`], with exactly `N` numbers.
    pub fn exactly<const N: usize>(&mut self, keys: &[&str]) -> Result<Option<[f64; N]>> {
        let Some(numbers) = self.numbers(keys)? else { return Ok(None) };
        let key =
            keys.iter().find(|key| self.has(key) || self.has(&format!("{key}.data"))).copied().unwrap_or_default();
        let found = numbers.len();
        let exact = numbers.try_into().map_err(|_| {
            self.refuse(key, format!("{key} has {found} numbers, not {N}"), format!("write {N} numbers"))
        })?;
        Ok(Some(exact))
    }

    /// Returns the size of the image from two keys, px.
    pub fn size(&mut self, width: &[&str], height: &[&str]) -> Result<Option<[usize; 2]>> {
        let sides = [(width, self.number(width)?), (height, self.number(height)?)];
        if let [(_, None), (_, None)] = sides {
            return Ok(None);
        }
        let mut size = [0; 2];
        for (side, (keys, value)) in size.iter_mut().zip(sides) {
            let key = self.first(keys).or(keys.first().copied()).unwrap_or_default();
            *side = pixels(value.ok_or_else(|| self.missing(key))?).ok_or_else(|| {
                self.refuse(key, format!("{key} is {}", value.unwrap_or(0.0)), "give a whole number of pixels")
            })?;
        }
        Ok(Some(size))
    }

    /// Returns an error for a key that is missing.
    pub fn missing(&self, key: &str) -> Error {
        let cure = format!("add a line '{key}: …' from the calibration of the camera");
        Error::content(&self.path, format!("the key {key} is missing"), cure)
    }

    /// Returns an error at the line of `key`, or of the whole file.
    pub fn refuse(&self, key: &str, problem: impl Into<String>, cure: impl Into<String>) -> Error {
        let entry = self.index.get(key).or_else(|| self.index.get(&format!("{key}.data")));
        let line = entry.and_then(|&at| self.entries.get(at)).map_or(0, |entry| entry.line);
        self.error_at(line, problem, cure)
    }

    fn error_at(&self, line: usize, problem: impl Into<String>, cure: impl Into<String>) -> Error {
        if line == 0 { Error::content(&self.path, problem, cure) } else { Error::line(&self.path, line, problem, cure) }
    }

    fn not_a_number(&self, key: &str, word: &str, line: usize) -> Error {
        let key = key.trim_end_matches(".data");
        self.error_at(line, format!("{key} is '{word}', not a number"), "write it with a decimal point, such as 517.3")
    }
}

/// Returns a finite number.
fn number(word: &str) -> Option<f64> {
    word.parse::<f64>().ok().filter(|number| number.is_finite())
}

/// Returns a side of an image if it is a whole number.
pub fn pixels(side: f64) -> Option<usize> {
    (side.fract() == 0.0 && (0.0..=1e9).contains(&side)).then_some(side as usize)
}

/// Returns whether two values say the same: as words, or as numbers.
fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Word(a), Value::Word(b)) => a == b || number(a).zip(number(b)).is_some_and(|(a, b)| a == b),
        _ => a == b,
    }
}
