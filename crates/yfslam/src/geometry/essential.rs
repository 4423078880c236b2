//! Motions from an essential matrix (Hartley and Zisserman, Multiple View Geometry, section 9.6.2).
//!
//! In: E with x₂ᵀ E x₁ = 0 for the rays of corresponding points. Out: four motions, of which one places the points in front of both
//! cameras.

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::geometry::Pose;

/// Returns the four motions `t_second_first` of an essential matrix, with baselines of length 1; none if it is not finite.
pub(crate) fn motions_of_essential(e: &Matrix3<f64>) -> Vec<Pose> {
    let svd = e.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Vec::new() };
    // The baseline is the left null vector, which comes last because nalgebra sorts singular values in descending order.
    let baseline: Vector3<f64> = u.column(2).into();
    let quarter_turn = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let mut motions = Vec::with_capacity(4);
    for turn in [quarter_turn, quarter_turn.transpose()] {
        let rotation = u * turn * v_t;
        let rotation = rotation * rotation.determinant().signum();
        if !rotation.iter().all(|v| v.is_finite()) {
            return Vec::new();
        }
        motions.extend(with_both_signs(rotation, baseline));
    }
    motions
}

/// Returns the two motions of a rotation and a baseline whose sign is unknown.
pub(super) fn with_both_signs(rotation: Matrix3<f64>, baseline: Vector3<f64>) -> [Pose; 2] {
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    [baseline, -baseline].map(|t| Pose::from_parts(Translation3::from(t), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::skew;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_motion_is_among_those_of_its_essential_matrix(
            turn in prop::array::uniform3(-1.0f64..1.0),
            shift in prop::array::uniform3(-1.0f64..1.0),
            scale in prop::sample::select(vec![1.0, -0.3, 40.0]),
        ) {
            let shift = Vector3::from(shift);
            prop_assume!(shift.norm() > 0.01);
            let motion = Pose::new(shift.normalize(), turn.into());
            let essential = skew(&motion.translation.vector) * motion.rotation.to_rotation_matrix().matrix() * scale;
            let error = |found: &Pose| {
                (found.rotation.inverse() * motion.rotation).angle()
                    + (found.translation.vector - motion.translation.vector).norm()
            };
            let best = motions_of_essential(&essential).iter().map(error).fold(f64::INFINITY, f64::min);
            prop_assert!(best < 1e-6, "{best}");
        }
    }
}
