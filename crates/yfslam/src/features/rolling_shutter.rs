//! Brings the features of a rolling-shutter camera to one instant: as a global shutter would have seen them while the middle row of the
//! colour image was read.
//!
//! In: positions and depths as they were measured, each at the time of its row, and the velocity of the camera. Out: the positions and
//! depths of the same points at the time of the middle row. Everything behind sees a global shutter, and depth that was measured at the
//! same time.

use nalgebra::{Vector3, Vector6};

use crate::camera::Camera;
use crate::geometry::Pinhole;
use crate::image::DepthImage;

/// Velocity of the camera in its own frame: translation, m/s, then rotation, rad/s.
pub(crate) type Velocity = Vector6<f64>;

/// When each row of an image is read, relative to the middle row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RowTimes {
    middle_row: f64,
    seconds_per_row: f64,
}

impl RowTimes {
    /// Makes the row times of a sensor that takes `readout_ms` from the first to the last row.
    pub(crate) fn new(camera: &Camera, readout_ms: f64) -> Self {
        let last_row = camera.height.saturating_sub(1).max(1) as f64;
        Self { middle_row: 0.5 * last_row, seconds_per_row: readout_ms * 1e-3 / last_row }
    }

    /// Returns when a row of the distorted image is read, s after the middle row.
    #[inline]
    pub(crate) fn seconds(&self, row: f64) -> f64 {
        (row - self.middle_row) * self.seconds_per_row
    }
}

/// When the rows of the images of one frame are read, relative to the middle row of the colour image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FrameTimes {
    /// Rows of the colour image.
    pub color: RowTimes,
    /// Rows of the depth image, relative to its own middle row.
    pub depth: RowTimes,
    /// Middle row of the depth image, s after that of the colour image.
    pub depth_delay_s: f64,
}

impl FrameTimes {
    /// Makes the times of a camera whose images have the same time stamp; what is not known is a global shutter.
    pub(crate) fn new(camera: &Camera) -> Self {
        let readout_ms = camera.readout_ms.unwrap_or(0.0);
        Self {
            color: RowTimes::new(camera, readout_ms),
            depth: RowTimes::new(camera, camera.depth_readout_ms.unwrap_or(readout_ms)),
            depth_delay_s: camera.depth_delay_ms.unwrap_or(0.0) * 1e-3,
        }
    }

    /// Returns the times of a frame whose depth image has the given time after the colour image.
    pub(crate) fn with_depth_after(self, seconds: f64) -> Self {
        Self { depth_delay_s: self.depth_delay_s + seconds, ..self }
    }

    /// Returns whether colour and depth show one instant.
    pub(crate) fn is_instant(&self) -> bool {
        self.color.seconds_per_row == 0.0 && self.depth.seconds_per_row == 0.0 && self.depth_delay_s == 0.0
    }

    /// Returns whether depth is read at the same time as the colour of the same pixel.
    fn depth_is_simultaneous(&self) -> bool {
        self.color == self.depth && self.depth_delay_s == 0.0
    }

    /// Returns when a row of the depth image is read, s.
    pub(crate) fn depth_seconds(&self, row: f64) -> f64 {
        self.depth_delay_s + self.depth.seconds(row)
    }
}

/// A feature as it was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Measured {
    /// Undistorted column, px.
    pub u: f32,
    /// Undistorted row, px.
    pub v: f32,
    /// Row of the distorted colour image, px.
    pub row: f32,
    /// Depth, m, at the time at which it was measured.
    pub depth_m: Option<f32>,
    /// Row of the depth image in which it was measured, px.
    pub depth_row: f32,
}

/// Returns where a point that is fixed in the world lies in the camera frame at time 0, given where it lies in the camera frame at time
/// `seconds`: the motion exp(seconds · velocity), to second order, which errs by less than 0.01 px at 3 rad/s and 15 ms.
#[inline]
pub(crate) fn at_time_zero(point: &Vector3<f64>, velocity: &Velocity, seconds: f64) -> Vector3<f64> {
    let (linear, angular) = (velocity.fixed_rows::<3>(0), velocity.fixed_rows::<3>(3));
    let rate = linear + angular.cross(point);
    point + (rate + angular.cross(&rate) * (0.5 * seconds)) * seconds
}

/// Returns where a point of the camera frame at time 0 lies in the camera frame when the depth image reads its row.
pub(crate) fn at_depth_time(
    point: &Vector3<f64>,
    times: &FrameTimes,
    velocity: &Velocity,
    camera: &Camera,
) -> Vector3<f64> {
    let mut seen = *point;
    for _ in 0..2 {
        if seen.z <= 0.0 {
            break;
        }
        let [_, row] = camera.distort(seen.x / seen.z, seen.y / seen.z);
        seen = at_time_zero(point, &-velocity, times.depth_seconds(row));
    }
    seen
}

impl Measured {
    /// Returns the ray through the feature, with depth 1.
    #[inline]
    pub(crate) fn ray(&self, pinhole: &Pinhole) -> Vector3<f64> {
        pinhole.unproject(f64::from(self.u), f64::from(self.v), 1.0).coords
    }

    /// Returns the point of the camera frame at time 0. `depth_m` stands for a depth that was not measured.
    #[inline]
    pub(crate) fn point(
        &self,
        times: &FrameTimes,
        velocity: &Velocity,
        pinhole: &Pinhole,
        depth_m: f64,
    ) -> Vector3<f64> {
        let (ray, seconds) = (self.ray(pinhole), times.color.seconds(f64::from(self.row)));
        let Some(measured) = self.depth_m.map(f64::from) else {
            return at_time_zero(&(ray * depth_m), velocity, seconds);
        };
        let depth_seconds = times.depth_seconds(f64::from(self.depth_row));
        if depth_seconds == seconds {
            return at_time_zero(&(ray * measured), velocity, seconds);
        }
        // The depth at time 0 is that of the point when its depth was measured; then the ray is that of time 0.
        let depth_m = at_time_zero(&(ray * measured), velocity, depth_seconds).z;
        let moved = at_time_zero(&(ray * depth_m), velocity, seconds);
        moved * (depth_m / moved.z)
    }

    /// Looks up the depth where the depth image shows the point: the camera has moved between the two images.
    pub(crate) fn measure_depth(
        &mut self,
        times: &FrameTimes,
        velocity: &Velocity,
        camera: &Camera,
        depth: &DepthImage,
    ) {
        if times.depth_is_simultaneous() {
            return;
        }
        let Some(first_guess) = self.depth_m else { return };
        let point = self.point(times, velocity, &Pinhole::from(camera), f64::from(first_guess));
        let seen = at_depth_time(&point, times, velocity, camera);
        if seen.z <= 0.0 {
            return;
        }
        let at = camera.distort(seen.x / seen.z, seen.y / seen.z);
        let [x, y] = at.map(|v| v + 0.5);
        if x >= 0.0 && y >= 0.0 {
            self.depth_m = depth.metres(x as usize, y as usize);
            self.depth_row = at[1] as f32;
        }
    }
}
