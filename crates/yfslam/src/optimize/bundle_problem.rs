//! The problem of bundle adjustment: poses, points and the observations of the points.
//!
//! In: a copy of a part of the map. Out: its cost, and which observations are outliers. [`bundle`](super::bundle) minimises the cost.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::geometry::{Pinhole, Pose};
use crate::optimize::residual::{Measurement, huber};

/// Least depth of a point with a usable projection, m.
pub(super) const MIN_DEPTH_M: f64 = 1e-3;

/// Observation of a point from a pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    /// Index into [`BundleProblem::poses`].
    pub pose: usize,
    /// Index into [`BundleProblem::points`].
    pub point: usize,
    /// Measured position and disparity.
    pub measurement: Measurement,
    /// Static probability, in [0, 1]; an observation with 0 is ignored.
    pub trust: f64,
}

/// A bundle adjustment problem: a copy of a part of the map.
#[derive(Clone, Debug)]
pub(crate) struct BundleProblem {
    /// Camera of all poses.
    pub camera: Pinhole,
    /// `t_cam_world` of each keyframe; the first `free_poses` are adjusted, the others are fixed.
    pub poses: Vec<Pose>,
    /// Number of poses that are adjusted.
    pub free_poses: usize,
    /// Landmarks in the world, m.
    pub points: Vec<Point3<f64>>,
    /// Observations, grouped by ascending `point`.
    pub observations: Vec<Observation>,
}

impl BundleProblem {
    /// Returns the rotation matrices of all poses.
    pub(super) fn rotations(&self) -> Vec<Matrix3<f64>> {
        self.poses.iter().map(|p| *p.rotation.to_rotation_matrix().matrix()).collect()
    }

    /// Returns where the observations of each point start, and their number at the end.
    pub(super) fn point_starts(&self) -> Vec<usize> {
        (0..=self.points.len()).map(|point| self.observations.partition_point(|o| o.point < point)).collect()
    }

    /// Returns the point of observation `o` in the frame of its camera.
    fn point_in_camera(&self, o: &Observation) -> Vector3<f64> {
        (self.poses[o.pose] * self.points[o.point]).coords
    }

    /// Returns the sum of the losses. A point behind its camera costs its χ² limit.
    pub(super) fn cost(&self, robust: bool) -> f64 {
        let rotations = self.rotations();
        let mut sum = 0.0;
        for o in self.observations.iter().filter(|o| o.trust > 0.0) {
            let p = rotations[o.pose] * self.points[o.point].coords + self.poses[o.pose].translation.vector;
            let limit = o.measurement.chi2_limit();
            if p.z <= MIN_DEPTH_M {
                sum += o.trust * limit;
                continue;
            }
            let chi2 = o.measurement.chi2(&o.measurement.residual(&self.camera, &p));
            sum += o.trust * if robust { huber(chi2, limit).0 } else { chi2 };
        }
        sum
    }

    /// Sets the trust of observations to 0 if they fail the χ² test or lie behind their camera. Returns their number.
    pub(crate) fn drop_outliers(&mut self) -> usize {
        let mut dropped = 0;
        for i in 0..self.observations.len() {
            let o = self.observations[i];
            let p = self.point_in_camera(&o);
            let m = &o.measurement;
            if o.trust > 0.0 && (p.z <= MIN_DEPTH_M || m.chi2(&m.residual(&self.camera, &p)) > m.chi2_limit()) {
                self.observations[i].trust = 0.0;
                dropped += 1;
            }
        }
        dropped
    }
}
