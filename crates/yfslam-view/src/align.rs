//! Errors of a trajectory while it grows, where the ground truth is known. Nothing of it reaches the system.

use nalgebra::Matrix4;
use yfslam_eval::{AlignmentKind, StampedPose, align, associate};

/// The ground truth, and how a trajectory is compared with it.
pub struct Truth {
    /// World from camera, sorted by time; empty if it is not known.
    pub poses: Vec<StampedPose>,
    pub alignment: AlignmentKind,
    pub max_diff_ns: u64,
}

/// A trajectory that was aligned with the ground truth.
#[derive(Default)]
pub struct Aligned {
    /// Root of the mean squared position error, m.
    pub rmse_m: Option<f64>,
    /// The error of each pose, m; not a number where there is no true pose; empty without ground truth.
    pub errors_m: Vec<f32>,
    /// Transforms positions of the ground truth into the world of the estimate.
    pub t_world_truth: Option<Matrix4<f64>>,
}

impl Truth {
    /// Compares a trajectory with the ground truth, if there is one and they can be aligned.
    pub fn align(&self, trajectory: &[StampedPose]) -> Aligned {
        let aligned = || {
            let matches = associate(&self.poses, trajectory, self.max_diff_ns).ok()?;
            let found = align(&matches, self.alignment).or_else(|_| align(&matches, AlignmentKind::Origin)).ok()?;
            let mut errors_m = vec![f32::NAN; trajectory.len()];
            let mut squared = 0.0;
            for pair in &matches {
                let off = found.apply(&pair.estimate).t_world_cam.translation.vector
                    - pair.reference.t_world_cam.translation.vector;
                squared += off.norm_squared();
                if let Ok(index) =
                    trajectory.binary_search_by_key(&pair.estimate.timestamp_ns, |pose| pose.timestamp_ns)
                {
                    errors_m[index] = off.norm() as f32;
                }
            }
            let t_truth_world = Matrix4::new_translation(&found.translation)
                * found.rotation.to_homogeneous()
                * Matrix4::new_scaling(found.scale);
            let rmse_m = Some((squared / matches.len().max(1) as f64).sqrt());
            Some(Aligned { rmse_m, errors_m, t_world_truth: t_truth_world.try_inverse() })
        };
        if self.poses.is_empty() { Aligned::default() } else { aligned().unwrap_or_default() }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    #[test]
    fn the_error_of_each_pose_is_its_distance_after_alignment() {
        let moved = Isometry3::new(Vector3::new(3.0, -1.0, 2.0), Vector3::new(0.1, 0.7, 0.2));
        let at = |k: i64| Isometry3::translation((k as f64 * 0.3).sin(), 0.1 * k as f64, (k as f64 * 0.2).cos());
        let estimate: Vec<StampedPose> = (0..40).map(|k| StampedPose::new(k * 33_000_000, at(k))).collect();
        let true_pose = |pose: &StampedPose| StampedPose::new(pose.timestamp_ns, moved * pose.t_world_cam);
        let mut poses: Vec<StampedPose> = estimate.iter().map(true_pose).collect();
        poses.remove(7);
        let truth = Truth { poses, alignment: AlignmentKind::Se3, max_diff_ns: 1_000_000 };
        let aligned = truth.align(&estimate);
        assert!(aligned.rmse_m.unwrap() < 1e-9 && aligned.errors_m[7].is_nan() && aligned.errors_m[8] < 1e-6);
        let off = aligned.t_world_truth.unwrap() - moved.inverse().to_homogeneous();
        assert!(off.norm() < 1e-9);
        let none = Truth { poses: Vec::new(), ..truth };
        assert!(none.align(&estimate).rmse_m.is_none());
    }
}
