//! The pinhole camera without distortion, with a virtual disparity, as the optimisers use it.
//!
//! In: points in the camera frame, or pixels with depth. Out: pixels, or points.

use nalgebra::{Point3, Vector3};

use crate::camera::Camera;

/// Intrinsics of undistorted pixels; depth is expressed as disparity `bf / z`, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pinhole {
    /// Focal length in x, px.
    pub fx: f64,
    /// Focal length in y, px.
    pub fy: f64,
    /// Principal point in x, px.
    pub cx: f64,
    /// Principal point in y, px.
    pub cy: f64,
    /// Baseline times fx, px·m.
    pub bf: f64,
}

impl Pinhole {
    /// Projects a point of the camera frame; valid for positive z only.
    #[inline]
    pub(crate) fn project(&self, p: &Vector3<f64>) -> [f64; 2] {
        let inv_z = 1.0 / p.z;
        [self.fx * p.x * inv_z + self.cx, self.fy * p.y * inv_z + self.cy]
    }

    /// Returns the point in the camera frame at undistorted pixel (u, v) and depth `z_m`.
    #[inline]
    pub(crate) fn unproject(&self, u: f64, v: f64, z_m: f64) -> Point3<f64> {
        Point3::new((u - self.cx) / self.fx * z_m, (v - self.cy) / self.fy * z_m, z_m)
    }
}

impl From<&Camera> for Pinhole {
    fn from(c: &Camera) -> Self {
        Self { fx: c.fx, fy: c.fy, cx: c.cx, cy: c.cy, bf: c.bf }
    }
}
