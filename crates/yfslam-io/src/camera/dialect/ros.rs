//! The calibration file of ROS (`camera_matrix` and so on with `image_width`), and a printed `CameraInfo` message (`K`, `D`, `R`, `P`).

use super::super::draft::{Draft, Lens};
use super::super::settings::Settings;
use super::opencv;
use crate::error::{Error, Result};

const K: [&str; 3] = ["camera_matrix", "K", "k"];
const D: [&str; 3] = ["distortion_coefficients", "D", "d"];
const R: [&str; 3] = ["rectification_matrix", "R", "r"];
const P: [&str; 3] = ["projection_matrix", "P", "p"];

pub fn recognises(settings: &Settings) -> bool {
    let has = |keys: &[&str]| keys.iter().any(|key| settings.has(key) || settings.has(&format!("{key}.data")));
    has(&K) && (settings.has("distortion_model") || (has(&P) && has(&R)))
}

pub fn read(settings: &mut Settings) -> Result<Draft> {
    let k: [f64; 9] = settings.exactly(&K)?.ok_or_else(|| settings.missing("camera_matrix"))?;
    let mut draft = Draft::from_matrix(&k, 3).ok_or_else(|| no_pinhole(settings, &K))?;
    draft.size = settings.size(&["image_width", "width"], &["image_height", "height"])?;
    let model = settings.text(&["distortion_model"])?;
    let numbers = settings.numbers(&D)?.unwrap_or_default();
    let key = given(settings, &D);
    draft.lens = Lens::of_model(model.as_deref().map(|model| ("distortion_model", model)), &numbers, settings, key)?;
    for key in ["binning_x", "binning_y"] {
        if settings.number(&[key])?.is_some_and(|binning| binning > 1.0) {
            let cure = "give the calibration of the images as they are, without binning";
            return Err(settings.refuse(
                key,
                format!("{key} says that the images are smaller than the calibration"),
                cure,
            ));
        }
    }
    for key in ["roi.width", "roi.height", "roi.x_offset", "roi.y_offset"] {
        if settings.number(&[key])?.is_some_and(|side| side != 0.0) {
            let cure = "give the calibration of the images as they are, without a region of interest";
            return Err(settings.refuse(
                key,
                format!("{key} says that the images are a part of the calibrated ones"),
                cure,
            ));
        }
    }
    let projection = settings.exactly::<12>(&P)?;
    let rotation = settings.exactly::<9>(&R)?;
    // The right camera of a pair states −fx·baseline.
    if let Some(tx) = projection.map(|p| p[3]).filter(|tx| *tx != 0.0) {
        draft.bf = Some(tx.abs());
        draft.notes.push(format!("the baseline is from the projection matrix of this camera, {tx}"));
    }
    let is_turned = rotation.is_some_and(|r| {
        r.iter().zip([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]).any(|(a, b)| (a - b).abs() > 1e-9)
    });
    if is_turned && rotation.is_some_and(|r| r.iter().any(|value| *value != 0.0)) {
        let key = given(settings, &R);
        draft.stereo_problem = Some(format!("{key} says that the images have to be rectified"));
    }
    draft.depth_factor = settings.number(&["depth_factor", "depth_map_factor"])?;
    Ok(draft)
}

/// Returns the name of the key that the file has.
pub fn given<'k>(settings: &Settings, keys: &[&'k str]) -> &'k str {
    let has = |key: &&&str| settings.has(key) || settings.has(&format!("{key}.data"));
    keys.iter().find(has).or(keys.first()).copied().unwrap_or_default()
}

/// Refuses a matrix that is not that of a pinhole camera without skew.
pub fn no_pinhole(settings: &Settings, keys: &[&str]) -> Error {
    let key = given(settings, keys);
    settings.refuse(key, format!("{key} is not [fx 0 cx; 0 fy cy; 0 0 1]"), opencv::CURE)
}
