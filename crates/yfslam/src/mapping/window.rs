//! Local bundle adjustment (ORB-SLAM2, IEEE T-RO 2017, section III-B).
//!
//! In: a keyframe. Out: refined poses and landmarks. The part of the map is copied, adjusted, and written back for all items
//! that the map still contains, so that the map may change in the meantime.

use std::collections::BTreeMap;

use slotmap::SecondaryMap;

use crate::config::BundleConfig;
use crate::context::{Context, SensorModel};
use crate::map::{KeyFrameId, LandmarkId, Map};
use crate::optimize::bundle::{BundleProblem, Observation};

/// A copy of a part of the map: keyframes to adjust, their landmarks, and fixed keyframes that observe these, too.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    problem: BundleProblem,
    keyframes: Vec<KeyFrameId>,
    landmarks: Vec<LandmarkId>,
}

impl Window {
    /// Copies `keyframe`, its best covisible keyframes, their landmarks, and as fixed keyframes those others that observe most of them.
    pub(crate) fn copy(context: &Context, map: &Map, keyframe: KeyFrameId) -> Option<Self> {
        let (sensor, config) = (&context.sensor, &context.config.mapping);
        let center = map.keyframe(keyframe)?;
        let mut keyframes = vec![keyframe];
        keyframes.extend(center.covisible.iter().take(config.window_keyframes.saturating_sub(1)).map(|(id, _)| *id));
        // The root defines the world frame and is never adjusted.
        keyframes.retain(|id| map.keyframe(*id).is_some_and(|k| k.parent.is_some()));
        let mut landmarks: Vec<LandmarkId> =
            keyframes.iter().filter_map(|id| map.keyframe(*id)).flat_map(|k| k.observed().map(|(_, l)| l)).collect();
        landmarks.sort_unstable();
        landmarks.dedup();
        let free_poses = keyframes.len();
        let mut outside: BTreeMap<KeyFrameId, usize> = BTreeMap::new();
        for (k, _) in landmarks.iter().filter_map(|l| map.landmark(*l)).flat_map(|l| &l.observations) {
            if !keyframes[..free_poses].contains(k) {
                *outside.entry(*k).or_default() += 1;
            }
        }
        let mut outside: Vec<_> = outside.into_iter().collect();
        outside.sort_by_key(|&(id, count)| (std::cmp::Reverse(count), id));
        keyframes.extend(outside.iter().take(config.window_fixed).map(|(id, _)| *id));
        Some(Self::assemble(sensor, map, keyframes, free_poses, landmarks))
    }

    /// Copies keyframes, of which the first `free_poses` are adjusted, and landmarks with their observations in these.
    pub(crate) fn assemble(
        sensor: &SensorModel,
        map: &Map,
        keyframes: Vec<KeyFrameId>,
        free_poses: usize,
        landmarks: Vec<LandmarkId>,
    ) -> Self {
        let index: SecondaryMap<KeyFrameId, usize> = keyframes.iter().enumerate().map(|(i, id)| (*id, i)).collect();
        let mut points = Vec::with_capacity(landmarks.len());
        let mut observations = Vec::new();
        for (point, id) in landmarks.iter().enumerate() {
            let Some(landmark) = map.landmark(*id) else { continue };
            points.push(landmark.position);
            let first = observations.len();
            for &(k, f) in &landmark.observations {
                let (Some(&pose), Some(k)) = (index.get(k), map.keyframe(k)) else { continue };
                let feature = &k.features.features[f as usize];
                observations.push(Observation {
                    pose,
                    point,
                    measurement: sensor.measurement(feature),
                    trust: f64::from(feature.trust * landmark.trust()),
                });
            }
            observations[first..].sort_unstable_by_key(|o| o.pose);
        }
        let poses = keyframes.iter().filter_map(|id| map.keyframe(*id)).map(|k| k.t_cam_world).collect();
        let problem = BundleProblem { camera: sensor.pinhole, poses, free_poses, points, observations };
        Self { problem, keyframes, landmarks }
    }

    /// Adjusts the copy for as long as `should_continue` returns true; see [`BundleProblem::adjust`].
    pub(crate) fn adjust(&mut self, config: &BundleConfig, should_continue: &dyn Fn() -> bool) {
        self.problem.adjust(config, should_continue);
    }

    /// Returns the keyframes that are adjusted.
    pub(crate) fn adjusted_keyframes(&self) -> &[KeyFrameId] {
        &self.keyframes[..self.problem.free_poses]
    }

    /// Returns the landmarks, in the order in which they were given.
    pub(crate) fn landmarks(&self) -> &[LandmarkId] {
        &self.landmarks
    }

    /// Writes poses and points back to the map and removes outlier observations. Items that the map no longer contains are skipped.
    pub(crate) fn merge(self, sensor: &SensorModel, map: &mut Map) {
        self.merge_poses(map);
        self.merge_landmarks(sensor, map);
    }

    /// Writes the poses back.
    pub(crate) fn merge_poses(&self, map: &mut Map) {
        for (id, pose) in self.adjusted_keyframes().iter().zip(&self.problem.poses) {
            map.set_pose(*id, *pose);
        }
    }

    /// Writes the points back, removes outlier observations, and updates the landmarks; to be called after all poses are written back.
    pub(crate) fn merge_landmarks(&self, sensor: &SensorModel, map: &mut Map) {
        for (id, position) in self.landmarks.iter().zip(&self.problem.points) {
            map.set_position(*id, *position);
        }
        let mut changed = Vec::new();
        for o in &self.problem.observations {
            if o.trust <= 0.0 {
                map.remove_observation(self.landmarks[o.point], self.keyframes[o.pose]);
                changed.push(self.landmarks[o.point]);
            }
        }
        for id in &self.landmarks {
            map.update_view_range(*id, &sensor.scale_factors);
        }
        changed.dedup();
        for id in changed {
            map.update_landmark(id, &sensor.scale_factors);
        }
    }
}
