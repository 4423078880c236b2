//! Rotations in files, which are matrices with few decimals.
//!
//! In: a matrix. Out: the nearest rotation, or nothing if the matrix is none.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// Largest error of the rotation of a calibration. Source: chosen: three decimals.
pub(crate) const OF_CALIBRATIONS: f64 = 1e-3;
/// Largest error of the rotation of a pose. Source: chosen: two decimals.
pub(crate) const OF_POSES: f64 = 1e-2;

/// Returns the rotation nearest to a matrix; `None` if its product with its transpose differs from the identity by more than `max_error`
/// (Frobenius norm), if it mirrors, or if it is not finite.
pub(crate) fn nearest_rotation(matrix: &Matrix3<f64>, max_error: f64) -> Option<UnitQuaternion<f64>> {
    let error = (matrix * matrix.transpose() - Matrix3::identity()).norm();
    // The search for the nearest rotation may not end for a matrix that is far from any. An error that is no number is no small error.
    let is_rotation = error <= max_error && matrix.determinant() > 0.0;
    is_rotation.then(|| UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(matrix)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_rotations_are_found_and_other_matrices_are_refused() {
        let rotation = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.1);
        let rounded = rotation.to_rotation_matrix().matrix().map(|value: f64| (value * 1e4).round() / 1e4);
        let found = nearest_rotation(&rounded, 1e-3).unwrap();
        assert!(found.angle_to(&rotation) < 1e-4);
        let mut mirrored = Matrix3::identity();
        mirrored[(2, 2)] = -1.0;
        assert_eq!(nearest_rotation(&mirrored, 1e-3), None);
        assert_eq!(nearest_rotation(&Matrix3::zeros(), 1e-3), None);
        for value in [-1e308, 1e308, 1e154, 0.1, f64::NAN, f64::INFINITY] {
            for place in 0..9 {
                let mut matrix = Matrix3::identity();
                matrix[place] += value;
                assert_eq!(nearest_rotation(&matrix, 1e-3), None, "{value} in place {place}");
                let mut filled = matrix;
                filled.fill(value);
                assert_eq!(nearest_rotation(&filled, 1e-3), None, "{value}");
            }
        }
    }
}
