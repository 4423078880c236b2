//! Rigid motions, similarities, the pinhole model, and poses from two views or three points.

mod chi2;
mod essential;
mod fundamental;
mod homography;
mod p3p;
mod pinhole;
mod se3;
mod sim3;
mod triangulate;
mod two_view;

pub(crate) use chi2::{CHI2_LINE, CHI2_PIXEL, CHI2_PIXEL_DEPTH};
pub(crate) use essential::motions_of_essential;
pub(crate) use fundamental::{Pair, epipolar_distance, fundamental_ransac};
pub(crate) use p3p::p3p;
pub(crate) use pinhole::Pinhole;
pub(crate) use se3::{perturbed, se3_exp, se3_log, skew};
#[cfg(test)]
pub(crate) use sim3::sim3_from_tangent;
pub(crate) use sim3::{
    Similarity, Tangent, TangentMap, absolute_orientation, rigid, sim3_adjoint, sim3_perturbed, sim3_tangent, unscaled,
    with_scale,
};
pub(crate) use triangulate::midpoint;
pub(crate) use two_view::{TwoView, reconstruct};

/// A rigid motion; `t_a_b` maps points of frame b into frame a.
pub type Pose = nalgebra::Isometry3<f64>;
