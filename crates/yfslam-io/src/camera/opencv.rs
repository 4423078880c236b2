//! OpenCV settings files in the style of ORB-SLAM2 (`Camera.fx: 517.3`) and ORB-SLAM3 (`Camera1.fx`, `RGBD.DepthMapFactor`).
//!
//! They are not YAML 1.2 (`%YAML:1.0`, `Viewer.PointSize:2`), so they are read line by line: `key: value`, comments, quotes, indented
//! keys below a parent key, and lists in brackets, which are skipped.

use std::collections::BTreeMap;
use std::path::Path;

use yfslam::Camera;

use super::CameraSource;
use crate::error::{Error, Result};

/// Value and line number of each key.
type Settings<'a> = BTreeMap<String, (&'a str, usize)>;

/// Parses a settings file.
///
/// Size, `fx fy cx cy` and the depth factor are required; distortion defaults to 0, `fps` to 30 and `bf` to 40. All other keys are
/// listed as unused.
///
/// # Errors
/// A line is not `key: value`, a key is given twice or is missing, a value is not a number, or the camera is a fisheye camera.
pub fn parse_opencv_settings(text: &str, path: &Path) -> Result<CameraSource> {
    let mut settings = Reader { settings: read_settings(text, path)?, path };
    settings.refuse_fisheye()?;
    let [fx, fy] = [settings.required("fx")?, settings.required("fy")?];
    let bf = match settings.optional(&["Camera.bf"])? {
        Some(bf) => Some(bf),
        None => settings.optional(&["Stereo.b"])?.map(|baseline_m| baseline_m * fx),
    };
    let mut distortion = [0.0; 5];
    for (value, name) in distortion.iter_mut().zip(["k1", "k2", "p1", "p2", "k3"]) {
        *value = settings.camera(name)?.unwrap_or(0.0);
    }
    let (width, height) = (settings.required_size("width")?, settings.required_size("height")?);
    let (cx, cy) = (settings.required("cx")?, settings.required("cy")?);
    let mut camera = Camera::pinhole(width, height, fx, fy, cx, cy).with_distortion(distortion);
    let depth_factor = settings.depth_factor()?;
    camera.fps = settings.camera("fps")?.unwrap_or(camera.fps);
    camera.bf = bf.unwrap_or(camera.bf);
    let unused_keys = settings.settings.into_keys().collect();
    Ok(CameraSource { camera, depth_factor, origin: path.display().to_string(), unused_keys })
}

/// Removes known keys from the settings; the remaining ones are unused.
struct Reader<'a> {
    settings: Settings<'a>,
    path: &'a Path,
}

impl Reader<'_> {
    /// Returns the first of `keys` that is given, as a finite number.
    fn optional(&mut self, keys: &[&str]) -> Result<Option<f64>> {
        let Some((key, (value, line))) = keys.iter().find_map(|&key| Some((key, self.settings.remove(key)?))) else {
            return Ok(None);
        };
        match value.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => {
                let problem = format!("{key} is '{value}', not a number");
                Err(Error::line(self.path, line, problem, "write it with a decimal point, such as 517.3"))
            }
        }
    }

    fn camera(&mut self, name: &str) -> Result<Option<f64>> {
        self.optional(&[&format!("Camera.{name}"), &format!("Camera1.{name}")])
    }

    fn required(&mut self, name: &str) -> Result<f64> {
        self.camera(name)?.ok_or_else(|| self.missing(&format!("Camera.{name}")))
    }

    fn required_size(&mut self, name: &str) -> Result<usize> {
        let size = self.required(name)?;
        if size.fract() == 0.0 && (0.0..=1e9).contains(&size) {
            return Ok(size as usize);
        }
        Err(Error::content(self.path, format!("Camera.{name} is {size}"), "give a whole number of pixels"))
    }

    fn depth_factor(&mut self) -> Result<f64> {
        self.optional(&["DepthMapFactor", "RGBD.DepthMapFactor"])?.ok_or_else(|| self.missing("DepthMapFactor"))
    }

    fn missing(&self, key: &str) -> Error {
        let cure = match key {
            "DepthMapFactor" => "add the depth units per metre, such as 'DepthMapFactor: 5000.0'".to_owned(),
            _ => format!("add a line '{key}: …' from the calibration of the camera"),
        };
        Error::content(self.path, format!("the key {key} is missing"), cure)
    }

    fn refuse_fisheye(&self) -> Result<()> {
        match self.settings.get("Camera.type") {
            Some((kind, line)) if !["pinhole", "rectified"].contains(&kind.to_ascii_lowercase().as_str()) => {
                let problem = format!("Camera.type is '{kind}'");
                Err(Error::line(self.path, *line, problem, "undistort the images to a pinhole camera first"))
            }
            _ => Ok(()),
        }
    }
}

fn read_settings<'a>(text: &'a str, path: &Path) -> Result<Settings<'a>> {
    let mut settings = Settings::new();
    let mut parent = "";
    let mut inside_list = false;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (line, raw) in text.lines().enumerate().map(|(index, line)| (index + 1, line)) {
        let content = without_comment(raw).trim_end();
        let trimmed = content.trim_start();
        if inside_list || trimmed.is_empty() || trimmed.starts_with('%') || ["---", "..."].contains(&trimmed) {
            inside_list = inside_list && !trimmed.contains(']');
            continue;
        }
        let Some((key, value)) = trimmed.split_once(':') else {
            let problem = format!("'{trimmed}' is not 'key: value'");
            return Err(Error::line(path, line, problem, "write 'Camera.fx: 517.3' or remove the line"));
        };
        let (key, value) = (unquote(key), unquote(value));
        inside_list = value.contains('[') && !value.contains(']');
        let indented = trimmed.len() < content.len();
        let name = if indented && !parent.is_empty() { format!("{parent}.{key}") } else { key.to_owned() };
        if !indented {
            // A key with a value is not a parent: indentation below it has no meaning.
            parent = if value.is_empty() || value.starts_with("!!") { key } else { "" };
        }
        if value.is_empty() {
            continue;
        }
        if let Some((_, first)) = settings.insert(name, (value, line)) {
            let problem = format!("the key '{key}' is given on line {first} already");
            return Err(Error::line(path, line, problem, "remove one of the two lines"));
        }
    }
    Ok(settings)
}

/// Removes a comment, which starts at the first `#` outside quotes.
fn without_comment(line: &str) -> &str {
    let mut quoted = false;
    let end = line.char_indices().find(|&(_, c)| {
        quoted ^= c == '"';
        c == '#' && !quoted
    });
    end.map_or(line, |(at, _)| &line[..at])
}

fn unquote(text: &str) -> &str {
    text.trim().trim_matches(['"', '\''])
}
