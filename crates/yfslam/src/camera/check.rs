//! Refuses calibrations that no camera can have, before anything is computed from them.

use super::Camera;

/// Largest side of an image, px.
const MAX_SIDE: usize = 16_384;

/// Focal lengths relative to the longer side of the image: from a field of view of 157° to one of 1°. Beyond are mistakes in the value.
const FOCAL_PER_SIDE: std::ops::RangeInclusive<f64> = 0.1..=60.0;

/// Largest ratio of fx and fy, in either direction: that of images whose rows or columns were left out.
const MAX_ASPECT: f64 = 4.0;

/// Distance of a rectified pair of cameras, m.
const BASELINE_M: std::ops::RangeInclusive<f64> = 1e-4..=1e3;

/// Frames per second: from one in three hours.
const FPS: std::ops::RangeInclusive<f64> = 1e-4..=1e5;

/// Longest time that a sensor takes to read its rows, ms: more than any camera for video needs.
const MAX_READOUT_MS: f64 = 100.0;

/// Largest error after undistorting and distorting a point, px. Above it the distortion cannot be inverted.
const MAX_ROUND_TRIP_PX: f64 = 0.5;

/// A calibration that no camera can have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}; {cure}")]
pub struct CameraError {
    /// The value.
    pub problem: String,
    /// What to do.
    pub cure: &'static str,
}

impl Camera {
    /// Checks that a camera can have this calibration: sizes, focal lengths, rate and `bf` are positive, finite and plausible, and the
    /// distortion is invertible up to the border of the image.
    ///
    /// # Errors
    /// A value is out of range.
    pub fn check(&self) -> Result<(), CameraError> {
        for (name, side) in [("width", self.width), ("height", self.height)] {
            if !(1..=MAX_SIDE).contains(&side) {
                return refuse(format!("{name} is {side}"), "give the size of the images in pixels");
            }
        }
        self.check_values()?;
        check_distortion(self).or_else(|(u, v)| {
            let rational = if self.rational == [0.0; 3] { String::new() } else { format!(" with {:?}", self.rational) };
            let problem =
                format!("distortion {:?}{rational} folds the image at pixel ({u:.0}, {v:.0})", self.distortion);
            refuse(problem, "check the order k1, k2, p1, p2, k3, k4, k5, k6, or set them to 0 for rectified images")
        })
    }

    fn check_values(&self) -> Result<(), CameraError> {
        let positive = [
            ("fx", self.fx, "give the focal length in pixels"),
            ("fy", self.fy, "give the focal length in pixels"),
            ("fps", self.fps, "give the frames per second, such as 30"),
            ("bf", self.bf, "give the baseline of the depth sensor times fx, such as 40"),
        ];
        for (name, value, cure) in positive {
            if !(value.is_finite() && value > 0.0) {
                return refuse(format!("{name} is {value}"), cure);
            }
        }
        if let Some((problem, cure)) = implausible(self) {
            return refuse(problem, cure);
        }
        let Self { readout_ms, depth_readout_ms, depth_delay_ms, .. } = *self;
        let times =
            [("readout_ms", readout_ms), ("depth_readout_ms", depth_readout_ms), ("depth_delay_ms", depth_delay_ms)];
        for (name, value) in times {
            if let Some(value) = value.filter(|value| value.is_nan() || value.abs() > MAX_READOUT_MS) {
                let cure = "give milliseconds between -100 and 100, 0 for a global shutter, or leave the key out: it is then estimated";
                return refuse(format!("{name} is {value}"), cure);
            }
        }
        let others = [self.cx, self.cy].into_iter().chain(self.distortion).chain(self.rational);
        match others.into_iter().find(|value| !value.is_finite()) {
            Some(value) => {
                let problem = format!("the principal point or the distortion contains {value}");
                refuse(problem, "calibrate the camera again")
            }
            None => Ok(()),
        }
    }
}

fn refuse(problem: String, cure: &'static str) -> Result<(), CameraError> {
    Err(CameraError { problem, cure })
}

/// Returns what no camera of this size has, and what to do.
fn implausible(camera: &Camera) -> Option<(String, &'static str)> {
    let Camera { fx, fy, cx, cy, fps, bf, .. } = *camera;
    let (width, height) = (camera.width as f64, camera.height as f64);
    if !(1.0 / MAX_ASPECT..=MAX_ASPECT).contains(&(fx / fy)) {
        return Some((format!("fx is {fx} and fy is {fy}"), "give both focal lengths in pixels; they hardly differ"));
    }
    if !BASELINE_M.contains(&(bf / fx)) {
        let problem = format!("bf is {bf}: with fx {fx} the baseline is {:e} m", bf / fx);
        return Some((problem, "give the baseline in m times fx in px, such as 40"));
    }
    if !FPS.contains(&fps) {
        return Some((format!("fps is {fps}"), "give the frames per second, such as 30"));
    }
    let longer = width.max(height);
    for (name, focal) in [("fx", fx), ("fy", fy)] {
        if !FOCAL_PER_SIDE.contains(&(focal / longer)) {
            let problem = format!("{name} is {focal} px for images of {width}×{height} px");
            return Some((problem, "give the focal length in pixels of these images"));
        }
    }
    for (name, centre, side) in [("cx", cx, width), ("cy", cy, height)] {
        if centre.is_finite() && !(-side..=2.0 * side).contains(&centre) {
            let problem = format!("{name} is {centre} px for images of {width}×{height} px");
            return Some((problem, "give the principal point in pixels; it is near the middle of the image"));
        }
    }
    None
}

/// Undistorts and distorts the corners and edge centres; returns the first pixel at which this fails.
fn check_distortion(camera: &Camera) -> Result<(), (f64, f64)> {
    let (right, bottom) = ((camera.width - 1) as f64, (camera.height - 1) as f64);
    for u in [0.0, right / 2.0, right] {
        for v in [0.0, bottom / 2.0, bottom] {
            let [x, y] = camera.undistort(u, v);
            let [u_again, v_again] = camera.distort(x, y);
            let error_px = libm::hypot(u_again - u, v_again - v);
            if error_px.is_nan() || error_px > MAX_ROUND_TRIP_PX {
                return Err((u, v));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calibrations_that_no_camera_has_are_refused_with_the_value_and_the_cure() {
        let camera = Camera::pinhole(640, 480, 535.4, 539.2, 320.1, 247.6);
        assert_eq!(camera.check(), Ok(()));
        let refused = |change: &dyn Fn(&mut Camera), expected: &str| {
            let mut changed = camera.clone();
            change(&mut changed);
            let error = changed.check().unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        refused(&|c| (c.width, c.height) = (45, 660_907), "height is 660907; give the size");
        refused(&|c| c.width = 0, "width is 0");
        refused(&|c| c.fx = 1e-313, "fx is 0.000");
        refused(&|c| c.fy = -1.0, "fy is -1; give the focal length");
        refused(&|c| c.cy = 1e9, "cy is 1000000000 px");
        refused(&|c| c.fps = f64::NAN, "fps is NaN");
        refused(&|c| c.distortion[4] = 1e303, "folds the image");
        refused(&|c| c.readout_ms = Some(1e4), "readout_ms is 10000");
    }
}
