//! Non-linear least squares over poses and points.
//!
//! [`residual`] has the one residual everything shares, [`pose_only`] refines a single pose, [`schur`] adjusts a window of
//! poses and points together, [`pose_graph`] reconciles poses with motions measured between them, [`similarity`] aligns two maps.

mod damped;
pub(crate) mod pose_graph;
pub(crate) mod pose_only;
pub(crate) mod residual;
pub(crate) mod schur;
pub(crate) mod similarity;
