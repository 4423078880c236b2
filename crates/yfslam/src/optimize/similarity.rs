//! The similarity between two maps of the same points (ORB-SLAM, IEEE T-RO 2015, section VII-B): it minimises the reprojection errors of
//! the points of each map in a camera of the other map.
//!
//! In: an initial similarity, points of both maps and their measurements. Out: the refined similarity, and which pairs of points are inliers.

use nalgebra::{Matrix3, Point3, SMatrix, Vector3};

use crate::config::PoseOptimizerConfig;
use crate::geometry::{Pinhole, Pose, Similarity, Tangent, TangentMap, sim3_perturbed, skew};
use crate::optimize::damped::levenberg_marquardt;
use crate::optimize::residual::{Measurement, huber, projection_jacobian};

/// Limit of χ² for an inlier: the 99 % quantile with two degrees of freedom. Source: ORB-SLAM2.
const CHI2_LIMIT: f64 = 9.210;
/// Least depth of a point with a usable projection, in the unit of the map.
const MIN_DEPTH: f64 = 1e-3;

/// A point in two maps, a and b, each with its own unit of length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Correspondence {
    /// Point of map a, in the frame of a camera of a.
    pub in_a: Point3<f64>,
    /// Measurement of the point in that camera.
    pub seen_in_a: Measurement,
    /// Point of map b, in the frame that is aligned with the camera of a.
    pub in_b: Point3<f64>,
    /// Pose of a camera of b relative to that frame.
    pub t_view_b: Pose,
    /// Measurement of the point in the camera of b.
    pub seen_in_b: Measurement,
    /// Whether the pair is an inlier; set by the optimiser.
    pub inlier: bool,
}

impl Correspondence {
    /// Returns whether each point projects to its measured position in the camera of the other map.
    pub(crate) fn fits(&self, camera: &Pinhole, s_b_a: &Similarity) -> bool {
        self.projections(s_b_a, &s_b_a.inverse()).iter().all(|view| {
            let m = &view.measurement;
            view.point.z > MIN_DEPTH && m.chi2(&m.residual(camera, &view.point)) <= CHI2_LIMIT
        })
    }

    /// Returns the point of a in the camera of b and the reverse, with derivatives with respect to a left perturbation of `s_b_a`.
    fn projections(&self, s_b_a: &Similarity, s_a_b: &Similarity) -> [View; 2] {
        let moved = s_b_a * self.in_a;
        let rotation = |pose: &Pose| *pose.rotation.to_rotation_matrix().matrix();
        let forward = rotation(&self.t_view_b) * by_perturbation(&moved.coords);
        // A left perturbation of `s_b_a` is the opposite right perturbation of its inverse.
        let backward = -(rotation(&s_a_b.isometry) * s_a_b.scaling()) * by_perturbation(&self.in_b.coords);
        [
            View { point: (self.t_view_b * moved).coords, jacobian: forward, measurement: self.seen_in_b },
            View { point: (s_a_b * self.in_b).coords, jacobian: backward, measurement: self.seen_in_a },
        ]
    }
}

/// A point in the frame of a camera, its derivative and its measurement.
struct View {
    point: Vector3<f64>,
    jacobian: SMatrix<f64, 3, 7>,
    measurement: Measurement,
}

/// Returns the derivative of a point with respect to a perturbation: ρ + φ × p + σ p.
fn by_perturbation(p: &Vector3<f64>) -> SMatrix<f64, 3, 7> {
    let mut jacobian = SMatrix::<f64, 3, 7>::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(p));
    jacobian.set_column(6, p);
    jacobian
}

/// Refines `s_b_a` in place and marks the inliers; returns their number. Rounds are as in [`super::pose_only::optimize_pose`].
pub(crate) fn optimize_similarity(
    camera: &Pinhole,
    config: &PoseOptimizerConfig,
    s_b_a: &mut Similarity,
    correspondences: &mut [Correspondence],
) -> usize {
    let mut inliers = 0;
    for round in 0..config.rounds {
        inliers = 0;
        for c in correspondences.iter_mut() {
            c.inlier = c.fits(camera, s_b_a);
            inliers += usize::from(c.inlier);
        }
        if inliers < 3 {
            return inliers;
        }
        let robust = round < config.robust_rounds;
        levenberg_marquardt(config, s_b_a, |s| linearise(camera, robust, s, correspondences), sim3_perturbed);
    }
    inliers
}

/// Computes the normal equations H, b and the robust cost from the inliers.
fn linearise(
    camera: &Pinhole,
    robust: bool,
    s_b_a: &Similarity,
    correspondences: &[Correspondence],
) -> (TangentMap, Tangent, f64) {
    let (mut h, mut b, mut cost) = (TangentMap::zeros(), Tangent::zeros(), 0.0);
    let s_a_b = s_b_a.inverse();
    for view in correspondences.iter().filter(|c| c.inlier).flat_map(|c| c.projections(s_b_a, &s_a_b)) {
        if view.point.z <= MIN_DEPTH {
            cost += CHI2_LIMIT;
            continue;
        }
        let r = view.measurement.residual(camera, &view.point);
        let chi2 = view.measurement.chi2(&r);
        let (loss, weight) = if robust { huber(chi2, CHI2_LIMIT) } else { (chi2, 1.0) };
        cost += loss;
        let j = projection_jacobian(camera, &view.point) * view.jacobian;
        let weighted = Matrix3::from_diagonal(&(view.measurement.information() * weight)) * j;
        h += j.transpose() * weighted;
        b += weighted.transpose() * r;
    }
    (h, b, cost)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{se3_exp, sim3_from_tangent, sim3_tangent};
    use nalgebra::Vector6;
    use proptest::prelude::*;

    const CAMERA: Pinhole = Pinhole { fx: 520.0, fy: 510.0, cx: 320.0, cy: 240.0, bf: 0.0 };

    fn measured(p: &Point3<f64>) -> Measurement {
        let [u, v] = CAMERA.project(&p.coords);
        Measurement { u, v, weight_px: 1.0, ..Default::default() }
    }

    /// Returns points of a and their images in b under `s_b_a`; every eighth is an outlier.
    fn pairs(s_b_a: &Similarity) -> Vec<Correspondence> {
        let t_view_b = se3_exp(&Vector6::new(0.2, -0.1, 0.05, 0.02, -0.03, 0.01));
        let pair = |i: usize| {
            let in_a =
                Point3::new(0.2 * (i % 7) as f64 - 0.6, 0.15 * (i % 5) as f64 - 0.3, 2.0 + 0.3 * ((i * 5) % 9) as f64);
            let offset = if i.is_multiple_of(8) { Vector3::new(0.9, -0.7, 0.4) } else { Vector3::zeros() };
            let in_b = s_b_a * in_a + offset;
            let seen_in_b = measured(&(t_view_b * in_b));
            Correspondence { in_a, seen_in_a: measured(&in_a), in_b, t_view_b, seen_in_b, inlier: false }
        };
        (0..40).map(pair).collect()
    }

    proptest! {
        #[test]
        fn the_similarity_is_recovered_and_outliers_are_marked(
            v in prop::array::uniform6(-0.1f64..0.1), sigma in -1.0f64..1.0, w in prop::array::uniform7(-0.002f64..0.002),
        ) {
            let truth = sim3_from_tangent(&Vector6::from_row_slice(&v).push(sigma));
            let mut pairs = pairs(&truth);
            let mut found = sim3_perturbed(&Tangent::from_row_slice(&w), &truth);
            let inliers = optimize_similarity(&CAMERA, &PoseOptimizerConfig::default(), &mut found, &mut pairs);
            prop_assert_eq!(inliers, 35);
            prop_assert!(pairs.iter().enumerate().all(|(i, pair)| pair.inlier != i.is_multiple_of(8)));
            prop_assert!(sim3_tangent(&(found * truth.inverse())).norm() < 1e-6);
        }
    }

    #[test]
    fn derivatives_match_central_differences() {
        let s = sim3_from_tangent(&Tangent::from([0.1, -0.05, 0.2, 0.03, 0.02, -0.04, 0.5]));
        let pair = pairs(&s)[3];
        for axis in 0..7 {
            let mut xi = Tangent::zeros();
            xi[axis] = 1e-6;
            let at = |xi: &Tangent| {
                let moved = sim3_perturbed(xi, &s);
                pair.projections(&moved, &moved.inverse()).map(|view| view.point)
            };
            let (plus, minus, views) = (at(&xi), at(&-xi), pair.projections(&s, &s.inverse()));
            for side in 0..2 {
                let numeric = (plus[side] - minus[side]) / 2e-6;
                assert!((numeric - views[side].jacobian.column(axis)).norm() < 1e-6, "axis {axis}, side {side}");
            }
        }
    }
}
