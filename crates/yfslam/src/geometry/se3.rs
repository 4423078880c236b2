//! Exponential and logarithm of SE(3) (Barfoot, State Estimation for Robotics, section 7.1).
//!
//! Tangent vectors are ordered (ρ, φ): translation part, m, then rotation, rad.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3, Vector6};

/// Angle below which the coefficients are computed by their series, rad.
const SMALL_ANGLE: f64 = 1e-4;

/// Returns the matrix of the cross product: `skew(v) * w == v × w`.
pub(crate) fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Computes the exponential map from (ρ, φ) to a rigid motion.
pub(crate) fn se3_exp(xi: &Vector6<f64>) -> Isometry3<f64> {
    let rho = Vector3::new(xi[0], xi[1], xi[2]);
    let phi = Vector3::new(xi[3], xi[4], xi[5]);
    let theta2 = phi.norm_squared();
    let theta = theta2.sqrt();
    // V = I + a [φ]× + b [φ]×²
    let (a, b) = if theta < SMALL_ANGLE {
        (0.5 - theta2 / 24.0, 1.0 / 6.0 - theta2 / 120.0)
    } else {
        ((1.0 - libm::cos(theta)) / theta2, (theta - libm::sin(theta)) / (theta2 * theta))
    };
    let cross = phi.cross(&rho);
    let t = rho + cross * a + phi.cross(&cross) * b;
    Isometry3::from_parts(Translation3::from(t), UnitQuaternion::from_scaled_axis(phi))
}

/// Returns the pose after a left perturbation, `exp(xi) * pose`, with its quaternion normalised: the rounding error of its length doubles
/// with each product of a pose and an inverse, and the constant-velocity model computes two such products in each frame.
pub(crate) fn perturbed(xi: &Vector6<f64>, pose: &Isometry3<f64>) -> Isometry3<f64> {
    let mut moved = se3_exp(xi) * pose;
    moved.rotation.renormalize();
    moved
}

/// Computes the logarithm of a rigid motion: the inverse of [`se3_exp`] for rotations below π.
pub(crate) fn se3_log(pose: &Isometry3<f64>) -> Vector6<f64> {
    let phi = pose.rotation.scaled_axis();
    let theta2 = phi.norm_squared();
    let theta = theta2.sqrt();
    // V⁻¹ = I − ½[φ]× + c [φ]×²
    let c = if theta < SMALL_ANGLE {
        1.0 / 12.0 + theta2 / 720.0
    } else {
        1.0 / theta2 - (1.0 + libm::cos(theta)) / (2.0 * theta * libm::sin(theta))
    };
    let t = pose.translation.vector;
    let cross = phi.cross(&t);
    let rho = t - cross * 0.5 + phi.cross(&cross) * c;
    Vector6::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn log_inverts_exp(v in prop::array::uniform6(-1.5f64..1.5), scale in prop::sample::select(vec![1.0, 1e-3, 1e-6, 0.0])) {
            let xi = Vector6::from_row_slice(&v) * scale;
            prop_assert!((se3_log(&se3_exp(&xi)) - xi).norm() < 1e-9);
        }

        #[test]
        fn exp_of_opposite_is_inverse(v in prop::array::uniform6(-1.5f64..1.5)) {
            let xi = Vector6::from_row_slice(&v);
            let identity = se3_exp(&xi) * se3_exp(&-xi);
            prop_assert!(identity.translation.vector.norm() < 1e-12 && identity.rotation.angle() < 1e-7);
        }
    }

    #[test]
    fn repeated_prediction_and_correction_keep_quaternions_normalised() {
        let mut last = Isometry3::identity();
        let mut velocity = se3_exp(&Vector6::new(0.01, 0.0, 0.02, 0.01, -0.02, 0.005));
        for _ in 0..1000 {
            let current = perturbed(&Vector6::new(1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0), &(velocity * last));
            velocity = current * last.inverse();
            last = current;
        }
        assert!((last.rotation.quaternion().norm() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn skew_is_the_cross_product() {
        let (a, b) = (Vector3::new(1.0, 2.0, 3.0), Vector3::new(-4.0, 0.5, 2.0));
        assert!((skew(&a) * b - a.cross(&b)).norm() < 1e-15);
    }
}
