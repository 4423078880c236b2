//! Camera files of VINS and of camodocal: `model_type: PINHOLE`, `projection_parameters`, `distortion_parameters`.

use super::super::draft::{Draft, Lens, refuse_model};
use super::super::settings::Settings;
use crate::error::Result;

pub fn recognises(settings: &Settings) -> bool {
    settings.has("model_type") || settings.has_prefix("projection_parameters.")
}

pub fn read(settings: &mut Settings) -> Result<Draft> {
    refuse_model(settings, &["model_type"], &["pinhole"])?;
    let mut draft = Draft::new([
        settings.required(&["projection_parameters.fx"])?,
        settings.required(&["projection_parameters.fy"])?,
        settings.required(&["projection_parameters.cx"])?,
        settings.required(&["projection_parameters.cy"])?,
    ]);
    let mut numbers = [0.0; 8];
    for (number, name) in numbers.iter_mut().zip(["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]) {
        *number = settings.number(&[&format!("distortion_parameters.{name}")])?.unwrap_or(0.0);
    }
    draft.lens = Lens::of_opencv(&numbers, settings, "distortion_parameters.k1")?;
    draft.size = settings.size(&["image_width"], &["image_height"])?;
    Ok(draft)
}
