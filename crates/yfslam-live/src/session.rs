//! SLAM on live frames.
//!
//! In: a source, and the time. Out: what happened, one step at a time.

use std::time::{Duration, Instant};

use yfslam::{LoopClosure, Slam, Tracked, TrackingState};

use crate::clock_guard::{Admission, ClockEvent, ClockGuard};
use crate::health::{Health, LiveState};
use crate::meters::{LatencyMeter, RateMeter};
use crate::source::{Arrival, LiveSource};
use crate::watchdog::{CameraEvent, Watchdog};

/// SLAM on live frames. A frame that cannot be used never ends the session.
pub struct LiveSession {
    slam: Slam,
    guard: ClockGuard,
    watchdog: Watchdog,
    camera_rate: RateMeter,
    latency: LatencyMeter,
    tracking: LatencyMeter,
    is_paused: bool,
    state: TrackingState,
    health: Health,
}

/// What one step brought.
#[derive(Debug)]
#[non_exhaustive]
pub enum Step {
    /// A frame was tracked, or its pose is not known.
    Tracked {
        /// The result; its stamp is that of the tracker.
        tracked: Box<Tracked>,
        /// The stamp that the camera gave the frame, ns.
        stamp_ns: i64,
        /// When its last image came.
        arrival: Instant,
        /// Whether the clock of the camera has jumped before it.
        clock: Option<ClockEvent>,
        /// Whether the camera had been silent before it.
        camera: Option<CameraEvent>,
    },
    /// A frame could not be used, and why.
    Unusable(String),
    /// A frame was late or repeated by so much, ns.
    Late(i64),
    /// A frame came while the session was paused.
    Ignored,
    /// The camera has become silent.
    Silent(Duration),
    /// Nothing happened.
    Nothing,
    /// The source has ended.
    Ended,
}

impl LiveSession {
    /// Begins at `now`; a camera that sends nothing for `patience` is silent.
    pub fn new(slam: Slam, patience: Duration, now: Instant) -> Self {
        Self {
            slam,
            guard: ClockGuard::default(),
            watchdog: Watchdog::new(patience, now),
            camera_rate: RateMeter::default(),
            latency: LatencyMeter::default(),
            tracking: LatencyMeter::default(),
            is_paused: false,
            state: TrackingState::default(),
            health: Health::default(),
        }
    }

    /// Waits for a frame, but no longer than `timeout`, and tracks it.
    pub fn step(&mut self, source: &mut impl LiveSource, timeout: Duration) -> Step {
        let arrival = source.next(timeout);
        self.health.dropped = source.dropped();
        self.handle(arrival, Instant::now())
    }

    /// Handles what a source delivered; `now` is the time at which it is handled.
    pub fn handle(&mut self, arrival: Arrival, now: Instant) -> Step {
        match arrival {
            Arrival::Ended => Step::Ended,
            Arrival::Nothing => match self.watchdog.check(now) {
                Some(CameraEvent::Silent(silence)) => Step::Silent(silence),
                _ => Step::Nothing,
            },
            Arrival::Unusable(reason) => {
                self.watchdog.frame(now);
                self.unusable(reason)
            }
            Arrival::Frame { mut frame, arrival } => {
                let camera = self.watchdog.frame(arrival);
                self.camera_rate.count(arrival);
                if self.is_paused {
                    return Step::Ignored;
                }
                let own_stamp_ns = frame.timestamp_ns;
                let (stamp_ns, clock) = match self.guard.admit(own_stamp_ns, arrival) {
                    Admission::Late { by_ns } => return Step::Late(by_ns),
                    Admission::Frame { stamp_ns, event } => (stamp_ns, event),
                };
                frame.timestamp_ns = stamp_ns;
                let depth_ns = frame.depth_timestamp_ns;
                frame.depth_timestamp_ns = depth_ns.map(|ns| ns.saturating_add(stamp_ns.saturating_sub(own_stamp_ns)));
                let began = Instant::now();
                let tracked = match self.slam.track(&frame) {
                    Ok(tracked) => tracked,
                    Err(rejected) => return self.unusable(rejected.to_string()),
                };
                self.tracking.add(began.elapsed());
                self.latency.add(arrival.elapsed());
                self.note(&tracked);
                Step::Tracked { tracked: Box::new(tracked), stamp_ns: own_stamp_ns, arrival, clock, camera }
            }
        }
    }

    fn unusable(&mut self, reason: String) -> Step {
        self.health.unusable += 1;
        self.health.last_unusable = Some(reason.clone());
        Step::Unusable(reason)
    }

    fn note(&mut self, tracked: &Tracked) {
        self.state = tracked.state;
        let health = &mut self.health;
        health.frames += 1;
        health.tracked += u64::from(tracked.t_world_cam.is_some());
        health.lost_reason = tracked.lost_reason;
        health.inliers = tracked.inliers;
        health.loops += u64::from(tracked.loop_closure.is_some());
    }

    /// Ignores the frames that come, or uses them again.
    pub fn pause(&mut self, is_paused: bool) {
        self.is_paused = is_paused;
    }

    /// Returns the system.
    pub fn slam(&self) -> &Slam {
        &self.slam
    }

    /// Returns the system, to save or to read its dense map.
    pub fn slam_mut(&mut self) -> &mut Slam {
        &mut self.slam
    }

    /// Continues with another system, which has another map. Returns the one before.
    pub fn replace(&mut self, slam: Slam) -> Slam {
        self.state = TrackingState::default();
        self.health.lost_reason = None;
        std::mem::replace(&mut self.slam, slam)
    }

    /// Waits for mapping that is under way. Returns the loop that it closed.
    pub fn finish_mapping(&mut self) -> Option<LoopClosure> {
        self.slam.finish_mapping()
    }

    /// Returns the state at this time.
    pub fn state(&self) -> LiveState {
        match (self.is_paused, self.watchdog.has_come(), self.watchdog.is_silent()) {
            (true, ..) => LiveState::Paused,
            (false, false, _) => LiveState::WaitingForCamera,
            (false, true, true) => LiveState::CameraSilent,
            (false, true, false) => LiveState::of(self.state),
        }
    }

    /// Returns the health at this time.
    pub fn health(&self, now: Instant) -> Health {
        let (map, statistics) = (self.slam.map(), self.slam.statistics());
        Health {
            state: self.state(),
            camera_hz: self.camera_rate.per_second(now),
            latency_p50: self.latency.quantile(0.5),
            latency_p99: self.latency.quantile(0.99),
            tracking_p50: self.tracking.quantile(0.5),
            late: self.guard.late(),
            clock_jumps: self.guard.jumps(),
            camera_returns: self.watchdog.returns(),
            silence: self.watchdog.silence(now),
            features: self.slam.features().len(),
            keyframes: map.keyframe_count(),
            landmarks: map.landmarks().count(),
            resets: statistics.resets,
            mapping_has_ended: statistics.mapping_has_ended,
            ..self.health.clone()
        }
    }
}

#[cfg(test)]
mod tests;
