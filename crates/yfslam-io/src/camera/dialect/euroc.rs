//! `sensor.yaml` of EuRoC and of recordings in its layout: `intrinsics`, `distortion_model`, `distortion_coefficients`, `resolution`.

use super::super::draft::{Draft, Lens, refuse_model};
use super::super::settings::{Settings, pixels};
use crate::error::Result;

pub fn recognises(settings: &Settings) -> bool {
    settings.has("intrinsics")
        && (settings.has("resolution") || settings.has("distortion_model") || settings.has("camera_model"))
}

pub fn read(settings: &mut Settings) -> Result<Draft> {
    refuse_model(settings, &["camera_model"], &["pinhole"])?;
    let mut draft = Draft::new(settings.exactly(&["intrinsics"])?.ok_or_else(|| settings.missing("intrinsics"))?);
    let model = settings.text(&["distortion_model"])?;
    let keys = ["distortion_coefficients", "distortion_coeffs"];
    let key = settings.first(&keys).or(settings.first(&["distortion_coefficients.data"])).unwrap_or(keys[0]);
    let numbers = settings.numbers(&[key])?.unwrap_or_default();
    draft.lens = Lens::of_model(model.as_deref().map(|model| ("distortion_model", model)), &numbers, settings, key)?;
    if let Some(size) = settings.exactly::<2>(&["resolution"])? {
        let [width, height] = size.map(pixels);
        let size = width.zip(height).ok_or_else(|| {
            settings.refuse("resolution", format!("resolution is {size:?}"), "give whole numbers of pixels")
        })?;
        draft.size = Some(size.into());
    }
    draft.fps = settings.number(&["rate_hz"])?;
    draft.depth_factor = settings.number(&["depth_factor", "depth_map_factor", "depthmap_factor"])?;
    Ok(draft)
}
