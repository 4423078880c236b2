//! Estimates the readout time of a rolling shutter from the camera's own motion, without ground truth.
//!
//! In: tracked frames with their velocities, each with the keyframe that shares most landmarks with it. Out: the readout time with its
//! standard deviation. For each pair of frame and keyframe the relative pose is refined together with the readout time, so that the error of
//! reprojection becomes least; a wrong readout time leaves an error that grows with the row and with the velocity. The sums over all pairs
//! give the estimate, the scatter over the keyframes its standard deviation.

use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector6};

use crate::context::Context;
use crate::geometry::{Pose, perturbed};
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::optimize::residual::{Measurement, huber, projection_jacobian};
use crate::tracking::tracked_frame::TrackedFrame;

/// Least number of points of a pair.
const MIN_POINTS: usize = 40;
/// Factor on the standard deviation that the scatter gives: on 30 runs in rendered worlds the errors were twice as large as the scatter said,
/// because the errors of velocities are common to neighbouring keyframes.
const SCATTER_FACTOR: f64 = 1.5;
/// Most keyframes of an estimate. Their memory is reserved, so that a frame allocates none.
const KEYFRAMES: usize = 256;
/// Points for which memory is reserved.
const POINTS: usize = 2048;
/// Steps of the refinement of each pair.
const STEPS: usize = 3;
/// Least time between a frame and its keyframe, ns: before, the errors of both are nearly the same and cancel.
const MIN_GAP_NS: u64 = 150_000_000;

/// Sums over the pairs with one keyframe: `information · readout = evidence`.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    information: f64,
    evidence: f64,
}

/// A readout time with its standard deviation, and on how much it rests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ReadoutEstimate {
    /// Time from the first to the last row, s.
    pub readout_s: f64,
    /// Standard deviation, s.
    pub sigma_s: f64,
    /// Number of keyframes with which frames were compared.
    pub keyframes: usize,
}

/// Collects what pairs of frames say about the readout time.
#[derive(Clone, Debug)]
pub(crate) struct ReadoutEstimator {
    /// For each keyframe in the order of time.
    keyframes: Vec<(KeyFrameId, Sums)>,
    points: Vec<PairPoint>,
}

/// A landmark that a frame and a keyframe observe.
#[derive(Clone, Copy, Debug)]
struct PairPoint {
    /// Position in the keyframe's camera frame at the time of its row, m.
    point: Vector3<f64>,
    /// Its velocity there, m for each unit of row time: the row as a share of the image, −½ to ½, times the motion of the point.
    row_motion: Vector3<f64>,
    /// Row in the frame, as a share of the image, −½ to ½.
    row: f64,
    /// Position in the frame, px.
    measurement: Measurement,
}

impl Default for ReadoutEstimator {
    fn default() -> Self {
        Self { keyframes: Vec::with_capacity(KEYFRAMES), points: Vec::with_capacity(POINTS) }
    }
}

impl ReadoutEstimator {
    /// Returns whether it has seen as many keyframes as it can: more would hardly change the estimate.
    pub(crate) fn is_full(&self) -> bool {
        self.keyframes.len() >= KEYFRAMES
    }

    /// Forgets all pairs.
    pub(crate) fn clear(&mut self) {
        self.keyframes.clear();
    }

    /// Adds a tracked frame whose velocity is known from its neighbours. Returns how its pose relative to the keyframe changes with the readout
    /// time: a perturbation, m and rad, for each second; `None` if the pair has too few points.
    pub(crate) fn add(
        &mut self,
        context: &Context,
        map: &Map,
        reference: KeyFrameId,
        frame: &TrackedFrame,
    ) -> Option<Vector6<f64>> {
        let TrackedFrame { timestamp_ns, features, matches, t_cam_world, .. } = frame;
        let keyframe = map.keyframe(reference).filter(|k| !self.is_full() && k.timestamp_ns != *timestamp_ns)?;
        let (of_frame, of_keyframe) = (features.velocity()?, keyframe.features.velocity()?);
        let sensor = &context.sensor;
        let share = |row: f32| f64::from(row) / (sensor.camera.height.max(2) - 1) as f64 - 0.5;
        self.points.clear();
        for (i, matched) in matches.iter().enumerate() {
            let Some(id) = matched.and_then(|m| m.landmark) else { continue };
            let Some(j) = map.landmark(id).and_then(|l| l.feature_in(reference)) else { continue };
            let (Some(seen), Some(known)) = (features.measured(i), keyframe.features.measured(j)) else { continue };
            let depth_m = known.depth_m.map(f64::from).or_else(|| depth_in(map, id, &keyframe.t_cam_world));
            let Some(depth_m) = depth_m else { continue };
            let point = known.ray(&sensor.pinhole) * depth_m;
            let feature = &features.features[i];
            let measurement = Measurement {
                u: f64::from(seen.u),
                v: f64::from(seen.v),
                weight_disparity: 0.0,
                ..sensor.measurement(feature)
            };
            let row_motion = motion_of(&point, of_keyframe) * share(known.row);
            self.points.push(PairPoint { point, row_motion, row: share(seen.row), measurement });
        }
        if self.points.len() < MIN_POINTS {
            return None;
        }
        let before = self.estimate().map_or(0.0, |estimate| estimate.readout_s);
        let mut t_frame_keyframe = t_cam_world * keyframe.t_cam_world.inverse();
        let (sums, pose_change) = refine(context, &self.points, &mut t_frame_keyframe, of_frame, before)?;
        if timestamp_ns.abs_diff(keyframe.timestamp_ns) < MIN_GAP_NS {
            return Some(pose_change);
        }
        match self.keyframes.last_mut().filter(|(id, _)| *id == reference) {
            Some((_, total)) => {
                total.information += sums.information;
                total.evidence += sums.evidence;
            }
            None => self.keyframes.push((reference, sums)),
        }
        Some(pose_change)
    }

    /// Returns the estimate so far; `None` with fewer than three keyframes or without any motion.
    pub(crate) fn estimate(&self) -> Option<ReadoutEstimate> {
        let information: f64 = self.keyframes.iter().map(|(_, s)| s.information).sum();
        let evidence: f64 = self.keyframes.iter().map(|(_, s)| s.evidence).sum();
        let keyframes = self.keyframes.len();
        if keyframes < 3 || information <= 0.0 {
            return None;
        }
        let readout_s = evidence / information;
        // Errors of one keyframe are common to all its pairs, so the scatter over keyframes counts, not that over pairs.
        let scatter: f64 = self.keyframes.iter().map(|(_, s)| (s.evidence - s.information * readout_s).powi(2)).sum();
        let sigma_s = SCATTER_FACTOR * (scatter * keyframes as f64 / (keyframes - 1) as f64).sqrt() / information;
        Some(ReadoutEstimate { readout_s, sigma_s, keyframes })
    }
}

/// Velocity of a point that is fixed in the world in the frame of a camera that moves, with the sign of
/// [`at_time_zero`](crate::features::rolling_shutter::at_time_zero): towards the place that it has at time 0.
fn motion_of(point: &Vector3<f64>, velocity: &Vector6<f64>) -> Vector3<f64> {
    velocity.fixed_rows::<3>(0) + velocity.fixed_rows::<3>(3).cross(point)
}

fn depth_in(map: &Map, id: LandmarkId, t_cam_world: &Pose) -> Option<f64> {
    map.landmark(id).map(|l| (t_cam_world * l.position).z).filter(|z| *z > 0.0)
}

/// Refines the relative pose of a pair and the readout time together. Returns what the pair says about the readout time, and how the pose
/// changes with it.
fn refine(
    context: &Context,
    points: &[PairPoint],
    t_frame_keyframe: &mut Pose,
    velocity: &Vector6<f64>,
    readout_s: f64,
) -> Option<(Sums, Vector6<f64>)> {
    let pinhole = &context.sensor.pinhole;
    let mut sums = None;
    for _ in 0..STEPS {
        let mut h = SMatrix::<f64, 7, 7>::zeros();
        let mut b = SVector::<f64, 7>::zeros();
        let rotation = t_frame_keyframe.rotation.to_rotation_matrix();
        for p in points {
            let at_zero = *t_frame_keyframe * nalgebra::Point3::from(p.point + p.row_motion * readout_s);
            let in_frame = motion_of(&at_zero.coords, velocity) * -p.row;
            let seen = at_zero.coords + in_frame * readout_s;
            if seen.z <= 1e-3 {
                continue;
            }
            let residual = p.measurement.residual(pinhole, &seen);
            let (_, weight) = huber(p.measurement.chi2(&residual), p.measurement.chi2_limit());
            let weight = weight * p.measurement.weight_px;
            let jacobian = projection_jacobian(pinhole, &seen);
            let by_readout = rotation * p.row_motion + in_frame;
            for k in 0..2 {
                let a = Vector3::new(jacobian[(k, 0)], jacobian[(k, 1)], jacobian[(k, 2)]);
                let c = at_zero.coords.cross(&a);
                let row = SVector::<f64, 7>::from([a.x, a.y, a.z, c.x, c.y, c.z, a.dot(&by_readout)]);
                h += row * row.transpose() * weight;
                b += row * (residual[k] * weight);
            }
        }
        let poses: Matrix6<f64> = h.fixed_view::<6, 6>(0, 0).into_owned();
        let cross: Vector6<f64> = h.fixed_view::<6, 1>(0, 6).into_owned();
        let solved = poses.cholesky()?;
        let pose_change = -solved.solve(&cross);
        let information = h[(6, 6)] + cross.dot(&pose_change);
        let gradient: Vector6<f64> = b.fixed_rows::<6>(0).into_owned();
        let reduced = b[6] - cross.dot(&solved.solve(&gradient));
        sums = Some((Sums { information, evidence: reduced + information * readout_s }, pose_change));
        // A pair alone says little about the readout time, so only the pose is refined with it.
        *t_frame_keyframe = perturbed(&solved.solve(&gradient), t_frame_keyframe);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::config::Config;
    use crate::geometry::se3_exp;

    /// Pairs of a camera with that readout time, seen without noise, each with other velocities.
    fn estimate_of(readout_s: f64, pairs: usize) -> ReadoutEstimate {
        let camera = Camera::pinhole(640, 480, 520.0, 520.0, 320.0, 240.0);
        let context = Context::new(&camera, &Config::default(), &[1.0]);
        let pinhole = context.sensor.pinhole;
        let mut estimator = ReadoutEstimator::default();
        let mut keys = slotmap::SlotMap::<KeyFrameId, ()>::with_key();
        for pair in 0..pairs {
            let phase = pair as f64;
            let velocity = |shift: f64| Vector6::from_fn(|i, _| ((i + 1) as f64 * phase + shift).sin());
            let (of_keyframe, of_frame) = (velocity(0.3), velocity(1.7));
            let motion = se3_exp(&(velocity(2.9) * 0.05));
            let points: Vec<PairPoint> = (0..80)
                .map(|i| {
                    let [u, v, z] =
                        [f64::from(i * 37 % 600) + 20.0, f64::from(i * 53 % 440) + 20.0, 1.0 + f64::from(i % 7) * 0.3];
                    let point = pinhole.unproject(u, v, z).coords;
                    let row_motion = motion_of(&point, &of_keyframe) * (v / 479.0 - 0.5);
                    let at_zero = (motion * nalgebra::Point3::from(point + row_motion * readout_s)).coords;
                    // The row in which the frame shows the point, by iteration.
                    let mut seen = at_zero;
                    for _ in 0..20 {
                        let row = pinhole.project(&seen)[1] / 479.0 - 0.5;
                        seen = at_zero - motion_of(&at_zero, &of_frame) * (row * readout_s);
                    }
                    let [u, v] = pinhole.project(&seen);
                    let measurement = Measurement { u, v, weight_px: 1.0, ..Measurement::default() };
                    PairPoint { point, row_motion, row: v / 479.0 - 0.5, measurement }
                })
                .collect();
            let (sums, _) = refine(&context, &points, &mut motion.to_owned(), &of_frame, 0.0).unwrap();
            // Near the truth, where no point is an outlier, the pose changes as it is said.
            let [mut exact, mut other] = [motion; 2];
            let (_, pose_change) = refine(&context, &points, &mut exact, &of_frame, readout_s).unwrap();
            refine(&context, &points, &mut other, &of_frame, readout_s + 1e-3).unwrap();
            let error = perturbed(&(pose_change * 1e-3), &exact) * other.inverse();
            let moved = other * exact.inverse();
            let is_predicted = |error: f64, whole: f64| error < 0.05 * whole + 1e-6;
            assert!(
                is_predicted(error.translation.vector.norm(), moved.translation.vector.norm()),
                "{error} of {moved}"
            );
            assert!(is_predicted(error.rotation.angle(), moved.rotation.angle()), "{error} of {moved}");
            estimator.keyframes.push((keys.insert(()), sums));
        }
        estimator.estimate().unwrap()
    }

    #[test]
    fn the_readout_time_of_exact_pairs_is_found() {
        for readout_s in [-0.03, 0.0, 0.015, 0.033] {
            let estimate = estimate_of(readout_s, 8);
            assert!((estimate.readout_s - readout_s).abs() < 5e-4, "{estimate:?} instead of {readout_s}");
            assert_eq!(estimate.keyframes, 8);
        }
    }

    #[test]
    fn two_keyframes_give_no_estimate() {
        let mut estimator = ReadoutEstimator::default();
        let mut keys = slotmap::SlotMap::<KeyFrameId, ()>::with_key();
        for _ in 0..2 {
            estimator.keyframes.push((keys.insert(()), Sums { information: 1.0, evidence: 0.02 }));
            assert_eq!(estimator.estimate(), None);
        }
    }
}
