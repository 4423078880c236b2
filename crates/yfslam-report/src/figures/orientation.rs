//! In: matched poses. Out: the constant turns that lie between true and estimated orientations and are no errors.
//!
//! Two of them: between the worlds, and between the camera and whatever was followed to get the truth. Bonn's ground truth, for one, follows
//! a frame of the motion capture system, turned by half a turn against the camera's.

use nalgebra::{Isometry3, Matrix3, Matrix4, Quaternion, SymmetricEigen, UnitQuaternion};

use crate::content::Report;
use yfslam_eval::{Match, StampedPose, associate, horn_matrix};

/// A turn of the followed frame is believed if it makes angles this many times smaller.
const BELIEVED_FROM: f64 = 3.0;

/// How the frame that the truth follows is turned against the camera's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    followed_from_camera: UnitQuaternion<f64>,
}

impl Mount {
    /// As the most accurate method sees it; none without truth, or unless it explains most of the angles.
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
        // Turns since the middle, as vectors: those of the camera are those of the followed frame, turned (Park and Martin 1994).
        let correlation: Matrix3<f64> = matches
            .iter()
            .map(|m| {
                let since = |pose: &StampedPose, from: &StampedPose| {
                    (from.t_world_cam.rotation.inverse() * pose.t_world_cam.rotation).scaled_axis()
                };
                since(&m.estimate, &middle.estimate) * since(&m.reference, &middle.reference).transpose()
            })
            .sum();
        let found = Self { followed_from_camera: largest_eigenvector(horn_matrix(&correlation), from_wxyz) };
        if found.mean_angle(matches) * BELIEVED_FROM < none.mean_angle(matches) { found } else { none }
    }

    fn none() -> Self {
        Self { followed_from_camera: UnitQuaternion::identity() }
    }

    /// The true pose of the camera.
    pub fn camera(&self, followed: &StampedPose) -> StampedPose {
        let pose = followed.t_world_cam;
        let rotation = pose.rotation * self.followed_from_camera;
        StampedPose::new(followed.timestamp_ns, Isometry3::from_parts(pose.translation, rotation))
    }

    /// Its size in degrees, if there is one.
    pub fn angle_deg(&self) -> Option<f64> {
        (*self != Self::none()).then(|| self.followed_from_camera.angle().to_degrees())
    }

    /// Mean angle between true and estimated orientations after alignment.
    fn mean_angle(&self, matches: &[Match]) -> f64 {
        let turned: Vec<Match> = matches.iter().map(|m| Match { reference: self.camera(&m.reference), ..*m }).collect();
        let turn = mean_turn(&turned);
        let angle = |m: &Match| m.reference.t_world_cam.rotation.angle_to(&(turn * m.estimate.t_world_cam.rotation));
        turned.iter().map(angle).sum::<f64>() / turned.len().max(1) as f64
    }
}

/// The rotation of the estimate's world that brings its orientations closest to the true ones, in the least squares sense of their
/// matrices: the mean of the rotations between them (Markley et al., "Averaging quaternions", 2007, equation 13).
pub fn mean_turn(matches: &[Match]) -> UnitQuaternion<f64> {
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
    fn the_turn_between_two_worlds_is_found_from_orientations_alone() {
        let turn = UnitQuaternion::new(Vector3::new(0.3, -1.2, 0.5));
        let matched = |i: i64| {
            let truth = Isometry3::rotation(Vector3::new(0.1, 0.02 * i as f64, 0.0));
            let estimate = Isometry3::from_parts(nalgebra::Translation3::identity(), turn.inverse() * truth.rotation);
            Match { reference: StampedPose::new(i, truth), estimate: StampedPose::new(i, estimate) }
        };
        let matches: Vec<Match> = (0..30).map(matched).collect();
        assert!(mean_turn(&matches).angle_to(&turn) < 1e-9);
        assert!(mean_turn(&[]).angle().is_finite());
    }

    #[test]
    fn the_turn_of_the_followed_frame_is_found_and_taken_out() {
        let mount = UnitQuaternion::new(Vector3::new(0.0, 2.2, 2.2));
        let matched = |i: i64| {
            let t = i as f64 / 10.0;
            let camera = Isometry3::rotation(Vector3::new(0.4 * t.sin(), 0.3 * t.cos(), 0.1 * t));
            let followed = Isometry3::from_parts(camera.translation, camera.rotation * mount.inverse());
            Match { reference: StampedPose::new(i, followed), estimate: StampedPose::new(i, camera) }
        };
        let matches: Vec<Match> = (0..90).map(matched).collect();
        let found = Mount::of_matches(&matches);
        assert!(found.followed_from_camera.angle_to(&mount) < 1e-6 && found.angle_deg().is_some());
        assert!(found.mean_angle(&matches) < 1e-6);
        let same: Vec<Match> = matches.iter().map(|m| Match { reference: m.estimate, ..*m }).collect();
        assert_eq!(Mount::of_matches(&same).angle_deg(), None);
        assert_eq!(Mount::of_matches(&[]).angle_deg(), None);
    }
}
