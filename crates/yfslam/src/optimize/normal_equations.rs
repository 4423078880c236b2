//! The normal equations of bundle adjustment, as the iteration uses them; windows and large parts of the map hold them in different ways.

use nalgebra::Point3;

use super::bundle_problem::BundleProblem;
use crate::geometry::Pose;

/// Linearised cost of a problem.
pub(super) trait NormalEquations {
    /// Computes all blocks at the current poses and points, with the weights of Huber loss if `robust`.
    fn linearise(&mut self, problem: &BundleProblem, robust: bool);

    /// Returns poses and points after a step with damping `lambda`; `None` if the system is not positive definite.
    fn step(&mut self, problem: &BundleProblem, lambda: f64) -> Option<(Vec<Pose>, Vec<Point3<f64>>)>;
}
