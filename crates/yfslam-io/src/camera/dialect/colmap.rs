//! `cameras.txt` of COLMAP: `CAMERA_ID MODEL WIDTH HEIGHT PARAMS…` on each line.
//!
//! COLMAP puts (0.5, 0.5) into the centre of the upper left pixel, so half a pixel is subtracted from the principal point.

use std::path::Path;

use super::super::draft::{Draft, Lens, UNDISTORT};
use crate::error::{Error, Result};
use crate::text::content_lines;

/// Returns whether the first line of content is that of a camera.
pub fn recognises(line: &str) -> bool {
    let mut words = line.split_whitespace();
    let is_number = |word: Option<&str>| word.is_some_and(|word| word.bytes().all(|c| c.is_ascii_digit()));
    is_number(words.next())
        && words.next().is_some_and(|word| word.bytes().all(|c| c.is_ascii_uppercase() || c == b'_'))
        && is_number(words.next())
        && is_number(words.next())
}

pub fn read(text: &str, path: &Path) -> Result<Draft> {
    let mut first: Option<(&str, Draft)> = None;
    for (number, line) in content_lines(text) {
        let camera = line.split_once(char::is_whitespace).map_or("", |(_, camera)| camera.trim());
        match &first {
            Some((known, _)) if *known == camera => {}
            Some(_) => {
                let problem = "the file has several cameras that differ";
                return Err(Error::line(path, number, problem, "keep the line of the camera of this recording only"));
            }
            None => first = Some((camera, parse(camera, path, number)?)),
        }
    }
    first.map(|(_, draft)| draft).ok_or_else(|| Error::content(path, "contains no camera", "export the model again"))
}

fn parse(camera: &str, path: &Path, number: usize) -> Result<Draft> {
    let mut words = camera.split_whitespace();
    let model = words.next().unwrap_or_default();
    let size = [words.next(), words.next()].map(|word| word.and_then(|word| word.parse::<usize>().ok()));
    let [Some(width), Some(height)] = size else {
        return Err(Error::line(
            path,
            number,
            "the size of the images is no pair of whole numbers",
            "export the model again",
        ));
    };
    let mut p = Vec::new();
    for word in words {
        let value = word.parse::<f64>().ok().filter(|value| value.is_finite());
        p.push(value.ok_or_else(|| {
            Error::line(
                path,
                number,
                format!("{model} has the parameter '{word}', not a number"),
                "export the model again",
            )
        })?);
    }
    let (intrinsics, polynomial, rational) = match (model, &p[..]) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => ([f, f, cx, cy], [0.0; 5], [0.0; 3]),
        ("PINHOLE", &[fx, fy, cx, cy]) => ([fx, fy, cx, cy], [0.0; 5], [0.0; 3]),
        ("SIMPLE_RADIAL", &[f, cx, cy, k1]) => ([f, f, cx, cy], [k1, 0.0, 0.0, 0.0, 0.0], [0.0; 3]),
        ("RADIAL", &[f, cx, cy, k1, k2]) => ([f, f, cx, cy], [k1, k2, 0.0, 0.0, 0.0], [0.0; 3]),
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => ([fx, fy, cx, cy], [k1, k2, p1, p2, 0.0], [0.0; 3]),
        ("FULL_OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6]) => {
            ([fx, fy, cx, cy], [k1, k2, p1, p2, k3], [k4, k5, k6])
        }
        ("SIMPLE_PINHOLE" | "PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "OPENCV" | "FULL_OPENCV", _) => {
            let problem = format!("{model} has {} parameters, which is another number than COLMAP writes", p.len());
            return Err(Error::line(path, number, problem, "export the model again"));
        }
        _ => return Err(Error::line(path, number, format!("the camera model is {model}"), UNDISTORT)),
    };
    let [fx, fy, cx, cy] = intrinsics;
    let mut draft = Draft::new([fx, fy, cx - 0.5, cy - 0.5]);
    draft.size = Some([width, height]);
    draft.lens = Lens { polynomial, rational };
    draft.notes.push(
        "half a pixel is subtracted from the principal point, whose origin in COLMAP is the corner of the image".into(),
    );
    Ok(draft)
}
