//! Pinhole camera with radial-tangential (Brown–Conrady) distortion, as OpenCV defines it.
//!
//! In: the calibration. Out: conversions between normalised coordinates, distorted pixels and undistorted pixels.

mod check;

use serde::{Deserialize, Serialize};

pub use check::CameraError;

/// Frames per second of a camera for which no rate is given.
const DEFAULT_FPS: f64 = 30.0;
/// Baseline times focal length of an RGB-D camera for which none is given, px·m. Source: ORB-SLAM2 settings for TUM.
const DEFAULT_BF: f64 = 40.0;

/// Intrinsic calibration of the colour image, to which depth images are registered, or of the left image of a rectified stereo pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Camera {
    /// Image width, px.
    pub width: usize,
    /// Image height, px.
    pub height: usize,
    /// Focal length in x, px.
    pub fx: f64,
    /// Focal length in y, px.
    pub fy: f64,
    /// Principal point in x, px.
    pub cx: f64,
    /// Principal point in y, px.
    pub cy: f64,
    /// Distortion coefficients k1, k2, p1, p2, k3 (OpenCV order), all zero for rectified images.
    #[serde(default)]
    pub distortion: [f64; 5],
    /// Distortion coefficients k4, k5, k6 of the rational model (OpenCV), the denominator of the radial distortion; all zero for most
    /// lenses.
    #[serde(default, skip_serializing_if = "is_polynomial")]
    pub rational: [f64; 3],
    /// Nominal frames per second.
    #[serde(default = "default_fps")]
    pub fps: f64,
    /// Baseline times `fx`, px·m. For a stereo pair it is measured; for an RGB-D camera it only scales the virtual disparity `bf / z`.
    #[serde(default = "default_bf")]
    pub bf: f64,
    /// Time from the first to the last row of the colour image, or of each image of a stereo pair, ms: 0 for a global shutter, positive
    /// if the top row is read first, negative if the bottom row is. `None` if it is not known. The pose of a frame is that of the instant
    /// at which the row in the middle of the colour image is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout_ms: Option<f64>,
    /// The same for the depth image. `None`: as for the colour image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_readout_ms: Option<f64>,
    /// Time from the middle row of the colour image to the middle row of the depth image when both have the same time stamp, ms.
    /// `None`: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_delay_ms: Option<f64>,
}

/// Returns whether the denominator of the radial distortion is 1.
fn is_polynomial(rational: &[f64; 3]) -> bool {
    *rational == [0.0; 3]
}

fn default_fps() -> f64 {
    DEFAULT_FPS
}

fn default_bf() -> f64 {
    DEFAULT_BF
}

impl Camera {
    /// Makes a camera without distortion, with 30 frames per second. All arguments are in px.
    pub fn pinhole(width: usize, height: usize, fx: f64, fy: f64, cx: f64, cy: f64) -> Self {
        Self {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
            distortion: [0.0; 5],
            rational: [0.0; 3],
            fps: DEFAULT_FPS,
            bf: DEFAULT_BF,
            readout_ms: None,
            depth_readout_ms: None,
            depth_delay_ms: None,
        }
    }

    /// Sets the distortion coefficients k1, k2, p1, p2, k3 (OpenCV order).
    #[must_use]
    pub fn with_distortion(mut self, distortion: [f64; 5]) -> Self {
        self.distortion = distortion;
        self
    }

    /// Returns whether the images have lens distortion.
    pub(crate) fn is_distorted(&self) -> bool {
        self.distortion != [0.0; 5] || !is_polynomial(&self.rational)
    }

    /// Sets the nominal frames per second.
    #[must_use]
    pub fn with_fps(mut self, fps: f64) -> Self {
        self.fps = fps;
        self
    }

    /// Sets the baseline times `fx`, px·m.
    #[must_use]
    pub fn with_bf(mut self, bf: f64) -> Self {
        self.bf = bf;
        self
    }

    /// Distorts normalised image coordinates (x = X/Z, y = Y/Z) and returns the pixel position.
    pub fn distort(&self, x: f64, y: f64) -> [f64; 2] {
        let [_, _, p1, p2, _] = self.distortion;
        let r2 = x * x + y * y;
        let radial = self.radial(r2);
        let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        [self.fx * xd + self.cx, self.fy * yd + self.cy]
    }

    /// Returns the normalised coordinates of a pixel position: the inverse of [`Camera::distort`], by fixed-point iteration.
    pub fn undistort(&self, u: f64, v: f64) -> [f64; 2] {
        let [_, _, p1, p2, _] = self.distortion;
        let (xd, yd) = ((u - self.cx) / self.fx, (v - self.cy) / self.fy);
        let (mut x, mut y) = (xd, yd);
        // 20 iterations reach 1e-9 px for the lenses of the presets; the usual five leave 0.01 px in the image corners.
        for _ in 0..20 {
            let r2 = x * x + y * y;
            let radial = self.radial(r2);
            let dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
            let dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
            (x, y) = ((xd - dx) / radial, (yd - dy) / radial);
        }
        [x, y]
    }

    /// Returns the factor of the radial distortion at the squared distance `r2` from the principal point, in normalised coordinates.
    fn radial(&self, r2: f64) -> f64 {
        let [k1, k2, _, _, k3] = self.distortion;
        let numerator = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        if is_polynomial(&self.rational) {
            return numerator;
        }
        let [k4, k5, k6] = self.rational;
        numerator / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    }

    /// Returns a pixel position without the lens distortion.
    pub(crate) fn undistort_px(&self, u: f64, v: f64) -> [f64; 2] {
        if !self.is_distorted() {
            return [u, v];
        }
        let [x, y] = self.undistort(u, v);
        [self.fx * x + self.cx, self.fy * y + self.cy]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wide-angle colour camera as the Azure Kinect has one; numbers of that order, made up.
    fn wide() -> Camera {
        let camera = Camera::pinhole(1280, 720, 607.0, 606.8, 638.2, 366.9);
        Camera { rational: [0.38, -2.45, 1.44], ..camera.with_distortion([0.5, -2.6, 3e-4, -2e-4, 1.5]) }
    }

    #[test]
    fn the_rational_model_is_inverted_up_to_the_corners() {
        let camera = wide();
        for (u, v) in [(0.0, 0.0), (1279.0, 0.0), (0.0, 719.0), (1279.0, 719.0), (640.0, 100.0)] {
            let [x, y] = camera.undistort(u, v);
            let [again_u, again_v] = camera.distort(x, y);
            assert!((again_u - u).hypot(again_v - v) < 1e-6, "{u} {v}: {again_u} {again_v}");
        }
    }

    #[test]
    fn the_rational_model_is_that_of_opencv() {
        let [u, v] = wide().distort(0.4, -0.3);
        // The formula of OpenCV's documentation, written out at r² = 0.25.
        let radial =
            (1.0 + 0.5 * 0.25 - 2.6 * 0.0625 + 1.5 * 0.015625) / (1.0 + 0.38 * 0.25 - 2.45 * 0.0625 + 1.44 * 0.015625);
        let x = 0.4 * radial + 2.0 * 3e-4 * (0.4 * -0.3) - 2e-4 * (0.25 + 2.0 * 0.16);
        let y = -0.3 * radial + 3e-4 * (0.25 + 2.0 * 0.09) + 2.0 * -2e-4 * (0.4 * -0.3);
        assert!((u - (607.0 * x + 638.2)).abs() < 1e-9 && (v - (606.8 * y + 366.9)).abs() < 1e-9);
        assert!(wide().is_distorted() && !Camera::pinhole(4, 3, 2.0, 2.0, 1.0, 1.0).is_distorted());
    }
}
