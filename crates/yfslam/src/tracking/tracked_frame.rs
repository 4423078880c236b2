//! The frame being tracked: its features and what they are matched to.

use nalgebra::{Matrix6, Point3};

use crate::context::{Context, SensorModel};
use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::map::{KeyFrameId, Landmark, LandmarkId, Map};
use crate::optimize::pose_only::{PoseObservation, optimize_pose, pose_covariance};

/// A point that a feature is matched to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Match {
    /// The landmark; `None` for a point borrowed from the last frame's depth.
    pub landmark: Option<LandmarkId>,
    /// Where it is in the world, m.
    pub point_world: Point3<f64>,
    /// Probability that it still is there ([`Landmark::trust`]).
    pub trust: f32,
}

impl Match {
    /// Of a landmark.
    pub(crate) fn of(id: LandmarkId, landmark: &Landmark) -> Self {
        Self { landmark: Some(id), point_world: landmark.position, trust: landmark.trust() }
    }
}

/// A frame with its pose and matches. Buffers are reused from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrackedFrame {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// What was seen.
    pub features: FrameFeatures,
    /// What each feature is matched to.
    pub matches: Vec<Option<Match>>,
    /// Maps world points into this camera.
    pub t_cam_world: Pose,
    /// The keyframe it is tied to, and its pose seen from there, `t_cam_reference` ([`Map::relative_pose`]).
    pub reference: Option<(KeyFrameId, Pose)>,
    observations: Vec<PoseObservation>,
    observed: Vec<u32>,
    nearest: Vec<(f32, u32)>,
}

impl TrackedFrame {
    /// Begins another frame; its features and matches are set afterwards.
    pub(crate) fn begin(&mut self, timestamp_ns: i64) {
        self.timestamp_ns = timestamp_ns;
        self.observations.clear();
    }

    /// Returns the covariance of the pose (see [`pose_covariance`]) that the inliers of its last refinement give.
    pub(crate) fn covariance(&self, sensor: &SensorModel) -> Option<Matrix6<f64>> {
        pose_covariance(&sensor.pinhole, &self.t_cam_world, &self.observations)
    }

    /// Forgets all matches.
    pub(crate) fn clear_matches(&mut self) {
        self.matches.clear();
        self.matches.resize(self.features.len(), None);
    }

    /// Features that may be matched: trusted and not matched yet.
    #[inline]
    pub(crate) fn is_open(&self, feature: usize) -> bool {
        self.matches[feature].is_none() && self.features.features[feature].trust > 0.0
    }

    /// Forgets the matches of features that are not trusted any more.
    pub(crate) fn drop_distrusted(&mut self) {
        for (matched, feature) in self.matches.iter_mut().zip(&self.features.features) {
            if feature.trust <= 0.0 {
                *matched = None;
            }
        }
    }

    /// Distrusts the features that boxes speak against and that are no landmarks either.
    pub(crate) fn settle_doubts(&mut self) {
        for (matched, feature) in self.matches.iter().zip(&mut self.features.features) {
            if feature.trust < 1.0 && matched.is_none() {
                feature.trust = 0.0;
            }
        }
    }

    /// Number of matched features.
    pub(crate) fn matched(&self) -> usize {
        self.matches.iter().flatten().count()
    }

    /// Refines the pose from all matches and drops those that do not fit. Returns the number of inliers that are landmarks of the
    /// map with more than a single matched's worth of evidence.
    pub(crate) fn refine_pose(&mut self, context: &Context) -> usize {
        let (sensor, config) = (&context.sensor, &context.config.pose_optimizer);
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
        let mut on_map = 0;
        for (&i, o) in self.observed.iter().zip(&self.observations) {
            let matched = &mut self.matches[i as usize];
            if !o.inlier {
                *matched = None;
            } else if matched.is_some_and(|s| s.landmark.is_some()) {
                on_map += 1;
            }
        }
        on_map
    }

    /// Lends unmatched features with depth to the next frame as points: all close ones, at least the `at_least` closest. They never
    /// enter the map.
    pub(crate) fn add_odometry_points(&mut self, sensor: &SensorModel, at_least: usize) {
        let t_world_cam = self.t_cam_world.inverse();
        self.nearest.clear();
        for (i, f) in self.features.features.iter().enumerate() {
            if let (Some(z), true) = (f.depth_m, self.is_open(i)) {
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

    /// Its pose, `t_cam_world`, where the map is now.
    pub(crate) fn pose_in(&self, map: &Map) -> Pose {
        let tied =
            self.reference.and_then(|(reference, t_cam_reference)| map.absolute_pose(reference, &t_cam_reference));
        tied.unwrap_or(self.t_cam_world)
    }

    /// Brings pose and matched points up to date after the map moved; matches to landmarks that are gone are dropped.
    pub(crate) fn follow_map(&mut self, map: &Map) {
        self.t_cam_world = self.pose_in(map);
        for matched in &mut self.matches {
            if let Some(Match { landmark: Some(id), .. }) = *matched {
                *matched = map.landmark(id).map(|landmark| Match::of(id, landmark));
            }
        }
    }

    /// Ties the frame to a keyframe, so that it moves along when the map is corrected.
    pub(crate) fn attach_to(&mut self, reference: KeyFrameId, map: &Map) {
        self.reference =
            map.relative_pose(reference, &self.t_cam_world).map(|t_cam_reference| (reference, t_cam_reference));
    }
}
