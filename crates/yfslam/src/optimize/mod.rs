//! Non-linear least squares over poses and points.
//!
//! In: initial estimates and measurements. Out: refined estimates. [`residual`] is the reprojection residual of all problems;
//! [`pose_only`] refines one pose (motion-only bundle adjustment), [`bundle`] poses and points together (bundle adjustment), [`pose_graph`]
//! poses with relative-pose constraints, [`similarity`] the alignment of two maps.

mod block_cholesky;
pub(crate) mod bundle;
mod bundle_problem;
mod damped;
mod dense_equations;
mod normal_equations;
pub(crate) mod pose_graph;
pub(crate) mod pose_only;
pub(crate) mod residual;
pub(crate) mod similarity;
mod sparse_equations;
