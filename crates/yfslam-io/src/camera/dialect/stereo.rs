//! The second camera of a stereo pair in a calibration: the baseline where the images are rectified, else what they are rectified by.

use nalgebra::{Isometry3, Matrix3, Translation3};
use yfslam::Camera;

use super::super::draft::{Draft, Lens};
use super::super::settings::Settings;
use super::super::source::RightCamera;
use crate::error::Result;
use crate::rotation;

/// Largest deviation of a rectified pair, px for intrinsics, and without unit for rotations.
const TOLERANCE: f64 = 1e-6;

/// Calibration of the right camera relative to the left one.
pub struct Right {
    /// Intrinsics of the right camera: fx, fy, cx, cy.
    pub intrinsics: [f64; 4],
    pub lens: Lens,
    /// Width and height, px, if the file has them.
    pub size: Option<[usize; 2]>,
    /// Pose of one camera in the other as a 4 × 4 matrix, row by row.
    pub motion: Option<Vec<f64>>,
    /// Whether the matrix takes points of the right camera to the left one.
    pub is_right_in_left: bool,
    /// The key that describes the right camera.
    pub key: &'static str,
}

/// Takes the baseline from a pair that is rectified; else keeps the right camera for the rectification of the images, and the reason why
/// they cannot be used as they are.
pub fn with_right(draft: Draft, right: &Right) -> Draft {
    let is_distorted = draft.lens != Lens::default() || right.lens != Lens::default();
    let same = draft.intrinsics.iter().zip(right.intrinsics).all(|(a, b)| (a - b).abs() < TOLERANCE);
    match right.motion.as_deref().and_then(baseline) {
        Some(baseline_m) if same && !is_distorted => draft.with_baseline(Some(baseline_m)),
        _ => {
            let problem =
                format!("{} describes a second camera whose images are not rectified with the first", right.key);
            let reason = if right.motion.is_none() { ", and its pose is missing" } else { "" };
            Draft { stereo_problem: Some(problem + reason), right: right.camera(), ..draft }
        }
    }
}

impl Right {
    /// Returns the right camera; `None` if its pose is not known.
    fn camera(&self) -> Option<RightCamera> {
        let t = rigid_motion(self.motion.as_deref()?)?;
        let ([fx, fy, cx, cy], [width, height]) = (self.intrinsics, self.size.unwrap_or_default());
        let mut camera = Camera::pinhole(width, height, fx, fy, cx, cy).with_distortion(self.lens.polynomial);
        camera.rational = self.lens.rational;
        let t_left_right = if self.is_right_in_left { t } else { t.inverse() };
        Some(RightCamera { camera, t_left_right, key: self.key })
    }
}

/// Returns the motion that a 4 × 4 matrix describes, if it is one.
fn rigid_motion(motion: &[f64]) -> Option<Isometry3<f64>> {
    let rows: &[f64; 16] = motion.try_into().ok()?;
    let [a, b, c, x, d, e, f, y, g, h, i, z, ..] = *rows;
    let rotation = rotation::nearest_rotation(&Matrix3::new(a, b, c, d, e, f, g, h, i), rotation::OF_CALIBRATIONS)?;
    let is_finite = [x, y, z].iter().all(|value| value.is_finite());
    is_finite.then(|| Isometry3::from_parts(Translation3::new(x, y, z), rotation))
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
