//! Pose-graph optimisation over SE(3) (Kümmerle et al., g2o, ICRA 2011; Jacobians after Barfoot, State Estimation for Robotics, section
//! 7.1): a loop's error is spread over the poses between its ends.
//!
//! In: poses, and motions measured between pairs of them. Out: the poses that fit those best. The normal equations are sparse; they are
//! solved by sparse Cholesky in the order of the poses, which for a path with few loops fills in little.

use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};
use nalgebra_sparse::factorization::CscCholesky;
use nalgebra_sparse::{CooMatrix, CscMatrix};

use crate::config::PoseGraphConfig;
use crate::geometry::{Pose, perturbed, se3_log, skew};

/// A motion measured between two poses.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Index of pose a.
    pub a: usize,
    /// Index of pose b.
    pub b: usize,
    /// The motion `t_a_b`.
    pub t_a_b: Pose,
}

/// Poses and the motions between them.
#[derive(Clone, Debug, Default)]
pub struct PoseGraph {
    /// `t_a_world` of each pose; the first stays where it is.
    pub poses: Vec<Pose>,
    /// Motions measured.
    pub edges: Vec<Edge>,
}

impl PoseGraph {
    /// Minimises the squared errors of all edges by Levenberg-Marquardt; the poses are updated in place. Returns the cost before and after.
    pub fn solve(&mut self, config: &PoseGraphConfig) -> (f64, f64) {
        let initial = cost(&self.poses, &self.edges);
        let mut current = initial;
        let mut lambda = config.initial_damping;
        for _ in 0..config.iterations {
            let Some(candidate) = self.step(lambda) else {
                lambda *= 10.0;
                continue;
            };
            let new = cost(&candidate, &self.edges);
            // A comparison with NaN is false: a step into nonsense is never taken.
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

    /// The poses after one damped Gauss-Newton step; `None` if the equations cannot be solved.
    fn step(&self, lambda: f64) -> Option<Vec<Pose>> {
        let n = self.poses.len().checked_sub(1).filter(|n| *n > 0)?;
        let mut diagonal = vec![Matrix6::zeros(); n];
        let mut rhs = DMatrix::zeros(6 * n, 1);
        let mut system = CooMatrix::new(6 * n, 6 * n);
        for edge in &self.edges {
            let e = error(&self.poses, edge);
            let half = 0.5 * adjoint_algebra(&e);
            let j_a = (Matrix6::identity() - half) * adjoint(&edge.t_a_b.inverse());
            let j_b = -(Matrix6::identity() + half);
            for (pose, jacobian) in [(edge.a, j_a), (edge.b, j_b)] {
                if let Some(k) = pose.checked_sub(1) {
                    diagonal[k] += jacobian.transpose() * jacobian;
                    let mut rows = rhs.fixed_view_mut::<6, 1>(6 * k, 0);
                    rows -= jacobian.transpose() * e;
                }
            }
            if let (Some(a), Some(b)) = (edge.a.checked_sub(1), edge.b.checked_sub(1)) {
                let block = j_a.transpose() * j_b;
                system.push_matrix(6 * a, 6 * b, &block);
                system.push_matrix(6 * b, 6 * a, &block.transpose());
            }
        }
        for (k, block) in diagonal.iter_mut().enumerate() {
            for i in 0..6 {
                block[(i, i)] += lambda * block[(i, i)] + 1e-9;
            }
            system.push_matrix(6 * k, 6 * k, block);
        }
        let factor = CscCholesky::factor(&CscMatrix::from(&system)).ok()?;
        let solution = factor.solve(&rhs);
        let moved = self.poses[1..].iter().enumerate();
        let moved = moved.map(|(k, pose)| perturbed(&solution.fixed_view::<6, 1>(6 * k, 0).into(), pose));
        Some(std::iter::once(self.poses[0]).chain(moved).collect())
    }
}

/// What is left of a measured motion when that of the poses is taken off it, as a tangent vector.
fn error(poses: &[Pose], edge: &Edge) -> Vector6<f64> {
    se3_log(&(edge.t_a_b.inverse() * poses[edge.a] * poses[edge.b].inverse()))
}

fn cost(poses: &[Pose], edges: &[Edge]) -> f64 {
    edges.iter().map(|edge| error(poses, edge).norm_squared()).sum()
}

/// The adjoint of a motion: `exp(Ad(T) ξ) = T exp(ξ) T⁻¹`.
fn adjoint(pose: &Pose) -> Matrix6<f64> {
    let rotation = *pose.rotation.to_rotation_matrix().matrix();
    let mut ad = Matrix6::zeros();
    ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    ad.fixed_view_mut::<3, 3>(0, 3).copy_from(&(skew(&pose.translation.vector) * rotation));
    ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    ad
}

/// The adjoint of a tangent vector, the derivative of [`adjoint`].
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
    use crate::geometry::se3_exp;

    /// A walk around a square of four metres, twelve poses a side, looking ahead; and what an odometer with a bias makes of it.
    fn walk() -> (Vec<Pose>, PoseGraph) {
        let step = Pose::translation(0.0, 0.0, -4.0 / 12.0);
        let turn = se3_exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0));
        let bias = se3_exp(&Vector6::new(0.004, 0.001, 0.002, 0.001, 0.004, -0.002));
        let (mut truth, mut graph) = (vec![Pose::identity()], PoseGraph::default());
        graph.poses.push(Pose::identity());
        for i in 1..48 {
            let motion = if i % 12 == 0 { turn * step } else { step };
            truth.push(motion * truth[i - 1]);
            graph.poses.push(bias * motion * graph.poses[i - 1]);
            graph.edges.push(Edge { a: i, b: i - 1, t_a_b: bias * motion });
        }
        (truth, graph)
    }

    fn farthest(truth: &[Pose], poses: &[Pose]) -> f64 {
        let center = |pose: &Pose| pose.inverse().translation.vector;
        truth.iter().zip(poses).map(|(t, p)| (center(t) - center(p)).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn closing_a_loop_takes_most_of_the_drift_away() {
        let (truth, mut graph) = walk();
        let drift = farthest(&truth, &graph.poses);
        graph.edges.push(Edge { a: 47, b: 0, t_a_b: truth[47] * truth[0].inverse() });
        let (before, after) = graph.solve(&PoseGraphConfig::default());
        assert!(after < 0.1 * before, "{before} {after}");
        let left = farthest(&truth, &graph.poses);
        assert!(drift > 0.5 && left < 0.2 * drift, "{drift} m before, {left} m after");
    }

    #[test]
    fn edges_without_contradiction_are_met_exactly_from_a_far_start() {
        let (truth, mut graph) = walk();
        for edge in &mut graph.edges {
            edge.t_a_b = truth[edge.a] * truth[edge.b].inverse();
        }
        graph.edges.push(Edge { a: 47, b: 0, t_a_b: truth[47] * truth[0].inverse() });
        let (_, after) = graph.solve(&PoseGraphConfig { iterations: 50, ..Default::default() });
        assert!(after < 1e-16 && farthest(&truth, &graph.poses) < 1e-7, "{after}");
    }

    #[test]
    fn a_graph_of_one_pose_stays_as_it_is() {
        let mut graph = PoseGraph { poses: vec![Pose::identity()], edges: Vec::new() };
        assert_eq!(graph.solve(&PoseGraphConfig::default()), (0.0, 0.0));
        assert_eq!(graph.poses, [Pose::identity()]);
    }
}
