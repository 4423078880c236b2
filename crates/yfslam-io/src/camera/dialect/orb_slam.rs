//! Settings files of ORB-SLAM2 (`Camera.fx: 517.3`), ORB-SLAM3 (`Camera1.fx`, `RGBD.DepthMapFactor`) and stella_vslam (`Camera:` with
//! indented keys, `cols`, `rows`, `depthmap_factor`).

use super::super::draft::{Draft, Lens, refuse_model};
use super::super::settings::Settings;
use super::stereo::{Right, motion, with_right};
use crate::error::Result;

const TYPES: [&str; 2] = ["Camera.type", "Camera.model"];
const FACTORS: [&str; 6] = [
    "DepthMapFactor",
    "RGBD.DepthMapFactor",
    "Camera.depthmap_factor",
    "depthmap_factor",
    "Preprocessing.depthmap_factor",
    "Tracking.depthmap_factor",
];

/// Keys of images that the program rectifies itself before they have the calibration under `Camera`.
const RECTIFIERS: [&str; 3] = ["LEFT.", "RIGHT.", "StereoRectifier."];

pub fn recognises(settings: &Settings) -> bool {
    ["Camera.fx", "Camera1.fx", "Camera.fy", "Camera1.fy", "Camera.cx", "Camera1.cx"]
        .iter()
        .any(|key| settings.has(key))
        || settings.first(&TYPES).is_some()
}

pub fn read(settings: &mut Settings) -> Result<Draft> {
    refuse_model(settings, &TYPES, &["pinhole", "rectified", "perspective"])?;
    let prefix = if settings.has("Camera.fx") || !settings.has_prefix("Camera1.") { "Camera" } else { "Camera1" };
    let [fx, fy, cx, cy] = ["fx", "fy", "cx", "cy"].map(|name| format!("{prefix}.{name}"));
    let other = if prefix == "Camera" { "Camera1" } else { "Camera" };
    let required = |settings: &mut Settings, key: &str| settings.required(&[key, &key.replacen(prefix, other, 1)]);
    let mut draft = Draft::new([
        required(settings, &fx)?,
        required(settings, &fy)?,
        required(settings, &cx)?,
        required(settings, &cy)?,
    ]);
    draft.lens = lens(settings, &[prefix, other])?;
    let sides = |names: [&str; 3]| names.map(|name| format!("Camera.{name}"));
    let (widths, heights) = (sides(["width", "w", "cols"]), sides(["height", "h", "rows"]));
    draft.size = settings.size(&widths.each_ref().map(|s| &**s), &heights.each_ref().map(|s| &**s))?;
    draft.fps = settings.number(&["Camera.fps", "Camera1.fps"])?;
    draft.bf = settings.number(&["Camera.bf", "Camera.focal_x_baseline"])?;
    let baseline_m = settings.number(&["Stereo.b"])?;
    draft = draft.with_baseline(baseline_m);
    draft.depth_factor = settings.number(&FACTORS)?;
    if let Some(key) = settings.first(&["Camera.newWidth", "Camera.newHeight"]) {
        draft.notes.push(format!("{key} asks ORB-SLAM to resize the images; they are used in their own size, with the calibration as it stands"));
    }
    if let Some(key) = RECTIFIERS.iter().find_map(|prefix| settings.first_with_prefix(prefix)) {
        let problem = format!(
            "{key} says that the images have to be rectified, and the calibration is that of the rectified images"
        );
        draft.notes.push(format!("{problem}; images of a single camera must be rectified, too"));
        draft.stereo_problem = Some(format!("{problem}; remove these keys if that has been done"));
        return Ok(draft);
    }
    if !settings.has("Camera2.fx") {
        return Ok(draft);
    }
    let right = Right {
        intrinsics: [
            settings.required(&["Camera2.fx"])?,
            settings.required(&["Camera2.fy"])?,
            settings.required(&["Camera2.cx"])?,
            settings.required(&["Camera2.cy"])?,
        ],
        lens: lens(settings, &["Camera2"])?,
        size: draft.size,
        motion: motion(settings, &["Stereo.T_c1_c2", "Tlr"])?,
        is_right_in_left: true,
        key: "Camera2.fx",
    };
    let given = draft.bf.take();
    draft = with_right(draft, &right);
    draft.bf = given.or(draft.bf);
    Ok(draft)
}

/// Returns the coefficients under the first of `prefixes` that has them.
fn lens(settings: &mut Settings, prefixes: &[&str]) -> Result<Lens> {
    let mut numbers = [0.0; 8];
    for (number, name) in numbers.iter_mut().zip(["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]) {
        let keys: Vec<String> = prefixes.iter().map(|prefix| format!("{prefix}.{name}")).collect();
        *number = settings.number(&keys.iter().map(String::as_str).collect::<Vec<_>>())?.unwrap_or(0.0);
    }
    let [k1, k2, p1, p2, k3, k4, k5, k6] = numbers;
    Ok(Lens { polynomial: [k1, k2, p1, p2, k3], rational: [k4, k5, k6] })
}
