//! `camera_intrinsic.json` of Open3D and `intrinsic.json` of its RealSense and Azure Kinect recorders, whose matrix stands column by
//! column.

use super::super::draft::Draft;
use super::super::settings::Settings;
use crate::error::Result;

const MATRICES: [&str; 2] = ["intrinsic_matrix", "intrinsic.intrinsic_matrix"];

pub fn recognises(settings: &Settings) -> bool {
    settings.first(&MATRICES).is_some()
}

pub fn read(settings: &mut Settings) -> Result<Draft> {
    let m: [f64; 9] = settings.exactly(&MATRICES)?.ok_or_else(|| settings.missing("intrinsic_matrix"))?;
    let columns_first = [m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]];
    // Some programs write the rows first; the zeros tell which it is.
    let draft = Draft::from_matrix(&columns_first, 3).or_else(|| Draft::from_matrix(&m, 3));
    let key = settings.first(&MATRICES).unwrap_or("intrinsic_matrix");
    let mut draft = draft.ok_or_else(|| {
        let problem = format!("{key} is not the matrix of a pinhole camera");
        settings.refuse(key, problem, "write [fx, 0, 0, 0, fy, 0, cx, cy, 1], column by column, as Open3D does")
    })?;
    draft.size = settings.size(&["width", "intrinsic.width"], &["height", "intrinsic.height"])?;
    draft.fps = settings.number(&["fps"])?;
    // The recorders for RealSense and Azure Kinect state units per metre.
    draft.depth_factor = settings.number(&["depth_scale", "depth_factor"])?;
    Ok(draft)
}
