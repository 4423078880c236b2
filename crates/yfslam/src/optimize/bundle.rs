//! Bundle adjustment by Levenberg–Marquardt (Triggs et al., Bundle Adjustment: a Modern Synthesis, 2000).
//!
//! In: a problem. Out: refined poses and points, and which observations are outliers.

pub(crate) use super::bundle_problem::{BundleProblem, Observation};
use super::dense_equations::DenseEquations;
use super::normal_equations::NormalEquations;
use super::sparse_equations::SparseEquations;
use crate::config::BundleConfig;

/// Number of free poses up to which the equations are held as a dense matrix.
const DENSE_LIMIT: usize = 100;

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
    /// Adjusts for as long as `should_continue`, called before each step, returns true: some steps with Huber loss, removal of outliers, then
    /// more steps without it.
    pub(crate) fn adjust(&mut self, config: &BundleConfig, should_continue: &dyn Fn() -> bool) {
        if !should_continue() {
            return;
        }
        let mut equations = self.equations();
        for (iterations, robust) in [(config.first_iterations, true), (config.second_iterations, false)] {
            self.minimise(equations.as_mut(), config, iterations, robust, should_continue);
            self.drop_outliers();
        }
    }

    /// Minimises the cost by at most `iterations` steps, with Huber loss if `robust`. Poses and points are updated in place.
    pub(crate) fn solve(&mut self, config: &BundleConfig, iterations: usize, robust: bool) -> BundleSummary {
        let mut equations = self.equations();
        self.minimise(equations.as_mut(), config, iterations, robust, &|| true)
    }

    /// Returns equations in the form that suits the number of poses.
    fn equations(&self) -> Box<dyn NormalEquations> {
        debug_assert!(self.observations.is_sorted_by_key(|o| o.point));
        if self.free_poses <= DENSE_LIMIT {
            Box::new(DenseEquations::new(self))
        } else {
            Box::new(SparseEquations::new(self))
        }
    }

    /// Takes up to `iterations` steps by the given equations.
    fn minimise(
        &mut self,
        equations: &mut dyn NormalEquations,
        config: &BundleConfig,
        iterations: usize,
        robust: bool,
        should_continue: &dyn Fn() -> bool,
    ) -> BundleSummary {
        let mut cost = self.cost(robust);
        let mut summary = BundleSummary { iterations: 0, initial_cost: cost, final_cost: cost };
        let mut lambda = config.initial_damping;
        let mut stale = true;
        for _ in 0..iterations {
            if !should_continue() {
                break;
            }
            if stale {
                equations.linearise(self, robust);
                stale = false;
                // In a large problem this has taken a while.
                if !should_continue() {
                    break;
                }
            }
            let Some(candidate) = equations.step(self, lambda) else {
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
        let information = DenseEquations::new(self).information_of_first_pose(self);
        let Some(mut information) = information else { return f64::INFINITY };
        // The translation part of a left perturbation is the motion of the camera centre.
        let baseline = (pose * fixed.inverse()).translation.vector;
        let along = baseline.normalize();
        let mut block = information.fixed_view_mut::<3, 3>(0, 0);
        let known_scale = 1e3 * block.norm();
        block += along * along.transpose() * known_scale;
        let covariance = information.try_inverse().map(|inverse| inverse.fixed_view::<3, 3>(0, 0).trace());
        covariance.filter(|v| *v >= 0.0).map_or(f64::INFINITY, |variance| variance.sqrt() / baseline.norm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pinhole, Pose, se3_exp};
    use crate::optimize::residual::Measurement;
    use nalgebra::{Point3, Vector6};

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
    fn both_forms_of_the_equations_take_the_same_steps() {
        let (_, mut problem) = scene(0.01);
        // Some observations count less, and some not at all.
        for (i, o) in problem.observations.iter_mut().enumerate() {
            o.trust = [1.0, 0.5, 0.0][i % 7 % 3];
        }
        let mut other = problem.clone();
        let (mut dense, mut sparse) = (DenseEquations::new(&problem), SparseEquations::new(&problem));
        problem.minimise(&mut dense, &BundleConfig::default(), 3, true, &|| true);
        other.minimise(&mut sparse, &BundleConfig::default(), 3, true, &|| true);
        for (a, b) in problem.poses.iter().zip(&other.poses) {
            assert!((a.inverse() * b).translation.vector.norm() < 1e-9);
        }
        for (a, b) in problem.points.iter().zip(&other.points) {
            assert!((a - b).norm() < 1e-8);
        }
    }

    #[test]
    fn fixed_poses_are_not_changed() {
        let (_, mut problem) = scene(0.02);
        let before = problem.poses[4..].to_vec();
        problem.solve(&BundleConfig::default(), 10, true);
        assert_eq!(before, problem.poses[4..]);
    }
}
