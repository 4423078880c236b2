//! Motion-only bundle adjustment: the pose of one frame from landmarks that stay fixed (ORB-SLAM2, IEEE T-RO 2017, section III-B).
//!
//! In: an initial pose, landmarks and their measurements. Out: the refined pose, and which measurements are inliers.

use nalgebra::{Matrix6, Point3, Vector3, Vector6};

use crate::config::PoseOptimizerConfig;
use crate::geometry::{Pinhole, Pose, perturbed};
use crate::optimize::damped::levenberg_marquardt;
use crate::optimize::residual::{Measurement, huber, projection_jacobian};

/// Observation of a landmark in the frame whose pose is estimated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseObservation {
    /// Landmark in the world, m.
    pub point_world: Point3<f64>,
    /// Measured position and disparity.
    pub measurement: Measurement,
    /// Static probability, in [0, 1]; scales the information matrix.
    pub trust: f64,
    /// Whether the observation is an inlier; set by the optimiser.
    pub inlier: bool,
}

/// Refines `t_cam_world` in place and marks the inliers among `observations`; returns their number.
///
/// Each round uses the inliers of the round before. After `robust_rounds` the Huber loss is replaced by the squared loss, because the
/// gross errors have been removed.
pub(crate) fn optimize_pose(
    camera: &Pinhole,
    config: &PoseOptimizerConfig,
    t_cam_world: &mut Pose,
    observations: &mut [PoseObservation],
) -> usize {
    for o in observations.iter_mut() {
        o.inlier = true;
    }
    let mut inliers = observations.len();
    for round in 0..config.rounds {
        if inliers < 3 {
            break;
        }
        let robust = round < config.robust_rounds;
        levenberg_marquardt(config, t_cam_world, |pose| linearise(camera, robust, pose, observations), perturbed);
        inliers = classify(camera, t_cam_world, observations);
    }
    inliers
}

/// Returns the covariance of a left perturbation (translation m, rotation rad) of `t_cam_world` that follows from the noise of the
/// inliers; landmarks are taken as exact. `None` if the inliers do not determine all directions.
pub(crate) fn pose_covariance(
    camera: &Pinhole,
    t_cam_world: &Pose,
    observations: &[PoseObservation],
) -> Option<Matrix6<f64>> {
    let (h, ..) = linearise(camera, false, t_cam_world, observations);
    h.try_inverse().filter(|covariance| covariance.diagonal().iter().all(|variance| *variance >= 0.0))
}

/// Returns the standard deviation of the camera position at `t_cam_world`, m; infinite if the inliers do not determine it.
pub(crate) fn position_sigma_m(camera: &Pinhole, t_cam_world: &Pose, observations: &[PoseObservation]) -> f64 {
    let (h, ..) = linearise(camera, false, t_cam_world, observations);
    // The translation part of a left perturbation is the motion of the camera centre.
    let covariance = h.try_inverse().map(|inverse| inverse.fixed_view::<3, 3>(0, 0).trace());
    covariance.filter(|variance| *variance >= 0.0).map_or(f64::INFINITY, f64::sqrt)
}

/// Computes the normal equations H, b and the robust cost at `pose` from the inliers.
fn linearise(
    camera: &Pinhole,
    robust: bool,
    pose: &Pose,
    observations: &[PoseObservation],
) -> (Matrix6<f64>, Vector6<f64>, f64) {
    let rotation = pose.rotation.to_rotation_matrix();
    let translation = pose.translation.vector;
    // Only the upper triangle of H, row by row: its 21 sums stay in registers, while a Matrix6 would be kept in memory.
    let mut h = [0.0f64; 21];
    let mut b = [0.0f64; 6];
    let mut cost = 0.0;
    for o in observations.iter().filter(|o| o.inlier && o.trust > 0.0) {
        let p: Vector3<f64> = rotation * o.point_world.coords + translation;
        if p.z <= 1e-3 {
            cost += o.trust * o.measurement.chi2_limit();
            continue;
        }
        let r = o.measurement.residual(camera, &p);
        let chi2 = o.measurement.chi2(&r);
        let (loss, weight) = if robust { huber(chi2, o.measurement.chi2_limit()) } else { (chi2, 1.0) };
        cost += o.trust * loss;
        let j = projection_jacobian(camera, &p);
        let info = o.measurement.information() * (weight * o.trust);
        // d p / d(ρ, φ) = [I | −[p]×], so that each row a of J becomes (a, p × a).
        for k in 0..3 {
            let a = Vector3::new(j[(k, 0)], j[(k, 1)], j[(k, 2)]);
            let c = p.cross(&a);
            let row = [a.x, a.y, a.z, c.x, c.y, c.z];
            let w = info[k];
            let mut n = 0;
            for i in 0..6 {
                let wi = w * row[i];
                b[i] += wi * r[k];
                for &rj in &row[i..] {
                    h[n] += wi * rj;
                    n += 1;
                }
            }
        }
    }
    let mut full = Matrix6::zeros();
    let mut n = 0;
    for i in 0..6 {
        for j in i..6 {
            full[(i, j)] = h[n];
            full[(j, i)] = h[n];
            n += 1;
        }
    }
    (full, Vector6::from_row_slice(&b), cost)
}

/// Marks inliers by the χ² test at `pose` and returns their number.
fn classify(camera: &Pinhole, pose: &Pose, observations: &mut [PoseObservation]) -> usize {
    let rotation = pose.rotation.to_rotation_matrix();
    let translation = pose.translation.vector;
    let mut inliers = 0;
    for o in observations {
        let p = rotation * o.point_world.coords + translation;
        let m = &o.measurement;
        o.inlier = p.z > 1e-3 && m.chi2(&m.residual(camera, &p)) <= m.chi2_limit();
        inliers += usize::from(o.inlier);
    }
    inliers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::se3_exp;

    fn observations(camera: &Pinhole, truth: &Pose) -> Vec<PoseObservation> {
        let t_world_cam = truth.inverse();
        (0..60)
            .map(|i| {
                let (u, v) = (40.0 + 9.5 * f64::from(i), 30.0 + f64::from(i * 37 % 420));
                let z = 1.0 + 0.1 * f64::from(i * 13 % 30);
                PoseObservation {
                    point_world: t_world_cam * camera.unproject(u, v, z),
                    measurement: Measurement {
                        u,
                        v,
                        disparity: camera.bf / z,
                        weight_px: 1.0,
                        weight_disparity: if i % 4 == 0 { 0.0 } else { 1.0 },
                    },
                    trust: 1.0,
                    inlier: true,
                }
            })
            .collect()
    }

    #[test]
    fn the_pose_is_recovered_from_a_poor_initial_estimate_despite_outliers() {
        let camera = Pinhole { fx: 520.0, fy: 510.0, cx: 320.0, cy: 240.0, bf: 40.0 };
        let truth = se3_exp(&Vector6::new(0.3, -0.2, 0.1, 0.05, -0.4, 0.2));
        let mut observations = observations(&camera, &truth);
        for o in observations.iter_mut().step_by(6) {
            o.measurement.v += 70.0;
        }
        let mut pose = se3_exp(&Vector6::new(0.05, 0.04, -0.03, 0.03, -0.05, 0.02)) * truth;
        let inliers = optimize_pose(&camera, &PoseOptimizerConfig::default(), &mut pose, &mut observations);
        let error = pose * truth.inverse();
        assert!(error.translation.vector.norm() < 1e-6 && error.rotation.angle() < 1e-6, "{error}");
        assert_eq!(inliers, 50);
    }

    #[test]
    fn the_position_is_less_certain_with_far_and_with_few_points() {
        let camera = Pinhole { fx: 520.0, fy: 510.0, cx: 320.0, cy: 240.0, bf: 40.0 };
        let pose = Pose::translation(0.1, 0.0, 0.2);
        let near = observations(&camera, &pose);
        let sigma = |observations: &[PoseObservation]| position_sigma_m(&camera, &pose, observations);
        let far: Vec<_> = near
            .iter()
            .map(|o| {
                let p = pose * o.point_world;
                PoseObservation { point_world: pose.inverse() * Point3::from(p.coords * 4.0), ..*o }
            })
            .collect();
        assert!(sigma(&near) < 0.02 && sigma(&far) > 2.0 * sigma(&near), "{} {}", sigma(&near), sigma(&far));
        assert!(sigma(&near[..20]) > 1.5 * sigma(&near));
        assert!(sigma(&near[..1]) > 0.3 && sigma(&[]).is_infinite());
    }

    #[test]
    fn an_observation_with_trust_zero_does_not_change_the_pose() {
        let camera = Pinhole { fx: 520.0, fy: 510.0, cx: 320.0, cy: 240.0, bf: 40.0 };
        let truth = Pose::translation(0.1, 0.0, 0.2);
        let mut observations = observations(&camera, &truth);
        for o in observations.iter_mut().take(20) {
            o.measurement.u += 2.0;
            o.trust = 0.0;
        }
        let mut pose = truth;
        optimize_pose(&camera, &PoseOptimizerConfig::default(), &mut pose, &mut observations);
        assert!((pose * truth.inverse()).translation.vector.norm() < 1e-9);
    }
}
