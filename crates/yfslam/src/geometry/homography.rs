//! The homography between two images of a plane (Hartley and Zisserman, Multiple View Geometry, section 4.1) and the motions that explain
//! it (Ma, Soatto, Košecká and Sastry, An Invitation to 3-D Vision, section 5.3.3).
//!
//! In: positions of the same points in both images. Out: the matrix H with x₂ ~ H x₁ for the points of a plane, and its motions.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::essential::with_both_signs;
use super::fundamental::{Pair, direct_linear};
use crate::geometry::Pose;

/// Difference of the squared singular values of a homography, relative to the middle one, below which it is a pure rotation.
const MIN_SPREAD: f64 = 1e-6;

/// Computes H by the normalised direct linear transform; `None` if the pairs do not determine it.
pub(super) fn homography(pairs: impl Iterator<Item = Pair> + Clone) -> Option<Matrix3<f64>> {
    let rows = |a: &Vector3<f64>, b: &Vector3<f64>| {
        [(b.x, 0), (b.y, 3)].map(|(scale, offset)| {
            let mut row = SMatrix::<f64, 9, 1>::zeros();
            row.fixed_rows_mut::<3>(offset).copy_from(a);
            row.fixed_rows_mut::<3>(6).copy_from(&(-scale * a));
            row
        })
    };
    let [to_unit_1, h, to_unit_2] = direct_linear(pairs, 4, rows)?;
    let h = to_unit_2.try_inverse()? * h * to_unit_1;
    h.iter().all(|v| v.is_finite()).then_some(h)
}

/// Returns the squared distance between the second position and the first one mapped by H, px².
pub(super) fn transfer_distance2(h: &Matrix3<f64>, ([x1, y1], [x2, y2]): &Pair) -> f64 {
    let p = h * Vector3::new(f64::from(*x1), f64::from(*y1), 1.0);
    (p.x / p.z - f64::from(*x2)).powi(2) + (p.y / p.z - f64::from(*y2)).powi(2)
}

/// Returns the motions `t_second_first` that explain a homography of rays (K⁻¹ H K), with baselines of length 1; none for a pure rotation.
/// `x₂ᵀ H x₁` must be positive for points that both cameras observe. Two of the four motions place the plane in front of the first camera.
pub(super) fn motions_of_homography(h: &Matrix3<f64>) -> Vec<Pose> {
    let svd = h.svd(false, true);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
    let Some(v_t) = svd.v_t else { return Vec::new() };
    let [v1, v2, v3] = order.map(|i| Vector3::from(v_t.row(i).transpose()));
    let h = h / svd.singular_values[order[1]];
    let [s1, s3] = [order[0], order[2]].map(|i| (svd.singular_values[i] / svd.singular_values[order[1]]).powi(2));
    if s1.is_nan() || s3.is_nan() || s1 - s3 <= MIN_SPREAD {
        return Vec::new();
    }
    let (along, across) = (((1.0 - s3).max(0.0) / (s1 - s3)).sqrt(), ((s1 - 1.0).max(0.0) / (s1 - s3)).sqrt());
    let mut motions = Vec::with_capacity(4);
    // H preserves the length of both vectors u. Each spans, with v₂, one of the two planes that explain H.
    for u in [v1 * along + v3 * across, v1 * along - v3 * across] {
        let normal = v2.cross(&u);
        let before = Matrix3::from_columns(&[v2, u, normal]);
        let (a, b) = (h * v2, h * u);
        let rotation = Matrix3::from_columns(&[a, b, a.cross(&b)]) * before.transpose();
        let Some(baseline) = ((h - rotation) * normal).try_normalize(1e-9) else { continue };
        motions.extend(with_both_signs(rotation, baseline));
    }
    motions
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_motion_is_among_those_of_the_homography_of_a_plane(
            turn in prop::array::uniform3(-0.3f64..0.3),
            shift in prop::array::uniform3(-1.0f64..1.0),
            slope in prop::array::uniform2(-0.5f64..0.5),
            pixels in prop::collection::vec(prop::array::uniform2(-250f32..250.0), 12..20),
        ) {
            let shift = Vector3::from(shift);
            prop_assume!(shift.norm() > 0.1);
            let motion = Pose::new(shift, turn.into());
            let project = |p: Vector3<f64>| [(500.0 * p.x / p.z) as f32, (500.0 * p.y / p.z) as f32];
            // The plane n·p = 3.
            let normal = Vector3::new(slope[0], slope[1], 1.0).normalize();
            let points = pixels.iter().map(|[x, y]| Vector3::new(f64::from(*x) / 500.0, f64::from(*y) / 500.0, 1.0));
            let points: Vec<Vector3<f64>> = points.map(|ray| ray * (3.0 / normal.dot(&ray))).collect();
            let second = |p: &Vector3<f64>| motion.rotation * p + shift;
            prop_assume!(points.iter().all(|p| p.z > 0.1 && second(p).z > 0.1));
            let pairs: Vec<Pair> = points.iter().map(|p| (project(*p), project(second(p)))).collect();
            let h = homography(pairs.iter().copied());
            // Pixels on a line do not determine H.
            let spread: f64 = pixels.iter().map(|p| f64::from(p[0] * (pixels[1][1] - pixels[0][1]) - p[1] * (pixels[1][0] - pixels[0][0])).abs()).fold(0.0, f64::max);
            prop_assume!(spread > 5e3);
            let h = h.unwrap();
            prop_assert!(pairs.iter().all(|pair| transfer_distance2(&h, pair) < 0.01));
            let k = Matrix3::from_diagonal(&Vector3::new(500.0, 500.0, 1.0));
            let mut rays = k.try_inverse().unwrap() * h * k;
            if (second(&points[0])).dot(&(rays * points[0])) < 0.0 {
                rays = -rays;
            }
            let error = |found: &Pose| {
                (found.rotation.inverse() * motion.rotation).angle()
                    + (found.translation.vector - shift.normalize()).norm()
            };
            let best = motions_of_homography(&rays).iter().map(error).fold(f64::INFINITY, f64::min);
            prop_assert!(best < 0.02, "{best}");
        }
    }

    #[test]
    fn a_pure_rotation_has_no_baseline() {
        let rotation = Pose::rotation(Vector3::new(0.1, -0.2, 0.05)).rotation.to_rotation_matrix();
        assert!(motions_of_homography(&(rotation.matrix() * 3.0)).is_empty());
    }
}
