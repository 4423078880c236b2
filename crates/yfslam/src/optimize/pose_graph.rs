//! Pose-graph optimisation over SE(3) (Kümmerle et al., g2o, ICRA 2011; Jacobians after Barfoot, State Estimation for Robotics, section
//! 7.1), and over Sim(3) if the scale drifts too (Strasdat, Montiel and Davison, RSS 2010). It distributes the error of a loop over the
//! poses between its ends.
//!
//! In: poses, and relative poses measured between pairs of them. Out: the poses with the least squared error. The time of a step is about
//! proportional to the number of poses; see [`block_cholesky`](super::block_cholesky).

use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector6};

use super::block_cholesky::BlockSystem;
use crate::config::PoseGraphConfig;
use crate::geometry::{Similarity, Tangent, TangentMap, sim3_adjoint, sim3_perturbed, sim3_tangent, skew};

/// Number of parameters of a pose whose scale is known.
const RIGID: usize = 6;
/// Number of parameters of a pose whose scale is unknown.
const SCALED: usize = 7;

/// A relative pose measured between two poses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    /// Index of pose a.
    pub a: usize,
    /// Index of pose b.
    pub b: usize,
    /// Measured relative pose.
    pub s_a_b: Similarity,
}

/// Poses and the relative poses measured between them.
#[derive(Clone, Debug, Default)]
pub(crate) struct PoseGraph {
    /// `s_cam_world` of each pose; the first is fixed.
    pub poses: Vec<Similarity>,
    /// Measured relative poses.
    pub edges: Vec<Edge>,
}

impl PoseGraph {
    /// Minimises the squared errors of all edges by Levenberg–Marquardt and updates the poses in place. Unless `scale_drifts`, all scales
    /// must be 1 and are not changed. Returns the cost before and after.
    pub(crate) fn solve(&mut self, config: &PoseGraphConfig, scale_drifts: bool) -> (f64, f64) {
        if scale_drifts { self.solve_for::<SCALED>(config) } else { self.solve_for::<RIGID>(config) }
    }

    fn solve_for<const D: usize>(&mut self, config: &PoseGraphConfig) -> (f64, f64) {
        let initial = cost::<D>(&self.poses, &self.edges);
        let mut current = initial;
        let mut lambda = config.initial_damping;
        let free_poses = self.poses.len().saturating_sub(1);
        let pairs = self.edges.iter().filter_map(|edge| Some((edge.a.checked_sub(1)?, edge.b.checked_sub(1)?)));
        let mut system = BlockSystem::new(free_poses, pairs);
        for _ in 0..config.iterations {
            let Some(candidate) = self.step::<D>(&mut system, lambda) else {
                lambda *= 10.0;
                continue;
            };
            let new = cost::<D>(&candidate, &self.edges);
            // A comparison with NaN is false, so that a step to an invalid cost is rejected.
            if new <= current {
                let gain = current - new;
                self.poses = candidate;
                current = new;
                lambda *= 0.2;
                if gain <= config.relative_tolerance * current {
                    break;
                }
            } else {
                lambda *= 10.0;
            }
        }
        (initial, current)
    }

    /// Returns the poses after one damped Gauss–Newton step in the first `D` parameters of each; `None` if the system is singular.
    fn step<const D: usize>(&self, system: &mut BlockSystem<D>, lambda: f64) -> Option<Vec<Similarity>> {
        let n = self.poses.len().checked_sub(1).filter(|n| *n > 0)?;
        let mut diagonal = vec![SMatrix::<f64, D, D>::zeros(); n];
        let mut solution = vec![SVector::<f64, D>::zeros(); n];
        system.clear();
        for edge in &self.edges {
            let e = residual(&self.poses, edge);
            let (left, right) = derivatives(&e);
            let j_a = leading_block::<D>(&left) * leading_block::<D>(&sim3_adjoint(&edge.s_a_b.inverse()));
            let j_b = -leading_block::<D>(&right);
            let e = tangent::<D>(&e);
            for (pose, jacobian) in [(edge.a, j_a), (edge.b, j_b)] {
                if let Some(k) = pose.checked_sub(1) {
                    diagonal[k] += jacobian.transpose() * jacobian;
                    solution[k] -= jacobian.transpose() * e;
                }
            }
            if let (Some(a), Some(b)) = (edge.a.checked_sub(1), edge.b.checked_sub(1)) {
                system.add(a, b, &(j_a.transpose() * j_b));
            }
        }
        for (k, block) in diagonal.iter_mut().enumerate() {
            for i in 0..D {
                block[(i, i)] += lambda * block[(i, i)] + 1e-9;
            }
            system.add(k, k, block);
        }
        if !system.factorise() {
            return None;
        }
        system.solve(&mut solution);
        let moved = self.poses[1..].iter().zip(&solution).map(|(pose, step)| {
            let mut xi = Tangent::zeros();
            xi.fixed_rows_mut::<D>(0).copy_from(step);
            sim3_perturbed(&xi, pose)
        });
        Some(std::iter::once(self.poses[0]).chain(moved).collect())
    }
}

/// Returns the difference between the measured relative pose and that of the current poses.
fn residual(poses: &[Similarity], edge: &Edge) -> Similarity {
    edge.s_a_b.inverse() * poses[edge.a] * poses[edge.b].inverse()
}

fn cost<const D: usize>(poses: &[Similarity], edges: &[Edge]) -> f64 {
    edges.iter().map(|edge| tangent::<D>(&residual(poses, edge)).norm_squared()).sum()
}

/// Returns the first `D` tangent coordinates of a similarity.
fn tangent<const D: usize>(s: &Similarity) -> SVector<f64, D> {
    sim3_tangent(s).fixed_rows::<D>(0).into_owned()
}

/// Returns the block of a linear map that belongs to the first `D` parameters.
fn leading_block<const D: usize>(map: &TangentMap) -> SMatrix<f64, D, D> {
    map.fixed_view::<D, D>(0, 0).into_owned()
}

/// Returns the derivatives of the tangent coordinates of `e` with respect to a left and a right perturbation. They are exact in the scale
/// of `e`, and of first order in its rotation and translation.
fn derivatives(e: &Similarity) -> (TangentMap, TangentMap) {
    let half = 0.5 * adjoint_algebra(&tangent::<RIGID>(e));
    let (mut left, mut right) = (TangentMap::identity(), TangentMap::identity());
    let rigid_left = Matrix6::identity() - half;
    left.fixed_view_mut::<6, 6>(0, 0).copy_from(&rigid_left);
    // A left perturbation of the scale scales the translation, too.
    let stretch = rigid_left.fixed_columns::<3>(0) * e.isometry.translation.vector;
    left.fixed_view_mut::<6, 1>(0, 6).copy_from(&stretch);
    right.fixed_view_mut::<6, 6>(0, 0).copy_from(&(Matrix6::identity() + half));
    // A right perturbation of the translation is scaled by `e`.
    right.fixed_columns_mut::<3>(0).scale_mut(e.scaling());
    (left, right)
}

/// Returns the adjoint of a tangent vector of SE(3): the derivative of the adjoint of a motion.
fn adjoint_algebra(xi: &Vector6<f64>) -> Matrix6<f64> {
    let rho = skew(&Vector3::new(xi[0], xi[1], xi[2]));
    let phi = skew(&Vector3::new(xi[3], xi[4], xi[5]));
    let mut ad = Matrix6::zeros();
    ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&phi);
    ad.fixed_view_mut::<3, 3>(0, 3).copy_from(&rho);
    ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&phi);
    ad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose, se3_exp, sim3_from_tangent, unscaled};

    /// Returns a path around a square of four metres with twelve poses on each side, and its odometry with a bias.
    fn square_path(bias: &Similarity) -> (Vec<Similarity>, PoseGraph) {
        let step = Pose::translation(0.0, 0.0, -4.0 / 12.0);
        let turn = se3_exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0));
        let (mut truth, mut graph) = (vec![Similarity::identity()], PoseGraph::default());
        graph.poses.push(Similarity::identity());
        for i in 1..48 {
            let motion = unscaled(&if i % 12 == 0 { turn * step } else { step });
            truth.push(motion * truth[i - 1]);
            graph.poses.push(bias * motion * graph.poses[i - 1]);
            graph.edges.push(Edge { a: i, b: i - 1, s_a_b: bias * motion });
        }
        (truth, graph)
    }

    /// Returns a bias of the motion alone, and one that also increases the scale with each pose.
    fn biases() -> [(Similarity, bool); 2] {
        let rigid = se3_exp(&Vector6::new(0.004, 0.001, 0.002, 0.001, 0.004, -0.002));
        let scale = Similarity::from_scaling(1.01);
        [(unscaled(&rigid), false), (scale * rigid, true)]
    }

    /// Returns the largest distance between true and estimated camera centres.
    fn largest_error(truth: &[Similarity], poses: &[Similarity]) -> f64 {
        let center = |pose: &Similarity| pose.inverse().isometry.translation.vector;
        truth.iter().zip(poses).map(|(t, p)| (center(t) - center(p)).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn closing_a_loop_removes_most_of_the_drift() {
        for (bias, scale_drifts) in biases() {
            let (truth, mut graph) = square_path(&bias);
            let drift = largest_error(&truth, &graph.poses);
            graph.edges.push(Edge { a: 47, b: 0, s_a_b: truth[47] * truth[0].inverse() });
            let (before, after) = graph.solve(&PoseGraphConfig::default(), scale_drifts);
            assert!(after < 0.1 * before, "{before} {after}");
            let remaining = largest_error(&truth, &graph.poses);
            assert!(drift > 0.5 && remaining < 0.2 * drift, "{drift} m before, {remaining} m after");
            if !scale_drifts {
                assert!(graph.poses.iter().all(|pose| pose.scaling() == 1.0));
            }
        }
    }

    #[test]
    fn consistent_edges_are_fulfilled_from_a_poor_initial_estimate() {
        for (bias, scale_drifts) in biases() {
            let (truth, mut graph) = square_path(&bias);
            for edge in &mut graph.edges {
                edge.s_a_b = truth[edge.a] * truth[edge.b].inverse();
            }
            graph.edges.push(Edge { a: 47, b: 0, s_a_b: truth[47] * truth[0].inverse() });
            let (_, after) = graph.solve(&PoseGraphConfig { iterations: 50, ..Default::default() }, scale_drifts);
            assert!(after < 1e-16 && largest_error(&truth, &graph.poses) < 1e-7, "{after}");
        }
    }

    #[test]
    fn derivatives_match_central_differences() {
        let e = sim3_from_tangent(&Tangent::from([0.02, -0.01, 0.03, 0.01, 0.02, -0.015, 0.4]));
        let (left, right) = derivatives(&e);
        for axis in 0..SCALED {
            let mut xi = Tangent::zeros();
            xi[axis] = 1e-5;
            let numeric = |f: &dyn Fn(&Tangent) -> Similarity| (sim3_tangent(&f(&xi)) - sim3_tangent(&f(&-xi))) / 2e-5;
            let by_left = numeric(&|xi| sim3_from_tangent(xi) * e);
            let by_right = numeric(&|xi| e * sim3_from_tangent(xi));
            // The neglected second order is about 1e-3 for a rotation of 0.03.
            assert!((by_left - left.column(axis)).norm() < 1e-3, "axis {axis}: {by_left}");
            assert!((by_right - right.column(axis)).norm() < 1e-3, "axis {axis}: {by_right}");
        }
    }

    #[test]
    fn a_graph_of_one_pose_is_not_changed() {
        let mut graph = PoseGraph { poses: vec![Similarity::identity()], edges: Vec::new() };
        assert_eq!(graph.solve(&PoseGraphConfig::default(), false), (0.0, 0.0));
        assert_eq!(graph.poses, [Similarity::identity()]);
    }
}
