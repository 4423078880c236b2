//! Files with `fx`, `fy`, `cx`, `cy` under plain names, alone or below one key: the configurations of many reconstruction programs
//! (`cam: {H: 680, W: 1200, fx: 600.0, png_depth_scale: 6553.5}`), and `cam_params.json` of Replica.

use super::super::draft::{Draft, Lens, refuse_model};
use super::super::settings::Settings;
use crate::error::Result;

/// Where the keys stand.
const PARENTS: [&str; 8] =
    ["", "cam.", "camera.", "camera_params.", "Dataset.Calibration.", "Calibration.", "intrinsics.", "cameras.0."];

pub fn recognises(settings: &Settings) -> bool {
    parent(settings).is_some()
}

fn parent(settings: &Settings) -> Option<&'static str> {
    PARENTS.into_iter().find(|parent| ["fx", "fl_x"].iter().any(|name| settings.has(&format!("{parent}{name}"))))
}

pub fn read(settings: &mut Settings) -> Result<Draft> {
    let parent = parent(settings).unwrap_or_default();
    let names = |names: &[&str]| names.iter().map(|name| format!("{parent}{name}")).collect::<Vec<_>>();
    let known = ["pinhole", "simplepinhole", "perspective", "opencv", "fullopencv", "radial", "simpleradial"];
    refuse_model(settings, &refs(&names(&["camera_model", "model"])), &known)?;
    let required = |settings: &mut Settings, aliases: &[&str]| settings.required(&refs(&names(aliases)));
    let mut draft = Draft::new([
        required(settings, &["fx", "fl_x"])?,
        required(settings, &["fy", "fl_y"])?,
        required(settings, &["cx"])?,
        required(settings, &["cy"])?,
    ]);
    let mut numbers = [0.0; 8];
    for (number, name) in numbers.iter_mut().zip(["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]) {
        *number = settings.number(&refs(&names(&[name])))?.unwrap_or(0.0);
    }
    let list = names(&["distortion", "distortion_coefficients"]);
    let model_key = format!("{parent}distortion_model");
    let model = settings.text(&[&model_key])?;
    let listed = settings.numbers(&refs(&list))?.unwrap_or_default();
    let coefficients = if listed.is_empty() { &numbers[..] } else { &listed[..] };
    let key = list.iter().find(|key| settings.has(key)).cloned().unwrap_or_else(|| format!("{parent}k1"));
    draft.lens = Lens::of_model(model.as_deref().map(|model| (&*model_key, model)), coefficients, settings, &key)?;
    let (widths, heights) =
        (names(&["width", "image_width", "w", "W", "cols"]), names(&["height", "image_height", "h", "H", "rows"]));
    draft.size = settings.size(&refs(&widths), &refs(&heights))?;
    draft.fps = settings.number(&refs(&names(&["fps"])))?;
    draft.bf = settings.number(&refs(&names(&["bf"])))?;
    let factors =
        names(&["depth_factor", "depth_map_factor", "depthmap_factor", "png_depth_scale", "depth_scale", "scale"]);
    draft.depth_factor = settings.number(&refs(&factors))?;
    // A scale below 1 is metres per unit, as RealSense states it.
    if let Some(metres) = draft.depth_factor.filter(|factor| (1e-6..0.1).contains(factor)) {
        let factor = (1.0 / metres * 1e6).round() / 1e6;
        draft.notes.push(format!("the depth scale {metres} is taken for metres per unit: {factor} units per metre"));
        draft.depth_factor = Some(factor);
    }
    Ok(draft)
}

fn refs(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).collect()
}
