//! Bundle adjustment by Levenberg–Marquardt with the Schur complement (Triggs et al., Bundle Adjustment: a Modern Synthesis,
//! 2000, section 6.1).
//!
//! In: a copy of a part of the map: poses, points and observations. Out: refined poses and points. The points are eliminated first. The
//! reduced symmetric system has six unknowns for each free pose; it is solved by Cholesky factorisation, dense or, if large, sparse.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Point3, SMatrix, Vector3, Vector6};
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::factorization::CscCholesky;

use crate::config::BundleConfig;
use crate::geometry::{Pinhole, Pose, perturbed, skew};
use crate::optimize::residual::{Measurement, huber, projection_jacobian};

type Matrix6x3 = SMatrix<f64, 6, 3>;

/// Observation of a point from a pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    /// Index into [`BundleProblem::poses`].
    pub pose: usize,
    /// Index into [`BundleProblem::points`].
    pub point: usize,
    /// Measured position and disparity.
    pub measurement: Measurement,
    /// Static probability, in [0, 1]; an observation with 0 is ignored.
    pub trust: f64,
}

/// A bundle adjustment problem: a copy of a part of the map.
#[derive(Clone, Debug)]
pub(crate) struct BundleProblem {
    /// Camera of all poses.
    pub camera: Pinhole,
    /// `t_cam_world` of each keyframe; the first `free_poses` are adjusted, the others are fixed.
    pub poses: Vec<Pose>,
    /// Number of poses that are adjusted.
    pub free_poses: usize,
    /// Landmarks in the world, m.
    pub points: Vec<Point3<f64>>,
    /// Observations, grouped by ascending `point`.
    pub observations: Vec<Observation>,
}

/// Result of a bundle adjustment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BundleSummary {
    /// Steps taken.
    pub iterations: usize,
    /// Robust cost at the start.
    pub initial_cost: f64,
    /// Robust cost at the end.
    pub final_cost: f64,
}

impl BundleProblem {
    /// Minimises the cost by at most `iterations` steps, with Huber loss if `robust`. Poses and points are updated in place.
    pub(crate) fn solve(&mut self, config: &BundleConfig, iterations: usize, robust: bool) -> BundleSummary {
        self.solve_while(config, iterations, robust, &|| true)
    }

    /// Minimises as [`BundleProblem::solve`], but stops when `should_continue`, called before each step, returns false.
    pub(crate) fn solve_while(
        &mut self,
        config: &BundleConfig,
        iterations: usize,
        robust: bool,
        should_continue: &dyn Fn() -> bool,
    ) -> BundleSummary {
        debug_assert!(self.observations.is_sorted_by_key(|o| o.point));
        let mut system = NormalEquations::new(self);
        let mut cost = self.cost(robust);
        let mut summary = BundleSummary { iterations: 0, initial_cost: cost, final_cost: cost };
        let mut lambda = config.initial_damping;
        let mut stale = true;
        for _ in 0..iterations {
            if !should_continue() {
                break;
            }
            if stale {
                system.linearise(self, robust);
                stale = false;
            }
            let Some(candidate) = system.step(self, lambda) else {
                lambda *= 10.0;
                continue;
            };
            let (poses, points) =
                (std::mem::replace(&mut self.poses, candidate.0), std::mem::replace(&mut self.points, candidate.1));
            let new_cost = self.cost(robust);
            summary.iterations += 1;
            // A comparison with NaN is false, so that a step to an invalid cost is rejected.
            if new_cost <= cost {
                let gain = cost - new_cost;
                cost = new_cost;
                lambda *= 0.2;
                stale = true;
                if gain < config.relative_tolerance * cost {
                    break;
                }
            } else {
                self.poses = poses;
                self.points = points;
                lambda *= 10.0;
            }
        }
        summary.final_cost = cost;
        summary
    }

    /// Returns the standard deviation of the position of the free camera relative to the fixed one, divided by their distance: the
    /// uncertainty of the direction of the baseline, rad, that follows from the noise of the measurements. The scale, which two views do
    /// not determine, is taken as known. Infinite unless the problem has two poses of which one is free.
    pub(crate) fn two_view_sigma(&self) -> f64 {
        let ([pose, fixed], 1) = (self.poses.as_slice(), self.free_poses) else { return f64::INFINITY };
        let mut system = NormalEquations::new(self);
        system.linearise(self, false);
        system.reduce(self, 0.0);
        let mut information: Matrix6<f64> = system.reduced.fixed_view::<6, 6>(0, 0).into();
        // The translation part of a left perturbation is the motion of the camera centre.
        let baseline = (pose * fixed.inverse()).translation.vector;
        let along = baseline.normalize();
        let mut block = information.fixed_view_mut::<3, 3>(0, 0);
        let known_scale = 1e3 * block.norm();
        block += along * along.transpose() * known_scale;
        let covariance = information.try_inverse().map(|inverse| inverse.fixed_view::<3, 3>(0, 0).trace());
        covariance.filter(|v| *v >= 0.0).map_or(f64::INFINITY, |variance| variance.sqrt() / baseline.norm())
    }

    /// Returns the point of observation `o` in the frame of its camera.
    fn point_in_camera(&self, o: &Observation) -> Vector3<f64> {
        (self.poses[o.pose] * self.points[o.point]).coords
    }

    /// Returns the sum of the losses. A point behind its camera costs its χ² limit.
    fn cost(&self, robust: bool) -> f64 {
        let mut sum = 0.0;
        for o in self.observations.iter().filter(|o| o.trust > 0.0) {
            let p = self.point_in_camera(o);
            let limit = o.measurement.chi2_limit();
            if p.z <= MIN_DEPTH_M {
                sum += o.trust * limit;
                continue;
            }
            let chi2 = o.measurement.chi2(&o.measurement.residual(&self.camera, &p));
            sum += o.trust * if robust { huber(chi2, limit).0 } else { chi2 };
        }
        sum
    }

    /// Sets the trust of observations to 0 if they fail the χ² test or lie behind their camera. Returns their number.
    pub(crate) fn drop_outliers(&mut self) -> usize {
        let mut dropped = 0;
        for i in 0..self.observations.len() {
            let o = self.observations[i];
            let p = self.point_in_camera(&o);
            let m = &o.measurement;
            if o.trust > 0.0 && (p.z <= MIN_DEPTH_M || m.chi2(&m.residual(&self.camera, &p)) > m.chi2_limit()) {
                self.observations[i].trust = 0.0;
                dropped += 1;
            }
        }
        dropped
    }
}

/// Least depth of a point with a usable projection, m.
const MIN_DEPTH_M: f64 = 1e-3;

/// Number of unknowns of the reduced system up to which it is solved as a dense system.
const DENSE_LIMIT: usize = 600;

/// Blocks of JᵀWJ and JᵀWr, and buffers for the reduced system.
struct NormalEquations {
    pose_blocks: Vec<Matrix6<f64>>,
    pose_rhs: Vec<Vector6<f64>>,
    point_blocks: Vec<Matrix3<f64>>,
    point_rhs: Vec<Vector3<f64>>,
    /// Block of pose and point of each observation.
    coupling: Vec<Matrix6x3>,
    /// Start of the observations of each point: those of point i are `point_start[i]..point_start[i + 1]`.
    point_start: Vec<usize>,
    reduced: DMatrix<f64>,
    reduced_rhs: DVector<f64>,
}

impl NormalEquations {
    fn new(problem: &BundleProblem) -> Self {
        let mut point_start = Vec::with_capacity(problem.points.len() + 1);
        let mut at = 0;
        for point in 0..problem.points.len() {
            point_start.push(at);
            while problem.observations.get(at).is_some_and(|o| o.point == point) {
                at += 1;
            }
        }
        point_start.push(at);
        let n = problem.free_poses;
        Self {
            pose_blocks: vec![Matrix6::zeros(); n],
            pose_rhs: vec![Vector6::zeros(); n],
            point_blocks: vec![Matrix3::zeros(); problem.points.len()],
            point_rhs: vec![Vector3::zeros(); problem.points.len()],
            coupling: vec![Matrix6x3::zeros(); problem.observations.len()],
            point_start,
            reduced: DMatrix::zeros(6 * n, 6 * n),
            reduced_rhs: DVector::zeros(6 * n),
        }
    }

    /// Computes all blocks at the current poses and points.
    fn linearise(&mut self, problem: &BundleProblem, robust: bool) {
        self.pose_blocks.fill(Matrix6::zeros());
        self.pose_rhs.fill(Vector6::zeros());
        let rotations: Vec<Matrix3<f64>> =
            problem.poses.iter().map(|p| *p.rotation.to_rotation_matrix().matrix()).collect();
        for point in 0..problem.points.len() {
            let mut h = Matrix3::zeros();
            let mut b = Vector3::zeros();
            for i in self.point_start[point]..self.point_start[point + 1] {
                let o = &problem.observations[i];
                self.coupling[i] = Matrix6x3::zeros();
                let rotation = &rotations[o.pose];
                let p = rotation * problem.points[point].coords + problem.poses[o.pose].translation.vector;
                if o.trust <= 0.0 || p.z <= MIN_DEPTH_M {
                    continue;
                }
                let m = &o.measurement;
                let r = m.residual(&problem.camera, &p);
                let weight = if robust { huber(m.chi2(&r), m.chi2_limit()).1 } else { 1.0 };
                let info = m.information() * (weight * o.trust);
                let j_cam = projection_jacobian(&problem.camera, &p);
                let j_point = j_cam * rotation;
                let weighted = Matrix3::from_diagonal(&info) * j_point;
                let info_r = info.component_mul(&r);
                h += j_point.transpose() * weighted;
                b += j_point.transpose() * info_r;
                if o.pose < problem.free_poses {
                    let mut j_pose = SMatrix::<f64, 3, 6>::zeros();
                    j_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&j_cam);
                    j_pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-j_cam * skew(&p)));
                    let jt = j_pose.transpose();
                    self.pose_blocks[o.pose] += jt * Matrix3::from_diagonal(&info) * j_pose;
                    self.pose_rhs[o.pose] += jt * info_r;
                    self.coupling[i] = jt * weighted;
                }
            }
            self.point_blocks[point] = h;
            self.point_rhs[point] = b;
        }
    }

    /// Solves the reduced system for the step of the poses; `None` if it is not positive definite. In a small window almost all poses share
    /// points, so that the system is dense; in a large one it is sparse.
    fn solve_reduced(&mut self) -> Option<DVector<f64>> {
        let size = self.reduced_rhs.len();
        if size == 0 {
            return Some(DVector::zeros(0));
        }
        if size <= DENSE_LIMIT {
            let reduced = std::mem::replace(&mut self.reduced, DMatrix::zeros(size, size));
            return Some(reduced.cholesky()?.solve(&self.reduced_rhs));
        }
        self.reduced.fill_upper_triangle_with_lower_triangle();
        let factor = CscCholesky::factor(&CscMatrix::from(&self.reduced)).ok()?;
        Some(factor.solve(&self.reduced_rhs).column(0).into_owned())
    }

    /// Eliminates the points from the damped system (Schur complement). Returns the inverses of their blocks.
    fn reduce(&mut self, problem: &BundleProblem, lambda: f64) -> Vec<Matrix3<f64>> {
        let n = problem.free_poses;
        self.reduced.fill(0.0);
        for (k, (h, b)) in self.pose_blocks.iter().zip(&self.pose_rhs).enumerate() {
            let mut h = *h;
            for i in 0..6 {
                h[(i, i)] += lambda * h[(i, i)].max(1e-6) + 1e-9;
            }
            self.reduced.fixed_view_mut::<6, 6>(6 * k, 6 * k).copy_from(&h);
            self.reduced_rhs.fixed_rows_mut::<6>(6 * k).copy_from(b);
        }
        let mut inverses = vec![Matrix3::zeros(); problem.points.len()];
        for (point, inverse) in inverses.iter_mut().enumerate() {
            let mut h = self.point_blocks[point];
            for i in 0..3 {
                h[(i, i)] += lambda * h[(i, i)] + 1e-9;
            }
            // A point that is not determined by its observations is not moved: its inverse stays zero.
            let Some(inverted) = h.try_inverse() else { continue };
            *inverse = inverted;
            let range = self.point_start[point]..self.point_start[point + 1];
            for i in range.clone() {
                let a = problem.observations[i].pose;
                if a >= n {
                    continue;
                }
                let y = self.coupling[i] * *inverse;
                let rhs = y * self.point_rhs[point];
                for row in 0..6 {
                    self.reduced_rhs[6 * a + row] -= rhs[row];
                }
                for j in range.clone() {
                    let c = problem.observations[j].pose;
                    // Only the lower triangle is read by the factorisation.
                    if c > a {
                        continue;
                    }
                    let mut block = self.reduced.fixed_view_mut::<6, 6>(6 * a, 6 * c);
                    block -= y * self.coupling[j].transpose();
                }
            }
        }
        inverses
    }

    /// Returns poses and points after a damped step; `None` if the system is not positive definite.
    fn step(&mut self, problem: &BundleProblem, lambda: f64) -> Option<(Vec<Pose>, Vec<Point3<f64>>)> {
        let n = problem.free_poses;
        let inverses = self.reduce(problem, lambda);
        let solution = self.solve_reduced()?;
        let mut poses = problem.poses.clone();
        for (k, pose) in poses.iter_mut().take(n).enumerate() {
            *pose = perturbed(&solution.fixed_rows::<6>(6 * k).into(), pose);
        }
        let mut points = problem.points.clone();
        for (point, position) in points.iter_mut().enumerate() {
            let mut b = self.point_rhs[point];
            for i in self.point_start[point]..self.point_start[point + 1] {
                let a = problem.observations[i].pose;
                if a < n {
                    b -= self.coupling[i].transpose() * solution.fixed_rows::<6>(6 * a);
                }
            }
            *position += inverses[point] * b;
        }
        Some((poses, points))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::se3_exp;

    /// Returns a problem with exact poses and points, and the same problem with perturbed ones.
    fn scene(noise: f64) -> (BundleProblem, BundleProblem) {
        let camera = Pinhole { fx: 520.0, fy: 520.0, cx: 320.0, cy: 240.0, bf: 40.0 };
        let poses: Vec<Pose> = (0..6)
            .map(|i| {
                se3_exp(&Vector6::new(0.1 * f64::from(i), 0.02 * f64::from(i), 0.0, 0.0, 0.03 * f64::from(i), 0.01))
            })
            .collect();
        let mut points = Vec::new();
        let mut observations = Vec::new();
        for i in 0..80 {
            let (a, b) = (f64::from(i % 10), f64::from(i / 10));
            points.push(Point3::new(0.2 * a - 1.0, 0.2 * b - 0.8, 2.0 + 0.1 * ((a * 3.0 + b * 7.0) % 11.0)));
            for (k, pose) in poses.iter().enumerate() {
                let p = pose * points[i as usize];
                let [u, v] = camera.project(&p.coords);
                observations.push(Observation {
                    pose: k,
                    point: i as usize,
                    measurement: Measurement {
                        u,
                        v,
                        disparity: camera.bf / p.z,
                        weight_px: 1.0,
                        weight_disparity: if i % 3 == 0 { 0.0 } else { 4.0 },
                    },
                    trust: 1.0,
                });
            }
        }
        // Poses 4 and 5 are fixed.
        let truth = BundleProblem { camera, poses, free_poses: 4, points, observations };
        let mut perturbed = truth.clone();
        for (k, pose) in perturbed.poses.iter_mut().take(4).enumerate() {
            let s = noise * if k % 2 == 0 { 1.0 } else { -1.0 };
            *pose = se3_exp(&Vector6::new(s, -s, 0.5 * s, 0.3 * s, s, -0.2 * s)) * *pose;
        }
        for (i, p) in perturbed.points.iter_mut().enumerate() {
            p.x += noise * ((i * 7 % 5) as f64 - 2.0);
            p.z += noise * ((i * 3 % 7) as f64 - 3.0);
        }
        (truth, perturbed)
    }

    #[test]
    fn bundle_adjustment_recovers_exact_poses_and_points() {
        let (truth, mut problem) = scene(0.02);
        let summary = problem.solve(&BundleConfig::default(), 30, true);
        assert!(summary.final_cost < 1e-9 * summary.initial_cost, "{summary:?}");
        for (a, b) in truth.poses.iter().zip(&problem.poses) {
            assert!((a.inverse() * b).translation.vector.norm() < 1e-6);
        }
        for (a, b) in truth.points.iter().zip(&problem.points) {
            assert!((a - b).norm() < 1e-5);
        }
    }

    #[test]
    fn gross_errors_are_removed_and_do_not_change_the_result() {
        let (truth, mut problem) = scene(0.005);
        for o in problem.observations.iter_mut().step_by(41) {
            o.measurement.u += 60.0;
        }
        let wrong = problem.observations.iter().step_by(41).count();
        problem.solve(&BundleConfig::default(), 10, true);
        assert_eq!(problem.drop_outliers(), wrong);
        problem.solve(&BundleConfig::default(), 20, true);
        for (a, b) in truth.poses.iter().zip(&problem.poses) {
            assert!((a.inverse() * b).translation.vector.norm() < 1e-6);
        }
    }

    #[test]
    fn the_sparse_solver_solves_the_reduced_system() {
        let poses = vec![Pose::identity(); DENSE_LIMIT / 6 + 1];
        let (camera, free_poses) = (scene(0.0).0.camera, poses.len());
        let mut system = NormalEquations::new(&BundleProblem {
            camera,
            poses,
            free_poses,
            points: Vec::new(),
            observations: Vec::new(),
        });
        let size = 6 * free_poses;
        let near = |i: usize, j: usize| i.abs_diff(j) < 20 || i.abs_diff(j) > size - 10;
        let full = DMatrix::from_fn(size, size, |i, j| match (i == j, near(i, j)) {
            (true, _) => 50.0 + (i % 7) as f64,
            (false, true) => 1.0 / (1.0 + (i * j % 11 + i + j) as f64),
            (false, false) => 0.0,
        });
        // Only the lower triangle is filled when points are eliminated.
        system.reduced = full.lower_triangle();
        system.reduced_rhs = DVector::from_fn(size, |i, _| (i % 13) as f64 - 6.0);
        let solution = system.solve_reduced().unwrap();
        assert!((full * solution - &system.reduced_rhs).amax() < 1e-9);
    }

    #[test]
    fn fixed_poses_are_not_changed() {
        let (_, mut problem) = scene(0.02);
        let before = problem.poses[4..].to_vec();
        problem.solve(&BundleConfig::default(), 10, true);
        assert_eq!(before, problem.poses[4..]);
    }
}
