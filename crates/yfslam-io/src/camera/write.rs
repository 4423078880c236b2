//! Writes camera files in TOML, which [`load_camera`](super::load_camera) reads.

use std::io;
use std::path::Path;

use yfslam::Camera;

use crate::atomic_file::write_atomically;
use crate::error::Result;

/// Returns the text of a camera file. Each line of `about` becomes a comment at its beginning.
///
/// # Errors
/// The camera cannot be written as TOML, which would be a fault of this program.
pub fn camera_toml(camera: &Camera, depth_factor: f64, about: &str) -> io::Result<String> {
    // Comments in TOML have no control characters.
    let printable = |line: &str| line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>();
    let comments: String =
        about.lines().map(|line| format!("# {}", printable(line)).trim_end().to_owned() + "\n").collect();
    let keys = toml::to_string(camera).map_err(io::Error::other)?;
    Ok(format!("{comments}{keys}depth_factor = {depth_factor:?}\n"))
}

/// Writes a camera file whole or not at all, as [`camera_toml`] returns it.
///
/// # Errors
/// The file cannot be written.
pub fn write_camera(path: &Path, camera: &Camera, depth_factor: f64, about: &str) -> Result<()> {
    write_atomically(path, |file| file.write_all(camera_toml(camera, depth_factor, about)?.as_bytes()))
}
