//! Cameras of layouts that bring their own form of calibration, and usual ones where a data set documents its camera.

use std::path::Path;

use yfslam::Camera;

use super::layout::Calibration;
use crate::camera::{CameraSource, check_camera, load_camera};
use crate::error::Result;

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
    let camera = CameraSource::new(camera, depth_factor, origin);
    check_camera(&camera)?;
    Ok(Calibration { camera, rectification: None, depth_resampling: None })
}

/// Reads the camera file of an Open3D recording; depth is in millimetres. `None` if there is none.
///
/// # Errors
/// The file cannot be used.
pub fn open3d_camera(folder: &Path, fps: f64) -> Result<Option<Calibration>> {
    let path = OPEN3D_FILES.iter().map(|name| folder.join(name)).find(|path| path.is_file());
    path.map(|path| layout_camera(&path, 1000.0, fps)).transpose()
}

/// Reads a camera file of a layout whose images have `depth_factor` units per metre unless the file says otherwise.
///
/// # Errors
/// The file cannot be used.
pub fn layout_camera(path: &Path, depth_factor: f64, fps: f64) -> Result<Calibration> {
    let mut camera = load_camera(&path.to_string_lossy(), None)?;
    if camera.missing.depth_factor {
        camera.set_depth_factor(depth_factor);
    }
    if camera.missing.baseline {
        camera.camera.bf = BASELINE_M * camera.camera.fx;
    }
    camera.camera.fps = fps;
    Ok(Calibration { camera, rectification: None, depth_resampling: None })
}
