//! The reprojection residual of a feature with or without depth, and its Huber weight.
//!
//! In: a point in the camera frame and its measurement. Out: (Δu, Δv, Δdisparity), its Jacobian and χ².
//! ORB-SLAM2 (IEEE T-RO 2017, section III-B) uses (u, v, u_R). Here the disparity `bf / z` replaces u_R, because the noise of the position
//! and the noise of the depth sensor are then independent and have separate weights.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::geometry::{CHI2_PIXEL, CHI2_PIXEL_DEPTH, Pinhole};

/// Measurement of a point in one image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Measurement {
    /// Undistorted column, px.
    pub u: f64,
    /// Undistorted row, px.
    pub v: f64,
    /// `bf / depth`, px; unused if `weight_disparity` is 0.
    pub disparity: f64,
    /// 1/σ² of u and v, px⁻².
    pub weight_px: f64,
    /// 1/σ² of the disparity, px⁻²; 0 for a feature without depth.
    pub weight_disparity: f64,
}

impl Measurement {
    /// Returns the χ² limit for the number of measured quantities.
    #[inline]
    pub(crate) fn chi2_limit(&self) -> f64 {
        if self.weight_disparity > 0.0 { CHI2_PIXEL_DEPTH } else { CHI2_PIXEL }
    }

    /// Returns the measurement minus its prediction for the point `p` of the camera frame.
    #[inline]
    pub(crate) fn residual(&self, camera: &Pinhole, p: &Vector3<f64>) -> Vector3<f64> {
        let [u, v] = camera.project(p);
        Vector3::new(self.u - u, self.v - v, self.disparity - camera.bf / p.z)
    }

    /// Returns the squared Mahalanobis norm of a residual.
    #[inline]
    pub(crate) fn chi2(&self, r: &Vector3<f64>) -> f64 {
        (r.x * r.x + r.y * r.y) * self.weight_px + r.z * r.z * self.weight_disparity
    }

    /// Returns whether the position alone, without the depth, fits the point `p` of the camera frame.
    pub(crate) fn fits_position(&self, camera: &Pinhole, p: &Point3<f64>) -> bool {
        let r = self.residual(camera, &p.coords);
        p.z > 1e-3 && (r.x * r.x + r.y * r.y) * self.weight_px <= CHI2_PIXEL
    }

    /// Returns the diagonal of the information matrix.
    #[inline]
    pub(crate) fn information(&self) -> Vector3<f64> {
        Vector3::new(self.weight_px, self.weight_px, self.weight_disparity)
    }
}

/// Computes the Jacobian of (û, v̂, bf/ẑ) with respect to the point in the camera frame.
#[inline]
pub(crate) fn projection_jacobian(camera: &Pinhole, p: &Vector3<f64>) -> Matrix3<f64> {
    let iz = 1.0 / p.z;
    let iz2 = iz * iz;
    Matrix3::new(
        camera.fx * iz,
        0.0,
        -camera.fx * p.x * iz2,
        0.0,
        camera.fy * iz,
        -camera.fy * p.y * iz2,
        0.0,
        0.0,
        -camera.bf * iz2,
    )
}

/// Returns the Huber loss of χ² and the weight of the residual; the limit between squared and linear loss is given as χ².
#[inline]
pub(crate) fn huber(chi2: f64, limit: f64) -> (f64, f64) {
    if chi2 <= limit {
        (chi2, 1.0)
    } else {
        let delta = limit.sqrt();
        let e = chi2.sqrt();
        (2.0 * delta * e - limit, delta / e)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_central_differences() {
        let camera = Pinhole { fx: 520.0, fy: 510.0, cx: 320.0, cy: 240.0, bf: 40.0 };
        let p = Vector3::new(0.4, -0.3, 1.7);
        let m = Measurement { weight_px: 1.0, weight_disparity: 1.0, ..Default::default() };
        let jacobian = projection_jacobian(&camera, &p);
        for axis in 0..3 {
            let mut step = Vector3::zeros();
            step[axis] = 1e-6;
            let numeric = (m.residual(&camera, &(p - step)) - m.residual(&camera, &(p + step))) / 2e-6;
            assert!((numeric - jacobian.column(axis)).norm() < 1e-4, "axis {axis}");
        }
    }

    #[test]
    fn huber_is_quadratic_inside_and_linear_outside() {
        assert_eq!(huber(4.0, 5.991), (4.0, 1.0));
        let (cost, weight) = huber(4.0 * 5.991, 5.991);
        assert!((cost - 3.0 * 5.991).abs() < 1e-12 && (weight - 0.5).abs() < 1e-12);
    }
}
