//! The camchain of Kalibr: `cam0:` with `intrinsics`, `distortion_coeffs`, `resolution`, and `cam1:` with `T_cn_cnm1`.

use super::super::draft::{Draft, Lens, refuse_model};
use super::super::settings::{Settings, pixels};
use super::stereo::{Right, motion, with_right};
use crate::error::Result;

pub fn recognises(settings: &Settings) -> bool {
    settings.has("cam0.intrinsics") || settings.has("cam0.camera_model")
}

pub fn read(settings: &mut Settings) -> Result<Draft> {
    let mut draft = camera(settings, "cam0")?;
    if !settings.has("cam1.intrinsics") {
        return Ok(draft);
    }
    let motion = motion(settings, &["cam1.T_cn_cnm1"])?;
    // A right camera of another model concerns stereo cameras only, and is then named as the problem.
    match camera(settings, "cam1") {
        Ok(Draft { intrinsics, lens, size, .. }) => {
            // It takes points of cam0 to cam1.
            let is_right_in_left = false;
            draft =
                with_right(draft, &Right { intrinsics, lens, size, motion, is_right_in_left, key: "cam1.intrinsics" });
        }
        Err(error) => draft.stereo_problem = Some(error.to_string()),
    }
    Ok(draft)
}

fn camera(settings: &mut Settings, name: &str) -> Result<Draft> {
    let key = |field: &str| format!("{name}.{field}");
    refuse_model(settings, &[&key("camera_model")], &["pinhole"])?;
    let intrinsics = key("intrinsics");
    let found = settings.exactly(&[&intrinsics])?.ok_or_else(|| settings.missing(&intrinsics))?;
    let mut draft = Draft::new(found);
    let (model_key, coefficients) = (key("distortion_model"), key("distortion_coeffs"));
    let model = settings.text(&[&model_key])?;
    let numbers = settings.numbers(&[&coefficients])?.unwrap_or_default();
    draft.lens = Lens::of_model(model.as_deref().map(|model| (&*model_key, model)), &numbers, settings, &coefficients)?;
    let resolution = key("resolution");
    if let Some(size) = settings.exactly::<2>(&[&resolution])? {
        let [width, height] = size.map(pixels);
        let size = width.zip(height).ok_or_else(|| {
            settings.refuse(&resolution, format!("{resolution} is {size:?}"), "give whole numbers of pixels")
        })?;
        draft.size = Some(size.into());
    }
    Ok(draft)
}
