//! The configuration: a file in TOML, a dictionary, or the defaults.

use std::path::PathBuf;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use yfslam::config::DepthSource;
use yfslam::{Config, Method};

use crate::error::failure;

/// Methods by their names on the command line.
const METHODS: [(&str, Method); 7] = [
    ("none", Method::None),
    ("boxes", Method::Boxes),
    ("yf", Method::YfSlam),
    ("ds", Method::DsSlam),
    ("dyna", Method::DynaSlam),
    ("dms", Method::DmsSlam),
    ("full", Method::Full),
];

/// Cameras by their names on the command line.
const SENSORS: [(&str, DepthSource); 3] =
    [("rgbd", DepthSource::Image), ("stereo", DepthSource::Stereo), ("mono", DepthSource::Motion)];

/// Returns the configuration of `config`: a path of a file in TOML, a dictionary, or `None`.
pub fn resolve(config: Option<&Bound<'_, PyAny>>) -> PyResult<Config> {
    let Some(config) = config else { return Ok(Config::default()) };
    if let Ok(dict) = config.cast::<PyDict>() {
        // The keys and values of TOML are those of JSON, but for null.
        let json: String = config.py().import("json")?.call_method1("dumps", (dict,))?.extract()?;
        let value: serde_json::Value = serde_json::from_str(&json).map_err(failure)?;
        let text = toml::to_string(&value).map_err(failure)?;
        return Config::from_toml(&text).map_err(failure);
    }
    let Ok(path) = config.extract::<PathBuf>() else {
        return Err(PyTypeError::new_err("config must be None, a dictionary, or the path of a file in TOML"));
    };
    let bytes = yfslam_io::read_file(&path).map_err(failure)?;
    let text = String::from_utf8(bytes).map_err(|_| failure(format!("{}: is not text in UTF-8", path.display())))?;
    Config::from_toml(&text).map_err(|error| failure(format!("{}: {error}", path.display())))
}

/// Returns the method of this name.
pub fn method(name: &str) -> PyResult<Method> {
    named(&METHODS, name, "method")
}

/// Returns the source of depth of this kind of camera.
pub fn sensor(name: &str) -> PyResult<DepthSource> {
    named(&SENSORS, name, "sensor")
}

/// Returns the name of a kind of camera.
pub fn sensor_name(source: DepthSource) -> &'static str {
    SENSORS.iter().find(|(_, known)| *known == source).map_or("", |(name, _)| name)
}

fn named<T: Copy, const N: usize>(known: &[(&str, T); N], name: &str, what: &str) -> PyResult<T> {
    let found = known.iter().find(|(known, _)| *known == name);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        failure(format!("unknown {what} '{name}'; give one of {}", names.join(", ")))
    })
}

/// Returns all settings with their meaning, units, ranges and default values, in TOML.
#[pyfunction]
pub fn default_config_toml() -> PyResult<String> {
    Config::default().to_commented_toml().map_err(failure)
}
