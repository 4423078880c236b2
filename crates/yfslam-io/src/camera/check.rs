//! Refuses calibrations that no camera can have, before a trajectory is computed from them.

use super::CameraSource;
use crate::error::{Error, Result};

/// Checks a calibration with its depth factor; error messages name its origin.
///
/// # Errors
/// The depth factor is not positive and finite, or no camera can have the calibration ([`yfslam::Camera::check`]).
pub fn check_camera(source: &CameraSource) -> Result<()> {
    let CameraSource { camera, depth_factor, origin, .. } = source;
    let refuse = |problem: &str, cure: &str| Err(Error::argument(format!("camera {origin}: {problem}"), cure));
    if !(depth_factor.is_finite() && *depth_factor > 0.0) {
        let cure = "give the depth units per metre: 5000 for TUM, 1000 for millimetres";
        return refuse(&format!("depth factor is {depth_factor}"), cure);
    }
    let mut camera = camera.clone();
    if source.missing.size {
        // The size comes with the first image, and is checked then; until then the principal point is taken for the middle.
        (camera.width, camera.height) = (likely_side(camera.cx), likely_side(camera.cy));
    }
    camera.check().or_else(|error| refuse(&error.problem, error.cure))
}

fn likely_side(centre: f64) -> usize {
    if (1.0..8000.0).contains(&centre) { (2.0 * centre).ceil() as usize } else { 640 }
}
