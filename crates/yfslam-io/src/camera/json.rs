//! JSON camera files as [`Settings`]: objects become keys with points, arrays of numbers become lists, row by row.

use std::path::Path;

use serde_json::Value as Json;

use super::settings::{Settings, Value};
use crate::error::{Error, Result};

/// Parses `text`; `path` names the file in messages.
///
/// # Errors
/// The text is not JSON, with the line.
pub fn parse(text: &str, path: &Path) -> Result<Settings> {
    let json: Json = serde_json::from_str(text).map_err(|error| {
        Error::line(path, error.line(), format!("is not JSON: {error}"), "repair the line, or export the file again")
    })?;
    let mut settings = Settings::new(path);
    // serde_json refuses more than 128 levels.
    add(&mut settings, "", &json);
    Ok(settings)
}

fn add(settings: &mut Settings, key: &str, json: &Json) {
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match json {
        Json::Object(pairs) => pairs.iter().for_each(|(name, value)| add(settings, &below(name), value)),
        Json::Array(items) if items.iter().any(Json::is_object) => {
            items.iter().enumerate().for_each(|(at, item)| add(settings, &below(&at.to_string()), item));
        }
        Json::Array(items) => {
            let mut words = Vec::new();
            items.iter().for_each(|item| collect(item, &mut words));
            settings.insert(key.to_owned(), Value::List(words), 0);
        }
        other => settings.insert(key.to_owned(), Value::Word(word(other)), 0),
    }
}

fn collect(item: &Json, words: &mut Vec<String>) {
    match item {
        Json::Array(items) => items.iter().for_each(|item| collect(item, words)),
        other => words.push(word(other)),
    }
}

fn word(json: &Json) -> String {
    json.as_str().map_or_else(|| json.to_string(), str::to_owned)
}
