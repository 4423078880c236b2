//! Similarities: rigid motions with scale, between maps with different units of length (Strasdat, Montiel and Davison, Scale
//! Drift-Aware Large Scale Monocular SLAM, RSS 2010).
//!
//! `s_a_b` maps points of frame b, in the unit of b, into frame a and its unit: x ↦ s R x + t. With a scale of exactly 1, results have the
//! same bits as those of the rigid motion. Tangent vectors are ordered (ρ, φ, σ): the tangent vector of SE(3), then the logarithm of the
//! scale.

use nalgebra::{
    Isometry3, Matrix3, Matrix4, Point3, Quaternion, SMatrix, SVector, SymmetricEigen, UnitQuaternion, Vector3,
};

use super::{Pose, se3_exp, se3_log, skew};

/// A similarity; `s_a_b` maps points of frame b into frame a.
pub(crate) type Similarity = nalgebra::Similarity3<f64>;
/// A tangent vector of Sim(3): (ρ, φ, σ).
pub(crate) type Tangent = SVector<f64, 7>;
/// A linear map of tangent vectors of Sim(3).
pub(crate) type TangentMap = SMatrix<f64, 7, 7>;

/// Least difference of the two largest eigenvalues, as a share of the largest, for which the rotation is unique; points on a line have
/// no unique rotation.
const MIN_GAP: f64 = 1e-6;
/// Largest logarithm of a scale: the limit keeps scales finite and positive.
const MAX_LOG_SCALE: f64 = 50.0;

/// Returns a rigid motion as a similarity with scale 1.
pub(crate) fn unscaled(pose: &Pose) -> Similarity {
    Similarity::from_isometry(*pose, 1.0)
}

/// Returns the camera pose with the same projections as `s_cam_world`, in the unit of the world; projections do not depend on the scale.
pub(crate) fn rigid(s_cam_world: &Similarity) -> Pose {
    let Isometry3 { rotation, translation } = s_cam_world.isometry;
    Pose::from_parts((translation.vector / s_cam_world.scaling()).into(), rotation)
}

/// Returns the similarity `s_cam_world` of a camera pose; `scale` is the size of the unit of the world in the unit of the camera. Inverts
/// [`rigid`].
pub(crate) fn with_scale(t_cam_world: &Pose, scale: f64) -> Similarity {
    let translation = (t_cam_world.translation.vector * scale).into();
    Similarity::from_isometry(Pose::from_parts(translation, t_cam_world.rotation), scale)
}

/// Returns the similarity with these tangent coordinates. It agrees with the exponential map to first order, and exactly if σ is 0.
pub(crate) fn sim3_from_tangent(xi: &Tangent) -> Similarity {
    let scale = libm::exp(xi[6].clamp(-MAX_LOG_SCALE, MAX_LOG_SCALE));
    Similarity::from_isometry(se3_exp(&xi.fixed_rows::<6>(0).into_owned()), scale)
}

/// Returns the tangent coordinates of a similarity: the inverse of [`sim3_from_tangent`].
pub(crate) fn sim3_tangent(s: &Similarity) -> Tangent {
    se3_log(&s.isometry).push(libm::log(s.scaling()))
}

/// Returns a similarity after a left perturbation, with its quaternion normalised as in [`super::perturbed`].
pub(crate) fn sim3_perturbed(xi: &Tangent, s: &Similarity) -> Similarity {
    let mut moved = sim3_from_tangent(xi) * s;
    moved.isometry.rotation.renormalize();
    moved
}

/// Computes the adjoint of a similarity: `S exp(ξ) S⁻¹ = exp(Ad(S) ξ)`.
pub(crate) fn sim3_adjoint(s: &Similarity) -> TangentMap {
    let rotation = *s.isometry.rotation.to_rotation_matrix().matrix();
    let translation = s.isometry.translation.vector;
    let mut ad = TangentMap::zeros();
    ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&(rotation * s.scaling()));
    ad.fixed_view_mut::<3, 3>(0, 3).copy_from(&(skew(&translation) * rotation));
    ad.fixed_view_mut::<3, 1>(0, 6).copy_from(&-translation);
    ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    ad[(6, 6)] = 1.0;
    ad
}

/// Estimates the similarity that maps the first point of each pair to the second with the least squared error (Horn, Closed-form solution
/// of absolute orientation using unit quaternions, JOSA A 1987; with the symmetric scale of section 2.D, because both sides have errors).
/// `None` for fewer than three pairs and for points on a line.
pub(crate) fn absolute_orientation(pairs: &[(Point3<f64>, Point3<f64>)]) -> Option<Similarity> {
    let count = pairs.len() as f64;
    let sum = pairs.iter().fold([Vector3::zeros(); 2], |[p, q], pair| [p + pair.0.coords, q + pair.1.coords]);
    let [from, to] = sum.map(|sum| sum / count);
    let (mut m, mut spread) = (Matrix3::zeros(), [0.0; 2]);
    for (p, q) in pairs {
        let (p, q) = (p.coords - from, q.coords - to);
        m += p * q.transpose();
        spread = [spread[0] + p.norm_squared(), spread[1] + q.norm_squared()];
    }
    let scale = (spread[1] / spread[0]).sqrt();
    let rotation = horn_rotation(&m).filter(|_| pairs.len() >= 3 && scale.is_finite() && scale > 0.0)?;
    let translation = to - rotation * from * scale;
    Some(Similarity::from_parts(translation.into(), rotation, scale))
}

/// Returns the rotation that maximises the sum of the scalar products of each second point and the rotated first point: the eigenvector
/// of the largest eigenvalue of Horn's matrix N, which is made from the sums of products M.
fn horn_rotation(m: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let twist = Vector3::new(m.m23 - m.m32, m.m31 - m.m13, m.m12 - m.m21);
    let mut n = Matrix4::zeros();
    n[(0, 0)] = m.trace();
    n.fixed_view_mut::<3, 1>(1, 0).copy_from(&twist);
    n.fixed_view_mut::<1, 3>(0, 1).copy_from(&twist.transpose());
    n.fixed_view_mut::<3, 3>(1, 1).copy_from(&(m + m.transpose() - Matrix3::identity() * m.trace()));
    let eigen = SymmetricEigen::try_new(n, f64::EPSILON, 100)?;
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let [largest, next] = [order[0], order[1]].map(|i| eigen.eigenvalues[i]);
    let q = eigen.eigenvectors.column(order[0]);
    let rotation = UnitQuaternion::try_new(Quaternion::new(q[0], q[1], q[2], q[3]), 1e-9);
    // A comparison with NaN is false, so that NaN eigenvalues give no rotation.
    rotation.filter(|_| largest > 0.0 && largest - next > MIN_GAP * largest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn similarity(v: &[f64; 7]) -> Similarity {
        sim3_from_tangent(&Tangent::from_row_slice(v))
    }

    fn point(v: [f64; 3]) -> Point3<f64> {
        Point3::from(Vector3::from(v))
    }

    proptest! {
        #[test]
        fn tangent_coordinates_are_recovered(v in prop::array::uniform7(-1.5f64..1.5)) {
            prop_assert!((sim3_tangent(&similarity(&v)) - Tangent::from_row_slice(&v)).norm() < 1e-9);
        }

        #[test]
        fn the_rigid_pose_has_the_same_projections(v in prop::array::uniform7(-1.5f64..1.5), p in prop::array::uniform3(-3.0f64..3.0)) {
            let s = similarity(&v);
            let (scaled, plain) = (s * point(p), rigid(&s) * point(p));
            prop_assert!((scaled.coords - plain.coords * s.scaling()).norm() < 1e-9);
            let again = with_scale(&rigid(&s), s.scaling());
            prop_assert!((again * point(p) - scaled).norm() < 1e-9);
        }

        #[test]
        fn with_scale_one_results_have_the_bits_of_the_rigid_motion(v in prop::array::uniform6(-1.5f64..1.5), w in prop::array::uniform6(-1.5f64..1.5), p in prop::array::uniform3(-3.0f64..3.0)) {
            let [a, b] = [v, w].map(|v| se3_exp(&SVector::<f64, 6>::from_row_slice(&v)));
            let (s_a, s_b) = (unscaled(&a), unscaled(&b));
            prop_assert_eq!(rigid(&(s_a * s_b)), a * b);
            prop_assert_eq!(rigid(&s_a.inverse()), a.inverse());
            prop_assert_eq!(s_a * point(p), a * point(p));
            let xi = SVector::<f64, 6>::from_row_slice(&v);
            prop_assert_eq!(rigid(&sim3_perturbed(&xi.push(0.0), &s_b)), super::super::perturbed(&xi, &b));
        }

        #[test]
        fn the_adjoint_moves_a_perturbation_to_the_other_side(v in prop::array::uniform7(-1.0f64..1.0), w in prop::array::uniform7(-1.0f64..1.0)) {
            let (s, xi) = (similarity(&v), Tangent::from_row_slice(&w) * 1e-6);
            let moved = sim3_tangent(&(s * sim3_from_tangent(&xi) * s.inverse()));
            prop_assert!((moved - sim3_adjoint(&s) * xi).norm() < 1e-10);
        }

        #[test]
        fn scale_rotation_and_translation_are_recovered_from_points(
            v in prop::array::uniform7(-1.5f64..1.5),
            points in prop::collection::vec(prop::array::uniform3(-3.0f64..3.0), 3..20),
        ) {
            let s = similarity(&v);
            let pairs: Vec<_> = points.iter().map(|p| (point(*p), s * point(*p))).collect();
            let (a, b) = (pairs[1].0 - pairs[0].0, pairs[2].0 - pairs[0].0);
            prop_assume!(a.cross(&b).norm() > 0.1);
            let found = absolute_orientation(&pairs).unwrap();
            prop_assert!((found.scaling() / s.scaling() - 1.0).abs() < 1e-9);
            prop_assert!(found.isometry.rotation.angle_to(&s.isometry.rotation) < 1e-6);
            prop_assert!(pairs.iter().all(|(p, q)| (found * p - q).norm() < 1e-6));
        }

        #[test]
        fn points_on_a_line_and_coinciding_points_are_refused(
            v in prop::array::uniform7(-1.5f64..1.5),
            direction in prop::array::uniform3(-1.0f64..1.0),
            at in prop::collection::vec(-2.0f64..2.0, 0..8),
        ) {
            let s = similarity(&v);
            let on_line = |t: &f64| Point3::new(0.3, -0.2, 2.0) + Vector3::from(direction) * *t;
            let pairs: Vec<_> = at.iter().map(|t| (on_line(t), s * on_line(t))).collect();
            prop_assert!(absolute_orientation(&pairs).is_none());
            let coinciding = [(point(direction), s * point(direction)); 4];
            prop_assert!(absolute_orientation(&coinciding).is_none());
        }
    }

    #[test]
    fn two_pairs_and_nan_are_refused() {
        let p = [Point3::new(0.0, 0.0, 1.0), Point3::new(1.0, 0.0, 1.0), Point3::new(0.0, 1.0, 1.0)];
        let pairs = p.map(|p| (p, p));
        assert!(absolute_orientation(&pairs[..2]).is_none() && absolute_orientation(&[]).is_none());
        let mut broken = pairs;
        broken[1].1.x = f64::NAN;
        assert!(absolute_orientation(&pairs).is_some() && absolute_orientation(&broken).is_none());
    }
}
