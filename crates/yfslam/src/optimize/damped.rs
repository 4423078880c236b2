//! The Levenberg–Marquardt method for problems with few parameters, such as one pose (Madsen, Nielsen and Tingleff, Methods for non-linear
//! least squares problems, 2004, section 3.2).
//!
//! In: an initial estimate, and a function that computes the normal equations. Out: the estimate, refined in place.

use nalgebra::{SMatrix, SVector};

use crate::config::PoseOptimizerConfig;

/// Damping above which the iteration ends: no step decreases the cost.
const MAX_DAMPING: f64 = 1e6;

/// Refines `estimate` by at most `config.iterations` steps. `linearise` returns the normal equations H, b and the cost at an estimate;
/// `moved` applies a step to an estimate.
pub(super) fn levenberg_marquardt<T, const N: usize>(
    config: &PoseOptimizerConfig,
    estimate: &mut T,
    linearise: impl Fn(&T) -> (SMatrix<f64, N, N>, SVector<f64, N>, f64),
    moved: impl Fn(&SVector<f64, N>, &T) -> T,
) {
    let mut lambda = config.initial_damping;
    let (mut h, mut b, mut cost) = linearise(estimate);
    for _ in 0..config.iterations {
        let mut damped = h;
        for i in 0..N {
            damped[(i, i)] += lambda * h[(i, i)].max(1e-9);
        }
        let Some(step) = damped.cholesky().map(|c| c.solve(&b)) else { return };
        let candidate = moved(&step, estimate);
        let (h_new, b_new, cost_new) = linearise(&candidate);
        // A comparison with NaN is false, so that a step to an invalid cost is rejected.
        if cost_new <= cost {
            let gain = cost - cost_new;
            *estimate = candidate;
            (h, b, cost) = (h_new, b_new, cost_new);
            lambda *= 0.2;
            if gain < config.relative_tolerance * cost {
                return;
            }
        } else {
            lambda *= 10.0;
            if lambda > MAX_DAMPING {
                return;
            }
        }
    }
}
