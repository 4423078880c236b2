//! Loads a camera calibration from a preset, a settings file in the style of ORB-SLAM2 and 3, or a TOML file, and writes the latter.

mod check;
mod opencv;
mod presets;
mod write;

use std::path::{Path, PathBuf};

use serde::Deserialize;
use yfslam::Camera;

use crate::error::{Error, Result};
use crate::text::read_text;
pub use check::check_camera;
pub use opencv::parse_opencv_settings;
pub use presets::{PRESETS, preset};
pub use write::{camera_toml, write_camera};

/// Names of camera files in a sequence folder, in the order in which they are tried.
const CAMERA_FILES: [&str; 3] = ["camera.toml", "camera.yaml", "camera.yml"];

/// A checked camera calibration and its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraSource {
    /// The calibration.
    pub camera: Camera,
    /// Depth units per metre of the depth images that belong to it, such as 5000 for TUM and 1000 for millimetres.
    pub depth_factor: f64,
    /// The preset or file, for display.
    pub origin: String,
    /// Keys of the file that were not used.
    pub unused_keys: Vec<String>,
}

impl CameraSource {
    /// Makes the source of a camera whose sequence has no depth images.
    pub(crate) fn without_depth(camera: Camera, origin: String) -> Self {
        Self { camera, depth_factor: 1.0, origin, unused_keys: Vec::new() }
    }
}

/// Loads the preset or file named `spec`; a relative path is tried as it is, then inside the folder `near`.
///
/// # Errors
/// The name is unknown, the file is unreadable or malformed, a key is missing, or a value is out of range.
pub fn load_camera(spec: &str, near: Option<&Path>) -> Result<CameraSource> {
    let candidates = [Some(PathBuf::from(spec)), near.map(|folder| folder.join(spec))];
    if let Some(path) = candidates.into_iter().flatten().find(|path| path.is_file()) {
        return load_file(&path);
    }
    match preset(spec) {
        Some(source) => Ok(source),
        None => {
            let problem = format!("camera '{spec}' is neither a file nor a preset");
            Err(Error::argument(
                problem,
                format!("give the path of a .yaml or .toml file or one of {}", PRESETS.join(", ")),
            ))
        }
    }
}

/// Loads `camera.toml`, `camera.yaml` or `camera.yml` from a sequence folder.
///
/// # Errors
/// None of them exists, or as for [`load_camera`].
pub fn detect_camera(folder: &Path) -> Result<CameraSource> {
    match CAMERA_FILES.iter().map(|name| folder.join(name)).find(|path| path.is_file()) {
        Some(path) => load_file(&path),
        None => {
            let problem = format!("contains no camera file ({})", CAMERA_FILES.join(", "));
            Err(Error::content(folder, problem, format!("give --camera with a file or one of {}", PRESETS.join(", "))))
        }
    }
}

fn load_file(path: &Path) -> Result<CameraSource> {
    let text = read_text(path)?;
    let source = if path.extension().is_some_and(|extension| extension == "toml") {
        parse_toml(&text, path)?
    } else {
        parse_opencv_settings(&text, path)?
    };
    check_camera(&source)?;
    Ok(source)
}

/// The keys of a camera file in TOML.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraKeys {
    width: usize,
    height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    distortion: [f64; 5],
    depth_factor: f64,
    fps: Option<f64>,
    bf: Option<f64>,
    readout_ms: Option<f64>,
    depth_readout_ms: Option<f64>,
    depth_delay_ms: Option<f64>,
}

/// Parses a camera from TOML and refuses unknown keys.
///
/// # Errors
/// A syntax error, a missing or an unknown key, with its line.
pub fn parse_toml(text: &str, path: &Path) -> Result<CameraSource> {
    let keys: CameraKeys = toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start);
        let line = 1 + text.bytes().take(start).filter(|&byte| byte == b'\n').count();
        let cure = "the keys are width, height, fx, fy, cx, cy, depth_factor and, optionally, distortion, fps, bf, readout_ms, depth_readout_ms, depth_delay_ms";
        Error::line(path, line, error.message(), cure)
    })?;
    let mut camera = Camera::pinhole(keys.width, keys.height, keys.fx, keys.fy, keys.cx, keys.cy);
    camera.distortion = keys.distortion;
    camera.fps = keys.fps.unwrap_or(camera.fps);
    camera.bf = keys.bf.unwrap_or(camera.bf);
    camera.readout_ms = keys.readout_ms;
    camera.depth_readout_ms = keys.depth_readout_ms;
    camera.depth_delay_ms = keys.depth_delay_ms;
    let (depth_factor, origin) = (keys.depth_factor, path.display().to_string());
    Ok(CameraSource { camera, depth_factor, origin, unused_keys: vec![] })
}

#[cfg(test)]
mod tests;
