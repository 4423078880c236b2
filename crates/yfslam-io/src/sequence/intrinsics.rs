//! Cameras of layouts that bring their own form of calibration, and usual ones where a data set documents its camera.

use std::path::Path;

use serde::Deserialize;
use yfslam::Camera;

use super::layout::Calibration;
use crate::camera::{CameraSource, check_camera};
use crate::error::{Error, Result};
use crate::text::read_text;

/// Distance between the projector and the camera of a depth sensor, m: that of a Kinect. It scales the virtual disparity.
const BASELINE_M: f64 = 0.075;

/// Names of camera files that win over those of a layout.
const CAMERA_FILES: [&str; 3] = ["camera.toml", "camera.yaml", "camera.yml"];

/// Camera files of Open3D: its RealSense recorder, and its Azure Kinect recorder.
const OPEN3D_FILES: [&str; 2] = ["camera_intrinsic.json", "intrinsic.json"];

/// Returns whether the folder has a camera file of its own.
pub fn has_camera_file(folder: &Path) -> bool {
    CAMERA_FILES.iter().any(|name| folder.join(name).is_file())
}

/// Returns the calibration of an RGB-D camera without distortion.
///
/// # Errors
/// A value is out of range.
pub fn rgbd_camera(
    [width, height]: [usize; 2],
    [fx, fy, cx, cy]: [f64; 4],
    depth_factor: f64,
    fps: f64,
    origin: String,
) -> Result<Calibration> {
    let camera = Camera::pinhole(width, height, fx, fy, cx, cy).with_fps(fps).with_bf(BASELINE_M * fx);
    let camera = CameraSource { camera, depth_factor, origin, unused_keys: Vec::new() };
    check_camera(&camera)?;
    Ok(Calibration { camera, rectification: None, depth_resampling: None })
}

/// The keys of Open3D's camera files; the matrix is in the order of columns.
#[derive(Deserialize)]
struct Open3dKeys {
    width: usize,
    height: usize,
    intrinsic_matrix: [f64; 9],
}

/// Reads the camera file of an Open3D recording; depth is in millimetres. `None` if there is none.
pub fn open3d_camera(folder: &Path, fps: f64) -> Result<Option<Calibration>> {
    let Some(path) = OPEN3D_FILES.iter().map(|name| folder.join(name)).find(|path| path.is_file()) else {
        return Ok(None);
    };
    let keys: Open3dKeys = serde_json::from_str(&read_text(&path)?).map_err(|error| {
        let cure = "the keys are width, height and intrinsic_matrix with 9 numbers, column by column";
        Error::content(&path, error.to_string(), cure)
    })?;
    let [fx, _, _, _, fy, _, cx, cy, _] = keys.intrinsic_matrix;
    rgbd_camera([keys.width, keys.height], [fx, fy, cx, cy], 1000.0, fps, path.display().to_string()).map(Some)
}
