//! In: matched poses. Out: the constant rotations between true and estimated orientations, which are not errors.
//!
//! There are two: between the world frames, and between the camera and the body whose pose the ground truth holds. The ground truth of Bonn,
//! for example, holds a frame of the motion capture system, which is rotated by half a turn relative to the camera.

use nalgebra::{Isometry3, Matrix3, Matrix4, Quaternion, SymmetricEigen, UnitQuaternion};

use crate::content::Report;
use yfslam_eval::{Match, StampedPose, associate, horn_matrix};

/// The rotation of the body is used if it makes the angles this many times smaller.
const LEAST_GAIN: f64 = 3.0;

/// Rotation of the camera relative to the body of the ground truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyRotation {
    body_from_camera: UnitQuaternion<f64>,
}

impl BodyRotation {
    /// Estimates the rotation from the most accurate method; the identity without ground truth, or if it does not explain most of the angles.
    pub fn of(report: &Report) -> Self {
        let rmse = |m: &&crate::content::MethodReport| m.evaluation.map_or(f64::INFINITY, |e| e.ate.translation_m.rmse);
        let best = report.methods.iter().min_by(|a, b| rmse(a).total_cmp(&rmse(b)));
        let matches = match (report.truth, best.and_then(|best| Some((best, best.evaluation?)))) {
            (Some(truth), Some((best, evaluation))) => associate(truth, best.trajectory, evaluation.max_diff_ns),
            _ => return Self::none(),
        };
        Self::of_matches(&matches.unwrap_or_default())
    }

    fn of_matches(matches: &[Match]) -> Self {
        let none = Self::none();
        let Some(middle) = matches.get(matches.len() / 2) else { return none };
        // Rotations since the middle pose, as vectors: those of the camera are the rotated ones of the body (Park and Martin 1994).
        let correlation: Matrix3<f64> = matches
            .iter()
            .map(|m| {
                let since = |pose: &StampedPose, from: &StampedPose| {
                    (from.t_world_cam.rotation.inverse() * pose.t_world_cam.rotation).scaled_axis()
                };
                since(&m.estimate, &middle.estimate) * since(&m.reference, &middle.reference).transpose()
            })
            .sum();
        let found = Self { body_from_camera: largest_eigenvector(horn_matrix(&correlation), from_wxyz) };
        if found.mean_angle(matches) * LEAST_GAIN < none.mean_angle(matches) { found } else { none }
    }

    fn none() -> Self {
        Self { body_from_camera: UnitQuaternion::identity() }
    }

    /// Returns the true pose of the camera.
    pub fn camera(&self, body: &StampedPose) -> StampedPose {
        let pose = body.t_world_cam;
        let rotation = pose.rotation * self.body_from_camera;
        StampedPose::new(body.timestamp_ns, Isometry3::from_parts(pose.translation, rotation))
    }

    /// Returns the angle in degrees, if the rotation is not the identity.
    pub fn angle_deg(&self) -> Option<f64> {
        (*self != Self::none()).then(|| self.body_from_camera.angle().to_degrees())
    }

    /// Returns the mean angle between true and estimated orientations after alignment.
    fn mean_angle(&self, matches: &[Match]) -> f64 {
        let turned: Vec<Match> = matches.iter().map(|m| Match { reference: self.camera(&m.reference), ..*m }).collect();
        let turn = mean_rotation(&turned);
        let angle = |m: &Match| m.reference.t_world_cam.rotation.angle_to(&(turn * m.estimate.t_world_cam.rotation));
        turned.iter().map(angle).sum::<f64>() / turned.len().max(1) as f64
    }
}

/// Returns the rotation of the world of the estimate that brings its orientations closest to the true ones in the least squares sense: the
/// mean of the rotations between them (Markley et al., "Averaging quaternions", 2007, equation 13).
pub fn mean_rotation(matches: &[Match]) -> UnitQuaternion<f64> {
    let between = matches.iter().map(|m| m.reference.t_world_cam.rotation * m.estimate.t_world_cam.rotation.inverse());
    let sum: Matrix4<f64> = between.map(|q| q.coords * q.coords.transpose()).sum();
    largest_eigenvector(sum, Quaternion::from)
}

fn from_wxyz([w, x, y, z]: [f64; 4]) -> Quaternion<f64> {
    Quaternion::new(w, x, y, z)
}

fn largest_eigenvector(matrix: Matrix4<f64>, read: fn([f64; 4]) -> Quaternion<f64>) -> UnitQuaternion<f64> {
    let eigen = SymmetricEigen::new(matrix);
    UnitQuaternion::from_quaternion(read(eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned().into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn the_rotation_between_two_worlds_follows_from_orientations() {
        let turn = UnitQuaternion::new(Vector3::new(0.3, -1.2, 0.5));
        let matched = |i: i64| {
            let truth = Isometry3::rotation(Vector3::new(0.1, 0.02 * i as f64, 0.0));
            let estimate = Isometry3::from_parts(nalgebra::Translation3::identity(), turn.inverse() * truth.rotation);
            Match { reference: StampedPose::new(i, truth), estimate: StampedPose::new(i, estimate) }
        };
        let matches: Vec<Match> = (0..30).map(matched).collect();
        assert!(mean_rotation(&matches).angle_to(&turn) < 1e-9);
        assert!(mean_rotation(&[]).angle().is_finite());
    }

    #[test]
    fn the_rotation_of_the_body_is_estimated_and_removed() {
        let rotation = UnitQuaternion::new(Vector3::new(0.0, 2.2, 2.2));
        let matched = |i: i64| {
            let t = i as f64 / 10.0;
            let camera = Isometry3::rotation(Vector3::new(0.4 * t.sin(), 0.3 * t.cos(), 0.1 * t));
            let body = Isometry3::from_parts(camera.translation, camera.rotation * rotation.inverse());
            Match { reference: StampedPose::new(i, body), estimate: StampedPose::new(i, camera) }
        };
        let matches: Vec<Match> = (0..90).map(matched).collect();
        let found = BodyRotation::of_matches(&matches);
        assert!(found.body_from_camera.angle_to(&rotation) < 1e-6 && found.angle_deg().is_some());
        assert!(found.mean_angle(&matches) < 1e-6);
        let same: Vec<Match> = matches.iter().map(|m| Match { reference: m.estimate, ..*m }).collect();
        assert_eq!(BodyRotation::of_matches(&same).angle_deg(), None);
        assert_eq!(BodyRotation::of_matches(&[]).angle_deg(), None);
    }
}
