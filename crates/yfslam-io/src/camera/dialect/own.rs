//! Our own camera files, in TOML.

use std::path::Path;

use serde::Deserialize;
use yfslam::Camera;

use super::super::source::{CameraSource, Missing};
use crate::error::{Error, Result};

const CURE: &str = "the keys are fx, fy, cx, cy and, optionally, width, height, depth_factor, distortion, rational, fps, bf, readout_ms, depth_readout_ms, depth_delay_ms";

/// The keys of a camera file in TOML.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraKeys {
    width: Option<usize>,
    height: Option<usize>,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    distortion: [f64; 5],
    #[serde(default)]
    rational: [f64; 3],
    depth_factor: Option<f64>,
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
        Error::line(path, line, error.message(), CURE)
    })?;
    let size = match (keys.width, keys.height) {
        (Some(width), Some(height)) => Some([width, height]),
        (None, None) => None,
        _ => return Err(Error::content(path, "one of width and height is missing", "give both or none of them")),
    };
    let [width, height] = size.unwrap_or_default();
    let mut camera =
        Camera::pinhole(width, height, keys.fx, keys.fy, keys.cx, keys.cy).with_distortion(keys.distortion);
    camera.rational = keys.rational;
    camera.fps = keys.fps.unwrap_or(camera.fps);
    camera.bf = keys.bf.unwrap_or(camera.bf);
    camera.readout_ms = keys.readout_ms;
    camera.depth_readout_ms = keys.depth_readout_ms;
    camera.depth_delay_ms = keys.depth_delay_ms;
    let mut source = CameraSource::new(camera, keys.depth_factor.unwrap_or(1.0), path.display().to_string());
    source.kind = "TOML";
    source.missing = Missing {
        size: size.is_none(),
        depth_factor: keys.depth_factor.is_none(),
        baseline: keys.bf.is_none(),
        stereo_problem: None,
    };
    Ok(source)
}
