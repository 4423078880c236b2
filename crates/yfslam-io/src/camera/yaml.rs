//! A reader for the YAML of camera files, which is rarely YAML 1.2: `%YAML:1.0` of OpenCV, `!!opencv-matrix`, `Viewer.PointSize:2`,
//! repeated keys, indentation below a key that has a value.
//!
//! In: text. Out: [`Settings`]. Mappings, block lists and flow lists are read; tags and anchors are passed over; a list of mappings gets
//! the numbers of its items as keys (`cameras.0.fx`).

use std::path::Path;

use super::settings::{Settings, Value};
use crate::error::{Error, Result};

/// Deepest nesting of mappings and lists.
const MAX_DEPTH: usize = 32;

/// A line without its comment.
struct Line<'a> {
    number: usize,
    indent: usize,
    text: &'a str,
}

/// Parses `text`; `path` names the file in messages.
///
/// # Errors
/// A line is neither `key: value` nor an item of a list, a bracket is not closed, or the nesting is too deep.
pub fn parse(text: &str, path: &Path) -> Result<Settings> {
    let mut lines = Vec::new();
    for (number, raw) in text.lines().enumerate().map(|(index, line)| (index + 1, line)) {
        let content = without_comment(raw).trim_end();
        let text = content.trim_start();
        if text.is_empty() || text.starts_with('%') || ["---", "..."].contains(&text) {
            continue;
        }
        lines.push(Line { number, indent: content.len() - text.len(), text });
    }
    let mut parser = Parser { lines, next: 0, settings: Settings::new(path) };
    while parser.next < parser.lines.len() {
        parser.block("", 0, 0)?;
    }
    Ok(parser.settings)
}

struct Parser<'a> {
    lines: Vec<Line<'a>>,
    next: usize,
    settings: Settings,
}

impl<'a> Parser<'a> {
    /// Reads the mapping or list whose lines are indented by at least `indent`, below the key `parent`.
    fn block(&mut self, parent: &str, indent: usize, depth: usize) -> Result<()> {
        let mut items = Items::default();
        while let Some(&Line { number, indent: at, text }) =
            self.lines.get(self.next).filter(|line| line.indent >= indent)
        {
            if depth > MAX_DEPTH {
                return Err(self.error(number, "the nesting is deeper than 32 levels", "write a simpler file"));
            }
            self.next += 1;
            match item(text).filter(|_| !parent.is_empty()) {
                Some(rest) => self.item(parent, rest, at, number, &mut items, depth)?,
                None => self.entry(parent, text, at, number, depth)?,
            }
        }
        if !items.words.is_empty() {
            self.settings.insert(parent.to_owned(), Value::List(items.words), items.line);
        }
        Ok(())
    }

    /// Reads `key: value`, whose value may stand on the lines below.
    fn entry(&mut self, parent: &str, text: &str, indent: usize, number: usize, depth: usize) -> Result<()> {
        let Some((key, value)) = text.split_once(':') else {
            let problem = format!("'{text}' is not 'key: value'");
            return Err(self.error(number, problem, "write 'Camera.fx: 517.3' or remove the line"));
        };
        let (key, value) = (unquote(key), without_tag(value));
        let key = if parent.is_empty() { key.to_owned() } else { format!("{parent}.{key}") };
        if !value.is_empty() {
            return self.value(&key, value, indent, number);
        }
        let below = self.lines.get(self.next).map(|line| (line.indent, line.text));
        match below {
            // A list in brackets that begins on the next line.
            Some((at, text)) if at > indent && text.starts_with(['[', '{']) => {
                let line = self.lines.get(self.next).map_or(number, |line| line.number);
                self.next += 1;
                self.value(&key, text, indent, line)
            }
            // Items of a list may stand below the first letter of their key.
            Some((at, text)) if at > indent || (at == indent && item(text).is_some()) => {
                if at > indent {
                    self.block(&key, indent + 1, depth + 1)
                } else {
                    self.items_at(&key, indent, depth + 1)
                }
            }
            _ => Ok(()),
        }
    }

    /// Reads the items of a list that are not indented more than their key.
    fn items_at(&mut self, parent: &str, indent: usize, depth: usize) -> Result<()> {
        let mut items = Items::default();
        while let Some((number, rest)) = self
            .lines
            .get(self.next)
            .filter(|line| line.indent == indent)
            .and_then(|line| Some((line.number, item(line.text)?)))
        {
            self.next += 1;
            self.item(parent, rest, indent, number, &mut items, depth)?;
        }
        if !items.words.is_empty() {
            self.settings.insert(parent.to_owned(), Value::List(items.words), items.line);
        }
        Ok(())
    }

    /// Reads the item of a list: words, a list, or a mapping.
    fn item(
        &mut self,
        parent: &str,
        rest: &'a str,
        indent: usize,
        number: usize,
        items: &mut Items,
        depth: usize,
    ) -> Result<()> {
        if depth > MAX_DEPTH {
            return Err(self.error(number, "the nesting is deeper than 32 levels", "write a simpler file"));
        }
        items.line = if items.words.is_empty() { number } else { items.line };
        let rest = without_tag(rest);
        if rest.starts_with('[') {
            let flow = self.flow(rest, number)?;
            items.words.extend(words(&flow));
        } else if let Some(inner) = item(rest) {
            // An item that is itself a list: `- - 1.0`.
            self.item(parent, inner, indent + 2, number, items, depth + 1)?;
            while let Some((number, inner)) = self
                .lines
                .get(self.next)
                .filter(|line| line.indent > indent)
                .and_then(|line| Some((line.number, item(line.text)?)))
            {
                self.next += 1;
                self.item(parent, inner, indent + 2, number, items, depth + 1)?;
            }
        } else if rest.contains(": ") || rest.ends_with(':') {
            let key = format!("{parent}.{}", items.mappings);
            items.mappings += 1;
            self.entry(&key, rest, indent + 1, number, depth + 1)?;
            self.block(&key, indent + 1, depth + 1)?;
        } else if !rest.is_empty() {
            items.words.push(unquote(rest).to_owned());
        }
        Ok(())
    }

    /// Stores a value that begins on the line of its key.
    fn value(&mut self, key: &str, value: &str, indent: usize, number: usize) -> Result<()> {
        if ["|", ">", "|-", ">-"].contains(&value) {
            // A text of several lines: nothing about the camera.
            while self.lines.get(self.next).is_some_and(|line| line.indent > indent) {
                self.next += 1;
            }
            return Ok(());
        }
        if value.starts_with('[') {
            let flow = self.flow(value, number)?;
            self.settings.insert(key.to_owned(), Value::List(words(&flow).collect()), number);
        } else if value.starts_with('{') {
            let flow = self.flow(value, number)?;
            self.flow_mapping(key, &flow, number);
        } else {
            self.settings.insert(key.to_owned(), Value::Word(unquote(value).to_owned()), number);
        }
        Ok(())
    }

    /// Joins the lines of a list or mapping in brackets.
    fn flow(&mut self, first: &str, number: usize) -> Result<String> {
        let mut open = brackets(first);
        let mut joined = first.to_owned();
        while open > 0 {
            let Some(line) = self.lines.get(self.next) else {
                return Err(self.error(number, "a bracket is not closed", "add the closing bracket"));
            };
            self.next += 1;
            open += brackets(line.text);
            joined.push(' ');
            joined.push_str(line.text);
        }
        Ok(joined)
    }

    /// Stores the pairs of `{a: 1, b: [2, 3]}`.
    fn flow_mapping(&mut self, key: &str, flow: &str, number: usize) {
        let inner = flow.trim().trim_start_matches('{').trim_end_matches('}');
        let (mut depth, mut start) = (0i32, 0);
        let mut parts = Vec::new();
        for (at, c) in inner.char_indices() {
            match c {
                '[' | '{' => depth += 1,
                ']' | '}' => depth -= 1,
                ',' if depth == 0 => {
                    parts.extend(inner.get(start..at));
                    start = at + 1;
                }
                _ => {}
            }
        }
        parts.extend(inner.get(start..));
        for (name, value) in parts.into_iter().filter_map(|part| part.split_once(':')) {
            let value = without_tag(value);
            let value = if value.starts_with(['[', '{']) {
                Value::List(words(value).collect())
            } else {
                Value::Word(unquote(value).to_owned())
            };
            self.settings.insert(format!("{key}.{}", unquote(name)), value, number);
        }
    }

    fn error(&self, line: usize, problem: impl Into<String>, cure: &str) -> Error {
        Error::line(&self.settings.path, line, problem, cure)
    }
}

/// The items of a list.
#[derive(Default)]
struct Items {
    words: Vec<String>,
    mappings: usize,
    line: usize,
}

/// Returns the text after the dash of an item of a list.
fn item(text: &str) -> Option<&str> {
    let rest = text.strip_prefix('-')?;
    (rest.is_empty() || rest.starts_with([' ', '\t'])).then(|| rest.trim_start())
}

/// Returns the words between the brackets of a list, also of lists in a list.
fn words(flow: &str) -> impl Iterator<Item = String> + '_ {
    let separators = |c: char| c.is_whitespace() || "[]{},".contains(c);
    flow.split(separators).map(unquote).filter(|word| !word.is_empty()).map(str::to_owned)
}

/// Returns how many more brackets are opened than closed.
fn brackets(text: &str) -> i64 {
    text.chars().map(|c| i64::from("[{".contains(c)) - i64::from("]}".contains(c))).sum()
}

/// Removes a tag such as `!!opencv-matrix` or an anchor from the beginning of a value.
fn without_tag(value: &str) -> &str {
    let value = value.trim();
    if value.starts_with(['!', '&']) {
        value.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    } else {
        value
    }
}

/// Removes a comment, which starts at the first `#` outside quotes.
fn without_comment(line: &str) -> &str {
    let mut quoted = false;
    let end = line.char_indices().find(|&(_, c)| {
        quoted ^= c == '"';
        c == '#' && !quoted
    });
    end.map_or(line, |(at, _)| &line[..at])
}

fn unquote(text: &str) -> &str {
    text.trim().trim_matches(['"', '\''])
}
