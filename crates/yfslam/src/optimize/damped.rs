//! Levenberg-Marquardt for the few parameters of one pose (Madsen, Nielsen and Tingleff, Methods for non-linear least squares problems,
//! 2004, section 3.2).
//!
//! In: a first estimate, and what its normal equations are. Out: the estimate refined in place.

use nalgebra::{SMatrix, SVector};

use crate::config::PoseOptimizerConfig;

/// Damping beyond which no step is small enough to gain.
const MAX_DAMPING: f64 = 1e6;

/// Takes at most `config.iterations` steps from `estimate`. `linearise` gives the normal equations H, b and the cost there; `moved` is the
/// estimate after a step.
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
        // A comparison with NaN is false: a step into nonsense is never taken.
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
