//! A frame during tracking: its features, matches and pose.
//!
//! In: features and matches. Out: the refined pose and its covariance (motion-only bundle adjustment).

use nalgebra::{Matrix6, Point3};

use crate::config::PoseOptimizerConfig;
use crate::context::{Context, SensorModel};
use crate::features::FrameFeatures;
use crate::features::rolling_shutter::Velocity;
use crate::geometry::{Pose, perturbed};
use crate::image::DepthImage;
use crate::map::{KeyFrameId, Landmark, LandmarkId, Map};
use crate::optimize::pose_only::{PoseObservation, optimize_pose, pose_covariance};

/// Depth of points in a frame in which none is known, m: so far that only rotations move them.
const UNKNOWN_DEPTH_M: f64 = 1e3;

/// The point to which a feature is matched: a landmark or a visual odometry point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Match {
    /// Landmark; `None` for a visual odometry point.
    pub landmark: Option<LandmarkId>,
    /// Position in the world, m.
    pub point_world: Point3<f64>,
    /// Probability that the point still exists ([`Landmark::trust`]).
    pub trust: f32,
}

impl Match {
    /// Makes a match with a landmark.
    pub(crate) fn of(id: LandmarkId, landmark: &Landmark) -> Self {
        Self { landmark: Some(id), point_world: landmark.position, trust: landmark.trust() }
    }
}

/// A frame with its pose and matches. Buffers are reused from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrackedFrame {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// Features.
    pub features: FrameFeatures,
    /// Match of each feature.
    pub matches: Vec<Option<Match>>,
    /// Pose: transforms points from the world into the camera.
    pub t_cam_world: Pose,
    /// Reference keyframe, and the pose relative to it, `t_cam_reference` ([`Map::relative_pose`]).
    pub reference: Option<(KeyFrameId, Pose)>,
    /// Mean row time of the observations that gave the pose, s, and the velocity with which they were corrected.
    observed_at: (f64, Velocity),
    /// Features whose depth contradicts their position, of all with depth, in the refinement that had most of them.
    contradicted: [usize; 2],
    observations: Vec<PoseObservation>,
    /// Feature of each observation.
    observed: Vec<u32>,
    /// Depth and index of unmatched features.
    nearest: Vec<(f32, u32)>,
    /// Depths of the matched points, m.
    depths: Vec<f64>,
}

impl TrackedFrame {
    /// Begins another frame; the caller sets its features and matches afterwards.
    pub(crate) fn begin(&mut self, timestamp_ns: i64) {
        self.timestamp_ns = timestamp_ns;
        self.observations.clear();
        self.observed_at = (0.0, Velocity::zeros());
        self.contradicted = [0; 2];
    }

    /// Returns how many features have a depth that contradicts their position in the image, of how many with depth.
    pub(crate) fn contradicted(&self) -> [usize; 2] {
        self.contradicted
    }

    /// Returns the pose `t_cam_world` at the mean time at which its observations were read, and that time, s after the middle row. It hardly
    /// depends on the velocity with which they were corrected: velocities measured between such poses do not feed on their own errors, not
    /// even where all observations lie at the upper or lower border.
    pub(crate) fn observed_pose(&self) -> (Pose, f64) {
        let (seconds, velocity) = self.observed_at;
        (perturbed(&(velocity * -seconds), &self.t_cam_world), seconds)
    }

    /// Returns the covariance of the pose (see [`pose_covariance`]) from the inliers of its last refinement.
    pub(crate) fn covariance(&self, sensor: &SensorModel) -> Option<Matrix6<f64>> {
        pose_covariance(&sensor.pinhole, &self.t_cam_world, &self.observations)
    }

    /// Returns the mean squared residual of the depths of the inliers of the last refinement, in units of their variance.
    pub(crate) fn depth_residual(&self, sensor: &SensorModel) -> Option<f64> {
        let with_depth = self.observations.iter().filter(|o| o.inlier && o.measurement.weight_disparity > 0.0);
        let squared = |o: &PoseObservation| {
            let p = (self.t_cam_world * o.point_world).coords;
            o.measurement.residual(&sensor.pinhole, &p).z.powi(2) * o.measurement.weight_disparity
        };
        let (sum, count) = with_depth.map(squared).fold((0.0, 0usize), |(sum, count), one| (sum + one, count + 1));
        (count > 0).then(|| sum / count as f64)
    }

    /// Removes all matches.
    pub(crate) fn clear_matches(&mut self) {
        self.matches.clear();
        self.matches.resize(self.features.len(), None);
    }

    /// Returns whether a feature may be matched: it has no match and its trust is above 0.
    #[inline]
    pub(crate) fn is_matchable(&self, feature: usize) -> bool {
        self.matches[feature].is_none() && self.features.features[feature].trust > 0.0
    }

    /// Removes the matches of features with trust 0.
    pub(crate) fn drop_distrusted(&mut self) {
        for (matched, feature) in self.matches.iter_mut().zip(&self.features.features) {
            if feature.trust <= 0.0 {
                *matched = None;
            }
        }
    }

    /// Sets the trust of features to 0 if the dynamic filter reduced it and no landmark confirms them.
    pub(crate) fn settle_doubts(&mut self) {
        for (matched, feature) in self.matches.iter().zip(&mut self.features.features) {
            if feature.trust < 1.0 && matched.is_none() {
                feature.trust = 0.0;
            }
        }
    }

    /// Brings the features to the time of the middle row, for a camera with that velocity; looks their depths up in `depth` before, if it is
    /// given. Depths that were not measured are those of the
    /// matched points, or the median of these.
    pub(crate) fn correct_shutter(&mut self, sensor: &SensorModel, velocity: &Velocity, depth: Option<&DepthImage>) {
        if let Some(depth) = depth {
            self.features.measure_depths(velocity, &sensor.camera, depth);
        }
        if self.features.times().is_instant() {
            // Nothing moves; the velocity is noted for the estimate of the readout time.
            return self.features.move_to_middle_row(velocity, &sensor.pinhole, |_| UNKNOWN_DEPTH_M);
        }
        let pose = &self.t_cam_world;
        let depth_of = |matched: &Match| (pose * matched.point_world).z;
        self.depths.clear();
        self.depths.reserve(self.matches.len());
        self.depths.extend(self.matches.iter().flatten().map(depth_of));
        let middle = self.depths.len() / 2;
        let median = match self.depths.is_empty() {
            true => UNKNOWN_DEPTH_M,
            false => *self.depths.select_nth_unstable_by(middle, f64::total_cmp).1,
        };
        let matches = &self.matches;
        self.features.move_to_middle_row(velocity, &sensor.pinhole, |i| {
            matches.get(i).and_then(Option::as_ref).map(depth_of).filter(|z| *z > 0.0).unwrap_or(median)
        });
    }

    /// Removes the matches with visual odometry points.
    pub(crate) fn drop_odometry_points(&mut self) {
        for matched in &mut self.matches {
            if matched.is_some_and(|m| m.landmark.is_none()) {
                *matched = None;
            }
        }
    }

    /// Returns the number of matches.
    pub(crate) fn match_count(&self) -> usize {
        self.matches.iter().flatten().count()
    }

    /// Refines the pose from all matches and removes the outliers. Returns the number of inliers that are landmarks.
    pub(crate) fn refine_pose(&mut self, context: &Context) -> usize {
        self.optimize_pose(context, &context.config.pose_optimizer)
    }

    /// Refines a pose again whose matches are inliers already, after a small change of the features. Returns as
    /// [`TrackedFrame::refine_pose`].
    pub(crate) fn polish_pose(&mut self, context: &Context) -> usize {
        let config = &context.config.pose_optimizer;
        self.optimize_pose(context, &PoseOptimizerConfig { rounds: 1, robust_rounds: 0, ..config.clone() })
    }

    fn optimize_pose(&mut self, context: &Context, config: &PoseOptimizerConfig) -> usize {
        let sensor = &context.sensor;
        self.observations.clear();
        self.observed.clear();
        for (i, matched) in self.matches.iter().enumerate() {
            let Some(matched) = matched else { continue };
            let feature = &self.features.features[i];
            self.observed.push(i as u32);
            self.observations.push(PoseObservation {
                point_world: matched.point_world,
                measurement: sensor.measurement(feature),
                trust: f64::from(feature.trust * matched.trust),
                inlier: true,
            });
        }
        optimize_pose(&sensor.pinhole, config, &mut self.t_cam_world, &mut self.observations);
        let (mut landmarks, mut inliers, mut seconds) = (0, 0, 0.0);
        let [mut contradicted, mut with_depth] = [0; 2];
        for (&i, o) in self.observed.iter().zip(&self.observations) {
            let matched = &mut self.matches[i as usize];
            if o.measurement.weight_disparity > 0.0 {
                let by_depth =
                    !o.inlier && o.measurement.fits_position(&sensor.pinhole, &(self.t_cam_world * o.point_world));
                contradicted += usize::from(by_depth);
                with_depth += usize::from(by_depth || o.inlier);
            }
            if o.inlier {
                inliers += 1;
                seconds += self.features.times().color.seconds(f64::from(self.features.features[i as usize].raw[1]));
            }
            if !o.inlier {
                *matched = None;
            } else if matched.is_some_and(|m| m.landmark.is_some()) {
                landmarks += 1;
            }
        }
        let velocity = self.features.velocity().copied().unwrap_or_default();
        self.observed_at = (seconds / f64::from(inliers.max(1)), velocity);
        if with_depth > self.contradicted[1] {
            self.contradicted = [contradicted, with_depth];
        }
        landmarks
    }

    /// Adds unmatched features with depth as visual odometry points for the next frame: all within the close limit, and at least the
    /// `at_least` nearest. They never become landmarks.
    pub(crate) fn add_odometry_points(&mut self, sensor: &SensorModel, at_least: usize) {
        let t_world_cam = self.t_cam_world.inverse();
        self.nearest.clear();
        for (i, f) in self.features.features.iter().enumerate() {
            if let (Some(z), true) = (f.depth_m, self.is_matchable(i)) {
                self.nearest.push((z, i as u32));
            }
        }
        self.nearest.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (n, &(z, i)) in self.nearest.iter().enumerate() {
            if f64::from(z) > sensor.close_limit_m && n >= at_least {
                break;
            }
            let f = &self.features.features[i as usize];
            let point = sensor.pinhole.unproject(f64::from(f.u), f64::from(f.v), f64::from(z));
            self.matches[i as usize] = Some(Match { landmark: None, point_world: t_world_cam * point, trust: 1.0 });
        }
    }

    /// Returns the pose `t_cam_world` after all corrections of the map so far.
    pub(crate) fn pose_in(&self, map: &Map) -> Pose {
        let corrected =
            self.reference.and_then(|(reference, t_cam_reference)| map.absolute_pose(reference, &t_cam_reference));
        corrected.unwrap_or(self.t_cam_world)
    }

    /// Updates pose and matched points after corrections of the map; matches with removed landmarks are removed.
    pub(crate) fn follow_map(&mut self, map: &Map) {
        self.t_cam_world = self.pose_in(map);
        for matched in &mut self.matches {
            if let Some(Match { landmark: Some(id), .. }) = *matched {
                *matched = map.landmark(id).map(|landmark| Match::of(id, landmark));
            }
        }
    }

    /// Sets the reference keyframe, so that the frame follows corrections of the map.
    pub(crate) fn set_reference(&mut self, reference: KeyFrameId, map: &Map) {
        self.reference =
            map.relative_pose(reference, &self.t_cam_world).map(|t_cam_reference| (reference, t_cam_reference));
    }
}
