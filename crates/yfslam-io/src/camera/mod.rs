//! Loads a camera calibration from a preset or from a file of any dialect that `dialect` names, and writes files in TOML.
//!
//! A file is recognised by its content. What it does not say, such as the size of the images, is filled in from the recording by
//! [`CameraSource::complete`]; what changes the images and is not supported is refused with its key.

mod check;
mod dialect;
mod draft;
mod encoding;
mod json;
mod presets;
mod settings;
mod source;
mod write;
mod yaml;

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
pub use check::check_camera;
pub use dialect::parse_toml;
pub use presets::{PRESETS, preset};
pub use source::{CameraSource, Missing, RightCamera};
pub use write::{camera_toml, write_camera};

/// Names of camera files in a sequence folder, in the order in which they are tried.
const CAMERA_FILES: [&str; 12] = [
    "camera.toml",
    "camera.yaml",
    "camera.yml",
    "camera.json",
    "camera_info.yaml",
    "camera_intrinsic.json",
    "intrinsic.json",
    "calibration.yaml",
    "calibration.txt",
    "calib.txt",
    "camchain.yaml",
    "cameras.txt",
];

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
            Err(Error::argument(problem, format!("give the path of a camera file or one of {}", PRESETS.join(", "))))
        }
    }
}

/// Loads the camera file of a sequence folder, such as `camera.toml` or `camera.yaml`.
///
/// # Errors
/// None of them exists, or as for [`load_camera`].
pub fn detect_camera(folder: &Path) -> Result<CameraSource> {
    match CAMERA_FILES.iter().map(|name| folder.join(name)).find(|path| path.is_file()) {
        Some(path) => load_file(&path),
        None => {
            let problem = if folder.is_file() {
                "is one file, without a camera file beside its images".into()
            } else {
                format!("contains no camera file ({})", CAMERA_FILES.join(", "))
            };
            Err(Error::content(folder, problem, format!("give --camera with a file or one of {}", PRESETS.join(", "))))
        }
    }
}

fn load_file(path: &Path) -> Result<CameraSource> {
    let source = parse_camera(&encoding::read_any_text(path)?, path)?;
    check_camera(&source)?;
    Ok(source)
}

/// Parses the text of a camera file of any dialect; `path` names it in messages, and the ending `.toml` stands for TOML.
///
/// # Errors
/// The dialect is not recognised, or the file is malformed, incomplete or describes a camera that is not supported.
pub fn parse_camera(text: &str, path: &Path) -> Result<CameraSource> {
    if path.extension().is_some_and(|extension| extension == "toml") || dialect::is_toml(text) {
        parse_toml(text, path)
    } else {
        dialect::read(text, path)
    }
}

#[cfg(test)]
mod tests;
