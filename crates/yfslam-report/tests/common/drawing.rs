//! Reads values from the figures of a page with the help of the labels on the axes.

use std::collections::BTreeMap;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// A text in a figure.
#[derive(Clone, Debug, Default)]
pub struct Label {
    pub x: f64,
    pub y: f64,
    pub anchor: String,
    pub text: String,
}

/// A filled rectangle: colour, left and right, top and bottom.
#[derive(Clone, Debug)]
pub struct Bar {
    pub fill: String,
    pub x: [f64; 2],
    pub y: [f64; 2],
}

/// The elements of a figure, in its own units.
#[derive(Clone, Debug, Default)]
pub struct Drawing {
    pub labels: Vec<Label>,
    pub bars: Vec<Bar>,
    /// Colour and points.
    pub lines: Vec<(String, Vec<[f64; 2]>)>,
}

/// Positions of values along an axis.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    start: f64,
    per_unit: f64,
    is_log: bool,
}

impl Scale {
    /// Computes the scale from labels, all of which must agree.
    fn of(ticks: &[(f64, f64)], is_log: bool) -> Self {
        let ticks: Vec<(f64, f64)> = ticks.iter().map(|&(at, v)| (at, if is_log { v.log10() } else { v })).collect();
        let (first, last) = (ticks[0], ticks[ticks.len() - 1]);
        let per_unit = (last.0 - first.0) / (last.1 - first.1);
        for (at, value) in &ticks {
            let off = at - first.0 - per_unit * (value - first.1);
            assert!(off.abs() < 2.5, "the label {value} is off by {off}: {ticks:?}");
        }
        Self { start: first.0 - per_unit * first.1, per_unit, is_log }
    }

    /// Returns the position of a value.
    pub fn place(&self, value: f64) -> f64 {
        self.start + self.per_unit * if self.is_log { value.log10() } else { value }
    }

    /// Returns the value at a position.
    pub fn value(&self, place: f64) -> f64 {
        let value = (place - self.start) / self.per_unit;
        if self.is_log { 10f64.powf(value) } else { value }
    }
}

impl Drawing {
    /// Returns the vertical axis, in metres or degrees.
    pub fn y(&self) -> Scale {
        let title = &self.labels[0].text;
        let ticks = self.labels.iter().filter(|l| l.anchor == "end");
        Scale::of(&ticks.map(|l| (l.y, value(&l.text, title))).collect::<Vec<_>>(), title.contains("logarithmic"))
    }

    /// Returns the horizontal axis.
    pub fn x(&self) -> Scale {
        let title = &self.labels[1].text;
        let ticks = self.labels[2..].iter().filter(|l| l.anchor == "middle");
        Scale::of(&ticks.map(|l| (l.x, value(&l.text, title))).collect::<Vec<_>>(), false)
    }

    /// Returns the longest line of a colour.
    pub fn line(&self, color: &str) -> &[[f64; 2]] {
        let lines = self.lines.iter().filter(|(stroke, _)| stroke == color);
        &lines.max_by_key(|(_, points)| points.len()).unwrap().1
    }
}

/// Returns the value of a label such as `−0.5` or `20 cm` in metres or degrees; the unit may be in the title of the axis.
fn value(label: &str, title: &str) -> f64 {
    let (number, unit) = label.split_once(' ').unwrap_or((label, ""));
    let factor = |unit: &str| match unit {
        "µm" => 1e-6,
        "mm" => 1e-3,
        "cm" => 1e-2,
        _ => 1.0,
    };
    let in_title = title.split_once('(').and_then(|(_, rest)| rest.split(')').next()).unwrap_or("");
    number.replace('−', "-").parse::<f64>().unwrap() * factor(unit) * factor(in_title)
}

/// Returns all figures of a page by the start of their descriptions.
pub fn drawings(html: &str) -> BTreeMap<String, Drawing> {
    let mut found = BTreeMap::new();
    let mut reader = Reader::from_str(html);
    reader.config_mut().check_end_names = false;
    let (mut name, mut is_text) = (None::<String>, false);
    loop {
        let event = reader.read_event().unwrap();
        match &event {
            Event::Eof => return found,
            Event::Start(tag) | Event::Empty(tag) => {
                let attributes = attributes(tag);
                let of = |key: &str| attributes.get(key).cloned().unwrap_or_default();
                let number = |key: &str| of(key).parse::<f64>().unwrap_or_default();
                let element = tag.name().as_ref().to_owned();
                if element == "svg" {
                    name = Some(of("aria-label").split([':', '.']).next().unwrap_or_default().to_owned());
                }
                let Some(drawing) =
                    name.as_ref().map(|name| found.entry(name.clone()).or_insert_with(Drawing::default))
                else {
                    continue;
                };
                is_text = element == "text";
                match element.as_str() {
                    "text" => drawing.labels.push(Label {
                        x: number("x"),
                        y: number("y"),
                        anchor: of("text-anchor"),
                        text: String::new(),
                    }),
                    "rect" => drawing.bars.push(Bar {
                        fill: of("fill"),
                        x: [number("x"), number("x") + number("width")],
                        y: [number("y"), number("y") + number("height")],
                    }),
                    "polyline" => drawing.lines.push((of("stroke"), points(&of("points")))),
                    _ => {}
                }
            }
            Event::Text(text) if is_text => {
                let labels = name.as_ref().and_then(|name| found.get_mut(name)).map(|drawing| &mut drawing.labels);
                labels.unwrap().last_mut().unwrap().text += text.to_string().trim();
            }
            Event::End(tag) => {
                is_text = false;
                if tag.name().as_ref() == "svg" {
                    name = None;
                }
            }
            _ => {}
        }
    }
}

fn points(text: &str) -> Vec<[f64; 2]> {
    let point = |pair: &str| pair.split_once(',').map(|(x, y)| [x.parse().unwrap(), y.parse().unwrap()]).unwrap();
    text.split_whitespace().map(point).collect()
}

fn attributes(tag: &BytesStart) -> BTreeMap<String, String> {
    tag.attributes().map(|a| a.unwrap()).map(|a| (a.key.as_ref().to_owned(), a.value.to_string())).collect()
}

/// Returns the colour of a method in the heading of the table, as in the figures.
pub fn color(html: &str, method: &str) -> String {
    let (before, _) = html.split_once(&format!(")\">{method}</th>")).unwrap();
    let (_, variable) = before.rsplit_once("color:var(").unwrap();
    let (_, rest) = html.split_once(&format!("{variable}:")).unwrap();
    rest.split([';', '}']).next().unwrap().to_owned()
}
