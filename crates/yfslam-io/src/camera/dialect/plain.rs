//! Files of numbers only: `fx fy cx cy` (`calibration.txt` of ETH3D), followed by k1 k2 p1 p2 [k3] in the files of some programs; or a
//! matrix of three or four rows (7-Scenes, ScanNet, BundleFusion).

use std::path::Path;

use super::super::draft::{Draft, Lens};
use crate::error::{Error, Result};
use crate::text::content_lines;

/// More lines are no camera.
const MAX_LINES: usize = 8;

/// Returns whether all lines consist of numbers.
pub fn recognises(text: &str) -> bool {
    let mut lines = content_lines(text).take(MAX_LINES).peekable();
    lines.peek().is_some() && lines.all(|(_, line)| is_numbers(line))
}

/// Returns whether a line consists of numbers.
pub fn is_numbers(line: &str) -> bool {
    let mut words = words(line).peekable();
    words.peek().is_some() && words.all(|word| word.parse::<f64>().is_ok())
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ',' || c == ';').filter(|word| !word.is_empty())
}

pub fn read(text: &str, path: &Path) -> Result<(&'static str, Draft)> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (number, line) in content_lines(text).take(MAX_LINES) {
        let values: Option<Vec<f64>> =
            words(line).map(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        rows.push(values.ok_or_else(|| {
            Error::line(
                path,
                number,
                format!("'{line}' holds a value that is not a finite number"),
                "write decimal numbers",
            )
        })?);
    }
    let shape: Vec<usize> = rows.iter().map(Vec::len).collect();
    let numbers = rows.concat();
    let draft = match (&shape[..], &numbers[..]) {
        ([4], &[fx, fy, cx, cy]) => Some(("ETH3D calibration.txt", Draft::new([fx, fy, cx, cy]))),
        ([8 | 9], &[fx, fy, cx, cy, k1, k2, p1, p2, ..]) => {
            let mut draft = Draft::new([fx, fy, cx, cy]);
            let k3 = numbers.get(8).copied().unwrap_or(0.0);
            draft.lens = Lens { polynomial: [k1, k2, p1, p2, k3], rational: [0.0; 3] };
            draft.notes.push("the numbers are taken for fx fy cx cy k1 k2 p1 p2 k3".into());
            Some(("camera in one line of numbers", draft))
        }
        ([3, 3, 3], _) => Draft::from_matrix(&numbers, 3).map(|draft| ("camera matrix", draft)),
        ([4, 4, 4] | [4, 4, 4, 4], _) => Draft::from_matrix(&numbers, 4).map(|draft| ("camera matrix", draft)),
        _ => None,
    };
    draft.ok_or_else(|| {
        let problem = format!("has {} numbers that are no camera", numbers.len());
        let cure = "write 'fx fy cx cy' on one line, or the matrix [fx 0 cx; 0 fy cy; 0 0 1] on three";
        Error::content(path, problem, cure)
    })
}
