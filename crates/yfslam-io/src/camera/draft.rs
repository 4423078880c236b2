//! What a camera file says, before anything that it lacks is filled in.

use yfslam::Camera;

use super::settings::Settings;
use super::source::{CameraSource, Missing, RightCamera};
use crate::error::Result;

/// A pinhole camera as a file describes it; `None` is not in the file.
#[derive(Clone, Debug, Default)]
pub struct Draft {
    /// fx, fy, cx, cy, px. The centre of the upper left pixel is (0, 0).
    pub intrinsics: [f64; 4],
    /// Width and height, px.
    pub size: Option<[usize; 2]>,
    pub lens: Lens,
    pub fps: Option<f64>,
    /// Baseline times fx, px·m.
    pub bf: Option<f64>,
    /// Units of a depth image per metre.
    pub depth_factor: Option<f64>,
    /// Why the file cannot serve a stereo camera as it stands although it describes two cameras.
    pub stereo_problem: Option<String>,
    /// The right camera of a pair that is not rectified.
    pub right: Option<RightCamera>,
    pub notes: Vec<String>,
}

/// Coefficients of the lens distortion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lens {
    /// k1, k2, p1, p2, k3.
    pub polynomial: [f64; 5],
    /// k4, k5, k6.
    pub rational: [f64; 3],
}

impl Draft {
    pub fn new(intrinsics: [f64; 4]) -> Self {
        Self { intrinsics, ..Self::default() }
    }

    /// Makes a draft from a row-major 3 × 3, 3 × 4 or 4 × 4 matrix with `columns` columns; `None` if it has another form.
    pub fn from_matrix(matrix: &[f64], columns: usize) -> Option<Self> {
        let at = |row: usize, column: usize| matrix.get(row * columns + column).copied();
        let zeros = [at(0, 1)?, at(1, 0)?, at(2, 0)?, at(2, 1)?];
        let is_pinhole = zeros.iter().all(|value| value.abs() < 1e-6) && (at(2, 2)? - 1.0).abs() < 1e-6;
        is_pinhole.then_some(Self::new([at(0, 0)?, at(1, 1)?, at(0, 2)?, at(1, 2)?]))
    }

    /// Takes the baseline of a rectified pair, m.
    pub fn with_baseline(mut self, baseline_m: Option<f64>) -> Self {
        let [fx, ..] = self.intrinsics;
        self.bf = self.bf.or(baseline_m.map(|baseline_m| baseline_m * fx));
        self
    }

    /// Makes the camera; what the file lacks is marked as missing.
    pub fn into_source(self, kind: &'static str, settings: Option<Settings>, origin: String) -> CameraSource {
        let [fx, fy, cx, cy] = self.intrinsics;
        let [width, height] = self.size.unwrap_or_default();
        let mut notes = self.notes;
        let fy = if fy < 0.0 {
            let text = "fy is negative, as in ICL-NUIM, whose y axis points up: here y points down, and fy is positive; its ground truth is \
                        mirrored with --layout icl-nuim";
            notes.push(text.into());
            -fy
        } else {
            fy
        };
        let mut camera = Camera::pinhole(width, height, fx, fy, cx, cy).with_distortion(self.lens.polynomial);
        camera.rational = self.lens.rational;
        camera.fps = self.fps.unwrap_or(camera.fps);
        camera.bf = self.bf.unwrap_or(camera.bf);
        let missing = Missing {
            size: self.size.is_none(),
            depth_factor: self.depth_factor.is_none(),
            baseline: self.bf.is_none(),
            stereo_problem: self.stereo_problem,
        };
        let unused_keys = settings.map_or_else(Vec::new, |settings| {
            notes.extend(settings.notes.iter().cloned());
            settings.unused()
        });
        CameraSource {
            camera,
            depth_factor: self.depth_factor.unwrap_or(1.0),
            origin,
            unused_keys,
            kind,
            notes,
            missing,
            right: self.right,
            rectification: None,
        }
    }
}

/// The cure where images have to be undistorted first.
pub const UNDISTORT: &str = "undistort the images to a pinhole camera first, for example with OpenCV, and give the calibration of the new images";

impl Lens {
    /// Takes coefficients in the order of OpenCV: k1, k2, p1, p2, k3, k4, k5, k6; `key` names them in messages.
    ///
    /// # Errors
    /// The number of coefficients is unusual, or there are coefficients of a thin prism or a tilted sensor.
    pub fn of_opencv(numbers: &[f64], settings: &Settings, key: &str) -> Result<Self> {
        let (used, beyond) = numbers.split_at(numbers.len().min(8));
        if beyond.iter().any(|&value| value != 0.0) {
            let problem = format!("{key} has coefficients of a thin prism or a tilted sensor: {beyond:?}");
            return Err(settings.refuse(key, problem, UNDISTORT));
        }
        if ![0, 1, 2, 4, 5, 8].contains(&used.len()) {
            let problem = format!("{key} has {} numbers", numbers.len());
            return Err(settings.refuse(key, problem, "give 4, 5 or 8 in the order k1, k2, p1, p2, k3, k4, k5, k6"));
        }
        let at = |index: usize| used.get(index).copied().unwrap_or(0.0);
        Ok(Self { polynomial: [0, 1, 2, 3, 4].map(at), rational: [5, 6, 7].map(at) })
    }

    /// Takes coefficients under the name of a model; without a name they are those of OpenCV.
    ///
    /// # Errors
    /// The model is unknown or that of a fisheye lens, or as for [`Lens::of_opencv`].
    pub fn of_model(model: Option<(&str, &str)>, numbers: &[f64], settings: &Settings, key: &str) -> Result<Self> {
        let Some((model_key, model)) = model else { return Self::of_opencv(numbers, settings, key) };
        let plain: String = model.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
        match &*plain {
            "" | "none" | "null" | "pinhole" if numbers.iter().all(|&value| value == 0.0) => Ok(Self::default()),
            "radtan" | "radialtangential" | "plumbbob" | "brown" | "brownconrady" | "opencv" | "radtan5"
            | "radtan8" | "rational" | "rationalpolynomial" | "polynomial" | "pinhole" | "none" | "perspective" => {
                Self::of_opencv(numbers, settings, key)
            }
            "inversebrownconrady" | "modifiedbrownconrady" if numbers.iter().all(|&value| value == 0.0) => {
                Ok(Self::default())
            }
            _ => Err(settings.refuse(model_key, format!("{model_key} is '{model}'"), UNDISTORT)),
        }
    }
}

/// Refuses a camera model under `key` unless it is one of `known`, compared without case and punctuation.
pub fn refuse_model(settings: &mut Settings, keys: &[&str], known: &[&str]) -> Result<()> {
    let Some(model) = settings.text(keys)? else { return Ok(()) };
    let plain: String = model.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
    if known.contains(&&*plain) {
        return Ok(());
    }
    let key = settings.first(keys).or(keys.first().copied()).unwrap_or_default();
    Err(settings.refuse(key, format!("{key} is '{model}'"), UNDISTORT))
}
