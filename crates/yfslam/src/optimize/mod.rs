//! Non-linear least squares over poses and points.
//!
//! [`residual`] has the one residual everything shares, [`pose_only`] refines a single pose, [`schur`] adjusts a window of
//! poses and points together, [`pose_graph`] reconciles poses with motions measured between them, [`similarity`] aligns two maps.

mod damped;
pub mod pose_graph;
pub mod pose_only;
pub mod residual;
pub mod schur;
pub mod similarity;
