//! The pose of a calibrated camera from three points (Grunert 1841, in the form of Haralick, Lee, Ottenberg and Nölle, Review and
//! Analysis of Solutions of the Three Point Perspective Pose Estimation Problem, IJCV 1994, section 3.1).
//!
//! In: three points of the world and the directions in which the camera observes them. Out: up to four poses.

use nalgebra::{Matrix3, Matrix4, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::geometry::Pose;

/// Returns all `t_cam_world` that map the points (world, m) onto the rays (camera frame, unit length), in front of the camera. Empty if
/// the points lie on a line or no pose exists.
pub(crate) fn p3p(points_world: &[Point3<f64>; 3], rays: &[Vector3<f64>; 3]) -> impl Iterator<Item = Pose> + use<> {
    let [p1, p2, p3] = points_world;
    let (a, b, c) = ((p2 - p3).norm_squared(), (p1 - p3).norm_squared(), (p1 - p2).norm_squared());
    let (cos_a, cos_b, cos_c) = (rays[1].dot(&rays[2]), rays[0].dot(&rays[2]), rays[0].dot(&rays[1]));
    let (difference, sum) = ((a - c) / b, (a + c) / b);
    // With s₂ = u s₁ and s₃ = v s₁, the three laws of cosines reduce to a polynomial of degree four in v.
    let quartic = [
        (1.0 + difference).powi(2) - 4.0 * a / b * cos_c * cos_c,
        4.0 * (-difference * (1.0 + difference) * cos_b + 2.0 * a / b * cos_c * cos_c * cos_b
            - (1.0 - sum) * cos_a * cos_c),
        2.0 * (difference * difference - 1.0
            + 2.0 * difference * difference * cos_b * cos_b
            + 2.0 * (b - c) / b * cos_a * cos_a
            - 4.0 * sum * cos_a * cos_b * cos_c
            + 2.0 * (b - a) / b * cos_c * cos_c),
        4.0 * (difference * (1.0 - difference) * cos_b - (1.0 - sum) * cos_a * cos_c
            + 2.0 * c / b * cos_a * cos_a * cos_b),
        (difference - 1.0).powi(2) - 4.0 * c / b * cos_a * cos_a,
    ];
    let (points_world, rays) = (*points_world, *rays);
    real_roots(&quartic).into_iter().flatten().filter_map(move |v| {
        let u = ((difference - 1.0) * v * v - 2.0 * difference * cos_b * v + 1.0 + difference)
            / (2.0 * (cos_c - v * cos_a));
        let s1 = (b / (1.0 + v * v - 2.0 * v * cos_b)).sqrt();
        let distances = refined([s1, u * s1, v * s1], [a, b, c], [cos_a, cos_b, cos_c])?;
        let in_camera = [0, 1, 2].map(|i| Point3::from(rays[i] * distances[i]));
        aligned(&in_camera, &points_world)
    })
}

/// Returns the real roots of c₀ + c₁ v + … + c₄ v⁴: the real eigenvalues of the companion matrix.
fn real_roots(c: &[f64; 5]) -> [Option<f64>; 4] {
    if c.iter().any(|c| !c.is_finite()) || c[4].abs() < 1e-12 {
        return [None; 4];
    }
    let m = c.map(|x| x / c[4]);
    #[rustfmt::skip]
    let companion = Matrix4::new(
        0.0, 0.0, 0.0, -m[0],
        1.0, 0.0, 0.0, -m[1],
        0.0, 1.0, 0.0, -m[2],
        0.0, 0.0, 1.0, -m[3],
    );
    let Some(schur) = companion.try_schur(1e-14, 100) else { return [None; 4] };
    let roots = schur.complex_eigenvalues();
    // Rounding splits a double root into a pair with small imaginary parts; the refinement removes false roots.
    std::array::from_fn(|i| (roots[i].im.abs() <= 1e-4 * (1.0 + roots[i].re.abs())).then_some(roots[i].re))
}

/// Refines distances from the camera by Newton's method on the three laws of cosines; `None` unless they converge to positive distances.
fn refined(mut s: [f64; 3], squares: [f64; 3], cosines: [f64; 3]) -> Option<[f64; 3]> {
    const PAIRS: [(usize, usize); 3] = [(1, 2), (0, 2), (0, 1)];
    let scale = squares.iter().sum::<f64>();
    let mut error = f64::INFINITY;
    for _ in 0..4 {
        let (mut residual, mut jacobian) = (Vector3::zeros(), Matrix3::zeros());
        for (k, (i, j)) in PAIRS.into_iter().enumerate() {
            residual[k] = s[i] * s[i] + s[j] * s[j] - 2.0 * s[i] * s[j] * cosines[k] - squares[k];
            jacobian[(k, i)] = 2.0 * (s[i] - s[j] * cosines[k]);
            jacobian[(k, j)] = 2.0 * (s[j] - s[i] * cosines[k]);
        }
        error = residual.amax();
        if error.is_nan() || error < 1e-14 * scale {
            break;
        }
        let Some(step) = jacobian.lu().solve(&residual) else { break };
        for k in 0..3 {
            s[k] -= step[k];
        }
    }
    (error < 1e-8 * scale && s.iter().all(|s| *s > 0.0)).then_some(s)
}

/// Returns the motion that maps triangle `from` onto the congruent triangle `to`; `None` if its corners lie on a line.
fn aligned(to: &[Point3<f64>; 3], from: &[Point3<f64>; 3]) -> Option<Pose> {
    let axes = |t: &[Point3<f64>; 3]| {
        let x = (t[1] - t[0]).try_normalize(1e-9)?;
        let z = x.cross(&(t[2] - t[0])).try_normalize(1e-9)?;
        Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
    };
    let rotation = Rotation3::from_matrix_unchecked(axes(to)? * axes(from)?.transpose());
    let translation = to[0] - rotation * from[0];
    Some(Pose::from_parts(Translation3::from(translation), UnitQuaternion::from_rotation_matrix(&rotation)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::se3_exp;
    use nalgebra::Vector6;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_true_pose_is_among_the_solutions(
            xi in prop::array::uniform6(-1.0f64..1.0),
            corners in prop::array::uniform3((-1.0f64..1.0, -1.0f64..1.0, 0.5f64..6.0)),
        ) {
            let in_camera = corners.map(|(x, y, z)| Point3::new(x * z, y * z, z));
            let area = (in_camera[1] - in_camera[0]).cross(&(in_camera[2] - in_camera[0])).norm();
            prop_assume!(area > 0.05);
            let t_cam_world = se3_exp(&Vector6::from_row_slice(&xi));
            let world = in_camera.map(|p| t_cam_world.inverse() * p);
            let rays = in_camera.map(|p| p.coords.normalize());
            let best = p3p(&world, &rays)
                .map(|pose| {
                    let error = pose * t_cam_world.inverse();
                    error.translation.vector.norm() + error.rotation.angle()
                })
                .fold(f64::INFINITY, f64::min);
            prop_assert!(best < 1e-4, "{best}");
        }
    }

    #[test]
    fn points_on_a_line_have_no_solution() {
        let world = [1.0, 2.0, 3.0].map(|x| Point3::new(x, 0.0, 4.0));
        let rays = world.map(|p| p.coords.normalize());
        assert_eq!(p3p(&world, &rays).count(), 0);
    }
}
