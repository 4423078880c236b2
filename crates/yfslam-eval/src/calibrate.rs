//! In: two trajectories, the reference of a body (a marker, an inertial sensor), the estimate of a camera on it. Out: lever arm, time
//! offset and scale between both, and the error that remains.
//!
//! Minimises Σ ‖r(tᵢ + δ) − (s R (eᵢ + Cᵢ l) + t)‖² over rotation R, translation t, scale s and lever arm l, where eᵢ and Cᵢ are position
//! and rotation of the camera, by Levenberg–Marquardt, and over the time offset δ by a search. The reference is interpolated. The result
//! has eleven parameters that the plain error does not have: it tells how good the estimate could be, and is not comparable with it.

use nalgebra::{Isometry3, SMatrix, SVector, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::{AlignmentKind, EvalError, Match, StampedPose, Statistics, align, associate};

/// Longest gap of the reference that is interpolated, s.
const MAX_GAP_S: f64 = 0.2;
/// Largest time offset that is searched, s, and the steps of the first search.
const MAX_OFFSET_S: f64 = 0.25;
const OFFSET_STEPS: i32 = 10;
/// Least matches for eleven parameters.
const MIN_MATCHES: usize = 20;
const ITERATIONS: usize = 30;

type Parameters = SVector<f64, 10>;

/// The fit of a body to a camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Position of the body of the reference in the camera frame, m.
    pub lever_arm_m: [f64; 3],
    /// Time that is added to the stamps of the estimate, s.
    pub time_offset_s: f64,
    /// Scale that is applied to the estimate.
    pub scale: f64,
    /// Standard deviations of lever arm (m, each axis) if the errors were independent; large where the camera hardly turned.
    pub lever_arm_sd_m: [f64; 3],
    /// Distances that remain, m.
    pub translation_m: Statistics,
}

/// One state of the fit at a time offset.
#[derive(Clone, Copy)]
struct Fit {
    rotation: UnitQuaternion<f64>,
    translation: Vector3<f64>,
    scale: f64,
    lever: Vector3<f64>,
    cost: f64,
    count: usize,
}

/// Fits lever arm, time offset and scale.
///
/// # Errors
/// Those of [`associate()`] and [`align`], or there are fewer than 20 matches.
pub fn calibrate(
    reference: &[StampedPose],
    estimate: &[StampedPose],
    max_diff_ns: u64,
) -> Result<Calibration, EvalError> {
    let matches = associate(reference, estimate, max_diff_ns)?;
    if matches.len() < MIN_MATCHES {
        return Err(EvalError::TooFewMatches { found: matches.len(), needed: MIN_MATCHES });
    }
    let first = align(&matches, AlignmentKind::Sim3)?;
    let start = Fit {
        rotation: first.rotation,
        translation: first.translation,
        scale: first.scale,
        lever: Vector3::zeros(),
        cost: f64::INFINITY,
        count: 0,
    };
    // Mean cost: the number of poses inside the reference changes with the offset.
    let at = |offset_s: f64| fit(&pairs(reference, &matches, offset_s), start);
    let mean = |fit: &Fit| if fit.count < MIN_MATCHES { f64::INFINITY } else { fit.cost / fit.count as f64 };
    let offsets = (-OFFSET_STEPS..=OFFSET_STEPS).map(|k| f64::from(k) * MAX_OFFSET_S / f64::from(OFFSET_STEPS));
    let best = offsets.min_by(|a, b| mean(&at(*a)).total_cmp(&mean(&at(*b)))).unwrap_or(0.0);
    let step = MAX_OFFSET_S / f64::from(OFFSET_STEPS);
    let offset_s = golden_section(best - step, best + step, |offset| mean(&at(offset)));
    let pairs = pairs(reference, &matches, offset_s);
    let fit = fit(&pairs, start);
    let errors: Vec<f64> = pairs.iter().map(|pair| residual(&fit, pair).norm()).collect();
    let few = EvalError::TooFewMatches { found: errors.len(), needed: MIN_MATCHES };
    let translation_m = Statistics::of(&errors).filter(|_| errors.len() >= MIN_MATCHES).ok_or(few)?;
    let variance = fit.cost / (3 * errors.len()).saturating_sub(11).max(1) as f64;
    let (hessian, _) = normal_equations(&fit, &pairs);
    let sd = hessian.try_inverse().map(|covariance| [7, 8, 9].map(|k| (variance * covariance[(k, k)]).max(0.0).sqrt()));
    Ok(Calibration {
        lever_arm_m: fit.lever.into(),
        time_offset_s: offset_s,
        scale: fit.scale,
        lever_arm_sd_m: sd.unwrap_or([f64::MAX; 3]),
        translation_m,
    })
}

/// A camera pose and the position of the body at its time.
type Pair = (Isometry3<f64>, Vector3<f64>);

/// Returns the estimated poses with the interpolated position of the reference.
fn pairs(reference: &[StampedPose], matches: &[Match], offset_s: f64) -> Vec<Pair> {
    let offset_ns = (offset_s * 1e9).round() as i64;
    let position = |timestamp_ns: i64| {
        let after = reference.partition_point(|pose| pose.timestamp_ns <= timestamp_ns);
        let (a, b) = (reference.get(after.checked_sub(1)?)?, reference.get(after)?);
        let gap_ns = b.timestamp_ns.saturating_sub(a.timestamp_ns);
        let share = timestamp_ns.saturating_sub(a.timestamp_ns) as f64 / gap_ns.max(1) as f64;
        let at = |pose: &StampedPose| pose.t_world_cam.translation.vector;
        (gap_ns as f64 <= MAX_GAP_S * 1e9).then(|| at(a) + share * (at(b) - at(a)))
    };
    let pair = |m: &Match| Some((m.estimate.t_world_cam, position(m.estimate.timestamp_ns.saturating_add(offset_ns))?));
    matches.iter().filter_map(pair).collect()
}

fn residual(fit: &Fit, (camera, body): &Pair) -> Vector3<f64> {
    let point = camera.translation.vector + camera.rotation * fit.lever;
    body - (fit.scale * (fit.rotation * point) + fit.translation)
}

fn cost(fit: &Fit, pairs: &[Pair]) -> f64 {
    pairs.iter().map(|pair| residual(fit, pair).norm_squared()).sum()
}

/// Returns JᵀJ and Jᵀr for the parameters rotation (3), translation (3), logarithm of the scale, lever arm (3).
fn normal_equations(fit: &Fit, pairs: &[Pair]) -> (SMatrix<f64, 10, 10>, Parameters) {
    let (mut hessian, mut gradient) = (SMatrix::<f64, 10, 10>::zeros(), Parameters::zeros());
    for pair in pairs {
        let (camera, _) = pair;
        let turned = fit.rotation * (camera.translation.vector + camera.rotation * fit.lever) * fit.scale;
        let mut jacobian = SMatrix::<f64, 3, 10>::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-turned.cross_matrix());
        jacobian.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        jacobian.fixed_view_mut::<3, 1>(0, 6).copy_from(&turned);
        let lever = (fit.rotation * camera.rotation).to_rotation_matrix().into_inner() * fit.scale;
        jacobian.fixed_view_mut::<3, 3>(0, 7).copy_from(&lever);
        hessian += jacobian.transpose() * jacobian;
        gradient += jacobian.transpose() * residual(fit, pair);
    }
    (hessian, gradient)
}

/// Fits everything but the time offset.
fn fit(pairs: &[Pair], start: Fit) -> Fit {
    let mut best = Fit { cost: cost(&start, pairs), count: pairs.len(), ..start };
    let mut damping = 1e-6;
    for _ in 0..ITERATIONS {
        let (mut hessian, gradient) = normal_equations(&best, pairs);
        for k in 0..10 {
            hessian[(k, k)] *= 1.0 + damping;
            hessian[(k, k)] += 1e-12;
        }
        let Some(step) = hessian.cholesky().map(|factor| factor.solve(&gradient)) else { break };
        let [a, b, c, x, y, z, log_scale, l, m, n] = step.data.0[0];
        let mut next = Fit {
            rotation: UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c)) * best.rotation,
            translation: best.translation + Vector3::new(x, y, z),
            scale: best.scale * log_scale.clamp(-1.0, 1.0).exp(),
            lever: best.lever + Vector3::new(l, m, n),
            ..best
        };
        next.cost = cost(&next, pairs);
        if next.cost < best.cost {
            let has_converged = best.cost - next.cost <= 1e-12 * best.cost;
            (best, damping) = (next, damping * 0.1);
            if has_converged {
                break;
            }
        } else {
            damping *= 100.0;
        }
    }
    best
}

/// Returns the minimum of a function between two values.
fn golden_section(mut low: f64, mut high: f64, value: impl Fn(f64) -> f64) -> f64 {
    let ratio = (5f64.sqrt() - 1.0) / 2.0;
    for _ in 0..24 {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        if value(a) < value(b) { high = b } else { low = a }
    }
    (low + high) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lever_arm_time_offset_and_scale_are_found() {
        let camera = |t: f64| {
            let position = Vector3::new((0.7 * t).sin(), 0.5 * (1.1 * t).cos(), 0.3 * (0.9 * t).sin());
            Isometry3::new(position, Vector3::new(0.5 * (0.8 * t).sin(), 0.6 * (0.6 * t).cos(), 0.4 * (1.3 * t).sin()))
        };
        let lever = Vector3::new(0.05, -0.12, 0.03);
        let world = Isometry3::new(Vector3::new(3.0, -1.0, 0.5), Vector3::new(0.3, 1.2, -0.4));
        let stamped = |t: f64, pose| StampedPose::new((t * 1e9).round() as i64, pose);
        let (scale, offset_s) = (1.03, 0.021);
        let estimate: Vec<StampedPose> = (0..200).map(|k| f64::from(k) / 10.0).map(|t| stamped(t, camera(t))).collect();
        let body = |t: f64| {
            let pose = camera(t);
            let point = pose.translation.vector + pose.rotation * lever;
            let turned = world.rotation * point * scale + world.translation.vector;
            stamped(t + offset_s, Isometry3::from_parts(turned.into(), world.rotation * pose.rotation))
        };
        let reference: Vec<StampedPose> = (0..1000).map(|k| body(f64::from(k) / 50.0)).collect();
        let found = calibrate(&reference, &estimate, 20_000_000).unwrap();
        assert!((Vector3::from(found.lever_arm_m) - lever).norm() < 1e-3, "{found:?}");
        assert!((found.time_offset_s - offset_s).abs() < 2e-4 && (found.scale - scale).abs() < 1e-3, "{found:?}");
        assert!(found.translation_m.rmse < 1e-3 && found.lever_arm_sd_m.iter().all(|sd| *sd < 1e-3), "{found:?}");
        assert!(calibrate(&reference, &estimate[..10], 20_000_000).is_err());
    }
}
