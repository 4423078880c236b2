//! `calib.txt` of KITTI odometry (`P0:` to `P3:`) and `calib_cam_to_cam.txt` of KITTI raw (`P_rect_02:`, `S_rect_02:`): rectified cameras.

use std::path::Path;

use super::super::draft::Draft;
use super::super::settings::pixels;
use crate::error::{Error, Result};
use crate::text::content_lines;

const CURE: &str = "use the original calibration of the sequence";

pub fn recognises(text: &str) -> bool {
    content_lines(text)
        .any(|(_, line)| ["P0:", "P2:", "P_rect_00:", "P_rect_02:"].iter().any(|key| line.starts_with(key)))
}

pub fn read(text: &str, path: &Path) -> Result<Draft> {
    let numbers = |key: &str| -> Result<Option<(usize, Vec<f64>)>> {
        let found =
            content_lines(text).find_map(|(number, line)| Some((number, line.strip_prefix(key)?.strip_prefix(':')?)));
        let Some((number, values)) = found else { return Ok(None) };
        let parsed: Option<Vec<f64>> =
            values.split_whitespace().map(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        let values =
            parsed.ok_or_else(|| Error::line(path, number, format!("{key} holds a value that is no number"), CURE))?;
        Ok(Some((number, values)))
    };
    let projection = |names: [String; 2]| -> Result<Option<[f64; 12]>> {
        for key in names {
            if let Some((number, values)) = numbers(&key)? {
                let matrix = <[f64; 12]>::try_from(values);
                return matrix.map(Some).map_err(|values| {
                    Error::line(path, number, format!("{key} has {} numbers, not 12", values.len()), CURE)
                });
            }
        }
        Ok(None)
    };
    // The colour cameras 2 and 3, as for folders of KITTI; else the grey ones.
    for [left, right] in [[2, 3], [0, 1]] {
        let matrix = |camera: usize| projection([format!("P{camera}"), format!("P_rect_{camera:02}")]);
        let Some(p) = matrix(left)? else { continue };
        let mut draft = Draft::new([p[0], p[5], p[2], p[6]]);
        if let Some(q) = matrix(right)? {
            draft.bf = Some(p[3] - q[3]);
        }
        if let Some((number, size)) = numbers(&format!("S_rect_{left:02}"))? {
            let sides = match size[..] {
                [width, height] => pixels(width.round()).zip(pixels(height.round())),
                _ => None,
            };
            let problem = || Error::line(path, number, format!("S_rect_{left:02} is {size:?}"), CURE);
            draft.size = Some(sides.ok_or_else(problem)?.into());
        }
        draft.notes.push(format!("the calibration of the cameras {left} and {right} is used"));
        return Ok(draft);
    }
    Err(Error::content(path, "the matrix P0 or P2 is missing", CURE))
}
