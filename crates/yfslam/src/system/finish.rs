//! Last stage: the tracking state, the trajectory, the dense map, and the result of the frame.

use nalgebra::Matrix6;

use super::health::Evidence;
use super::{Anchor, FrameHealth, Pass, Slam, Tracked};
use crate::config::DepthSource;
use crate::dense::{RowShift, Source};
use crate::frame::Frame;
use crate::tracking::{LostReason, TrackingStart, TrackingState};

impl Slam {
    /// Ends the frame.
    pub(super) fn finish(
        &mut self,
        frame: &Frame,
        localised: Result<(), LostReason>,
        is_keyframe: bool,
        mut pass: Pass,
    ) -> Tracked {
        let tracked = localised.is_ok();
        let start = if tracked { self.tracking_start(&pass) } else { None };
        let covariance = if tracked { self.covariance(&pass) } else { None };
        self.state = match (tracked, self.state) {
            (true, _) => TrackingState::Tracking,
            (false, TrackingState::NotInitialized) => TrackingState::NotInitialized,
            (false, _) if self.should_begin_submap() => self.begin_submap(),
            (false, _) => TrackingState::Lost,
        };
        if tracked {
            self.unknown_frames = 0;
            self.add_anchor(frame.timestamp_ns);
        }
        if is_keyframe {
            self.extend_dense_map(frame, &mut pass);
        }
        let health = self.check_health(frame, tracked, &pass);
        Tracked {
            timestamp_ns: frame.timestamp_ns,
            state: self.state,
            t_world_cam: tracked.then(|| self.tracker.current.t_cam_world.inverse()),
            covariance,
            inliers: self.tracker.inliers,
            is_keyframe,
            start,
            lost_reason: localised.err(),
            loop_closure: pass.loop_closure,
            health,
            times: pass.times,
        }
    }

    /// Looks for signs that the result may be wrong.
    fn check_health(&mut self, frame: &Frame, tracked: bool, pass: &Pass) -> FrameHealth {
        let current = &self.tracker.current;
        let evidence = Evidence {
            timestamp_ns: frame.timestamp_ns,
            gray: &self.gray,
            depth: Some(&*pass.depth).filter(|_| self.context.config.depth.source == DepthSource::Image),
            t_cam_world: tracked.then_some(current.t_cam_world),
            map_moved: pass.loop_closure.is_some() || self.state != TrackingState::Tracking,
            contradicted: current.contradicted(),
        };
        self.health.check(&self.context.sensor, &evidence)
    }

    /// How tracking begins with a tracked frame, if it does.
    fn tracking_start(&self, pass: &Pass) -> Option<TrackingStart> {
        match self.state {
            TrackingState::Tracking => None,
            // A camera without depth begins a map with two frames, and recognises places until then.
            TrackingState::NotInitialized if pass.map_begun || self.context.sensor.measures_depth => {
                Some(TrackingStart::NewMap)
            }
            TrackingState::NotInitialized | TrackingState::Lost => Some(TrackingStart::Recognised),
        }
    }

    /// Covariance of the pose of a tracked frame.
    fn covariance(&self, pass: &Pass) -> Option<Matrix6<f64>> {
        let begins = self.state == TrackingState::NotInitialized;
        if begins && self.context.sensor.measures_depth {
            return Some(Matrix6::zeros());
        }
        self.tracker.current.covariance(&self.context.sensor).filter(|_| !pass.map_begun)
    }

    fn add_anchor(&mut self, timestamp_ns: i64) {
        if let Some((reference, t_cam_reference)) = self.tracker.current.reference {
            self.anchors.push(Anchor { timestamp_ns, reference, t_cam_reference });
        }
    }

    /// Adds the patch of a keyframe to the dense map, which follows every correction of the map.
    fn extend_dense_map(&mut self, frame: &Frame, pass: &mut Pass) {
        let (Some(mapper), Some(depth)) = (&mut self.dense, &frame.depth) else { return };
        let Some(relative_pose) = self.tracker.current.reference else { return };
        if !mapper.is_due(frame.timestamp_ns, &self.tracker.current.t_cam_world.inverse()) {
            return;
        }
        pass.clock.lap();
        let moving = self.filter.moving_mask(&self.context.config.dynamic, depth);
        let features = &self.tracker.current.features;
        let camera = &self.context.sensor.camera;
        let shift = features.velocity().and_then(|velocity| RowShift::new(camera, features.times(), velocity, depth));
        let source = Source {
            color: &frame.color,
            depth,
            shift: shift.as_ref(),
            moving: &moving,
            objects: self.detections.static_objects(),
        };
        let patch = mapper.extract(&self.context.config.dynamic, &source);
        pass.times.dense_patch = pass.clock.lap();
        mapper.insert(frame.timestamp_ns, relative_pose, patch, self.owner.map());
        pass.times.dense_map = pass.clock.lap();
    }
}
