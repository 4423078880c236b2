//! The second camera of a stereo pair in a calibration: used where the images are rectified, else the reason why it cannot be.

use super::super::draft::Draft;
use super::super::settings::Settings;
use crate::error::Result;

/// Largest deviation of a rectified pair, px for intrinsics, and without unit for rotations.
const TOLERANCE: f64 = 1e-6;

/// Calibration of the right camera relative to the left one.
pub struct Right<'k> {
    /// Intrinsics of the right camera: fx, fy, cx, cy.
    pub intrinsics: [f64; 4],
    pub is_distorted: bool,
    /// Pose of one camera in the other as a 4 × 4 matrix, row by row; the direction does not matter.
    pub motion: Option<Vec<f64>>,
    /// The key that describes the right camera.
    pub key: &'k str,
}

/// Takes the baseline from a pair that is rectified; else keeps the reason why the file cannot serve a stereo camera.
pub fn with_right(draft: Draft, right: &Right<'_>) -> Draft {
    let left_distorted = draft.lens != Default::default();
    let same = draft.intrinsics.iter().zip(right.intrinsics).all(|(a, b)| (a - b).abs() < TOLERANCE);
    match right.motion.as_deref().and_then(baseline) {
        Some(baseline_m) if same && !left_distorted && !right.is_distorted => draft.with_baseline(Some(baseline_m)),
        _ => {
            let problem =
                format!("{} describes a second camera whose images are not rectified with the first", right.key);
            Draft { stereo_problem: Some(problem), ..draft }
        }
    }
}

/// Returns the distance of two cameras if one is beside the other without a rotation, m.
fn baseline(motion: &[f64]) -> Option<f64> {
    let rows: &[f64; 16] = motion.try_into().ok()?;
    let [a, b, c, x, d, e, f, y, g, h, i, z, ..] = *rows;
    let turned = [a - 1.0, b, c, d, e - 1.0, f, g, h, i - 1.0];
    let is_beside = turned.iter().all(|v| v.abs() < TOLERANCE) && y.abs().max(z.abs()) < TOLERANCE * x.abs().max(1.0);
    (is_beside && x != 0.0).then_some(x.abs())
}

/// Returns the numbers of the first matrix in `keys`.
pub fn motion(settings: &mut Settings, keys: &[&str]) -> Result<Option<Vec<f64>>> {
    settings.numbers(keys)
}
