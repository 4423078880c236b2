//! Non-linear least squares over poses and points.
//!
//! In: initial estimates and measurements. Out: refined estimates. [`residual`] is the reprojection residual of all problems;
//! [`pose_only`] refines one pose (motion-only bundle adjustment), [`schur`] poses and points together (bundle adjustment), [`large_bundle`] the
//! same for many poses, [`pose_graph`] poses with relative-pose constraints, [`similarity`] the alignment of two maps.

mod block_cholesky;
mod damped;
pub(crate) mod large_bundle;
pub(crate) mod pose_graph;
pub(crate) mod pose_only;
pub(crate) mod residual;
pub(crate) mod schur;
pub(crate) mod similarity;
