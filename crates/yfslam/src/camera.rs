//! Pinhole camera with radial-tangential (Brown–Conrady) distortion, as OpenCV defines it.

use serde::{Deserialize, Serialize};

/// Intrinsic calibration of an RGB-D camera whose depth is registered to its colour image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    /// Sensor units of depth per metre, such as 5000 for TUM recordings and 1000 for millimetres.
    pub depth_factor: f64,
    /// Nominal frames per second.
    #[serde(default = "default_fps")]
    pub fps: f64,
    /// Baseline of the depth sensor times `fx`, px·m; scales the virtual right coordinate u_R = u − bf/z.
    #[serde(default = "default_bf")]
    pub bf: f64,
}

fn default_fps() -> f64 {
    30.0
}

fn default_bf() -> f64 {
    40.0
}

impl Camera {
    /// Distorts normalised image coordinates (x = X/Z, y = Y/Z) and returns the pixel position.
    pub fn distort(&self, x: f64, y: f64) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        [self.fx * xd + self.cx, self.fy * yd + self.cy]
    }

    /// Inverts [`Camera::distort`] by fixed-point iteration: pixel position to normalised coordinates.
    pub fn undistort(&self, u: f64, v: f64) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let (xd, yd) = ((u - self.cx) / self.fx, (v - self.cy) / self.fy);
        let (mut x, mut y) = (xd, yd);
        // 20 rounds reach 1e-9 px for the lenses of the presets; five, the customary number, leave 0.01 px in corners.
        for _ in 0..20 {
            let r2 = x * x + y * y;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
            let dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
            (x, y) = ((xd - dx) / radial, (yd - dy) / radial);
        }
        [x, y]
    }

    /// Pixel position with the lens distortion removed.
    pub fn undistort_px(&self, u: f64, v: f64) -> [f64; 2] {
        if self.distortion == [0.0; 5] {
            return [u, v];
        }
        let [x, y] = self.undistort(u, v);
        [self.fx * x + self.cx, self.fy * y + self.cy]
    }
}
