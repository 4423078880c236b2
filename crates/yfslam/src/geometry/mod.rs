//! Rigid motions and the pinhole model in the form the optimisers need.

mod fundamental;
mod p3p;
mod pinhole;
mod se3;

pub use fundamental::{Pair, eight_point, epipolar_distance, fundamental_ransac};
pub use p3p::p3p;
pub use pinhole::Pinhole;
pub use se3::{perturbed, se3_exp, se3_log, skew};

/// A rigid motion; `t_a_b` maps points given in frame b into frame a.
pub type Pose = nalgebra::Isometry3<f64>;
