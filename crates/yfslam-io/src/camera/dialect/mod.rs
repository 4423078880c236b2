//! The dialects of camera files, one file each, and the choice among them by content.

mod colmap;
mod euroc;
mod flat;
mod kalibr;
mod kitti;
mod open3d;
mod opencv;
mod orb_slam;
mod own;
mod plain;
mod ros;
mod stereo;
mod vins;

use std::path::Path;

use super::draft::Draft;
use super::settings::Settings;
use super::source::CameraSource;
use super::{json, yaml};
use crate::error::{Error, Result};
use crate::text::content_lines;
pub use own::parse_toml;

/// A dialect whose files consist of keys and values.
struct Dialect {
    name: &'static str,
    recognises: fn(&Settings) -> bool,
    read: fn(&mut Settings) -> Result<Draft>,
}

/// In the order in which they are tried.
const DIALECTS: [Dialect; 8] = [
    Dialect { name: "Open3D camera", recognises: open3d::recognises, read: open3d::read },
    Dialect { name: "ORB-SLAM settings", recognises: orb_slam::recognises, read: orb_slam::read },
    Dialect { name: "Kalibr camchain", recognises: kalibr::recognises, read: kalibr::read },
    Dialect { name: "EuRoC sensor.yaml", recognises: euroc::recognises, read: euroc::read },
    Dialect { name: "VINS camera", recognises: vins::recognises, read: vins::read },
    Dialect { name: "ROS camera_info", recognises: ros::recognises, read: ros::read },
    Dialect { name: "OpenCV calibration", recognises: opencv::recognises, read: opencv::read },
    Dialect { name: "camera with plain keys", recognises: flat::recognises, read: flat::read },
];

/// What is understood, for messages.
const KINDS: &str = "TOML, settings of ORB-SLAM or stella_vslam, a camchain of Kalibr, camera_info of ROS, sensor.yaml of EuRoC, a calibration \
    of OpenCV or VINS in YAML, JSON of Open3D, calib.txt of KITTI, calibration.txt of ETH3D or cameras.txt of COLMAP";

/// Reads a camera file of any dialect but our own; `path` names it in messages.
///
/// # Errors
/// The dialect is not recognised, or the file is malformed, incomplete or describes a camera that is not supported.
pub fn read(text: &str, path: &Path) -> Result<CameraSource> {
    let origin = || path.display().to_string();
    let begin = text.trim_start();
    if begin.starts_with('<') {
        let cure = "save it as YAML (in OpenCV, give the file the ending .yml)";
        return Err(Error::content(path, "is an XML file", cure));
    }
    let first = content_lines(text).next().map_or("", |(_, line)| line);
    if first.starts_with('[') && first.ends_with(']') && !first.contains(',') {
        let cure =
            "give the file in YAML that the calibration of ROS writes beside it, or one in TOML without sections";
        return Err(Error::content(path, format!("begins with the section {first}"), cure));
    }
    if colmap::recognises(first) {
        return Ok(colmap::read(text, path)?.into_source("COLMAP cameras.txt", None, origin()));
    }
    if kitti::recognises(text) {
        return Ok(kitti::read(text, path)?.into_source("KITTI calibration", None, origin()));
    }
    if plain::recognises(text) {
        let (kind, draft) = plain::read(text, path)?;
        return Ok(draft.into_source(kind, None, origin()));
    }
    if plain::is_numbers(first) {
        let cure = "write 'fx fy cx cy' in px on one line; files of DSO and LSD-SLAM have values relative to the size of the images";
        return Err(Error::content(path, format!("begins with numbers that are no camera: '{first}'"), cure));
    }
    let mut settings = if begin.starts_with('{') { json::parse(text, path)? } else { yaml::parse(text, path)? };
    let Some(dialect) = DIALECTS.iter().find(|dialect| (dialect.recognises)(&settings)) else {
        return Err(unknown(&settings));
    };
    let draft = (dialect.read)(&mut settings)?;
    Ok(draft.into_source(dialect.name, Some(settings), origin()))
}

/// Returns whether the first line of content assigns a value to a key, as TOML does.
pub fn is_toml(text: &str) -> bool {
    let first = content_lines(text).next().map_or("", |(_, line)| line);
    let is_key = |key: &str| !key.is_empty() && key.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'_');
    first.split_once('=').is_some_and(|(key, _)| is_key(key.trim()))
}

/// Names what the file has instead of a camera.
fn unknown(settings: &Settings) -> Error {
    for key in ["cam0_calib", "cam1_calib"] {
        if settings.has(key) {
            let cure = format!("give the camera file that {key} names");
            return settings.refuse(key, format!("the camera is in another file, which {key} names"), cure);
        }
    }
    let mut roots: Vec<&str> = settings.roots().collect();
    roots.dedup();
    roots.truncate(5);
    let path = settings.path.clone();
    let problem = match &roots[..] {
        [] => "contains no camera".to_owned(),
        _ => format!("is no camera file that is understood; it has the keys {}", roots.join(", ")),
    };
    Error::content(&path, problem, format!("give {KINDS}; or the key Camera.fx is missing"))
}
