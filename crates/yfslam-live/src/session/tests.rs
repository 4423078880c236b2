use yfslam::{Camera, DepthImage, Frame, Image, RgbImage};

use super::*;

const PATIENCE: Duration = Duration::from_millis(500);
const MS: i64 = 1_000_000;

/// Delivers what it was given, in order.
struct Script(std::collections::VecDeque<Arrival>);

impl LiveSource for Script {
    fn next(&mut self, _: Duration) -> Arrival {
        self.0.pop_front().unwrap_or(Arrival::Ended)
    }

    fn dropped(&self) -> u64 {
        3
    }
}

/// A frame without features: enough to see what becomes of it.
fn frame(stamp_ms: i64, width: usize, arrival: Instant) -> Arrival {
    let depth = DepthImage { raw: Image::new(width, 240), metres_per_unit: 0.001 };
    Arrival::Frame { frame: Frame::rgbd(stamp_ms * MS, RgbImage::new(width, 240), depth), arrival }
}

fn session(start: Instant) -> LiveSession {
    let slam = Slam::builder(Camera::pinhole(320, 240, 300.0, 300.0, 160.0, 120.0)).build();
    LiveSession::new(slam.unwrap_or_else(|error| panic!("{error}")), PATIENCE, start)
}

#[test]
fn a_camera_may_start_late_fall_silent_and_come_back() {
    let start = Instant::now();
    let at = |ms| start + Duration::from_millis(ms);
    let mut session = session(start);
    assert_eq!(session.state(), LiveState::WaitingForCamera);
    assert!(matches!(session.handle(frame(0, 320, at(0)), at(1)), Step::Tracked { .. }));
    assert_eq!(session.state(), LiveState::Initialising);
    assert!(matches!(session.handle(Arrival::Nothing, at(300)), Step::Nothing));
    assert!(matches!(session.handle(Arrival::Nothing, at(600)), Step::Silent(_)));
    assert!(matches!(session.handle(Arrival::Nothing, at(700)), Step::Nothing));
    assert_eq!(session.state(), LiveState::CameraSilent);
    let Step::Tracked { camera, clock, .. } = session.handle(frame(2000, 320, at(2000)), at(2001)) else {
        panic!("the frame is used")
    };
    assert_eq!((camera, clock), (Some(CameraEvent::Back(Duration::from_secs(2))), None));
    let health = session.health(at(2001));
    assert_eq!((health.state, health.camera_returns, health.frames), (LiveState::Initialising, 1, 2));
}

#[test]
fn a_clock_that_jumps_back_does_not_stop_tracking_and_the_camera_s_own_stamp_is_kept() {
    let start = Instant::now();
    let mut session = session(start);
    let mut source = Script(
        [(50_000, 0), (50_040, 40), (10_000, 80)]
            .map(|(stamp, at)| frame(stamp, 320, start + Duration::from_millis(at)))
            .into(),
    );
    session.step(&mut source, PATIENCE);
    session.step(&mut source, PATIENCE);
    let Step::Tracked { tracked, stamp_ns, clock, .. } = session.step(&mut source, PATIENCE) else {
        panic!("the frame is used")
    };
    assert_eq!((tracked.timestamp_ns, stamp_ns), (50_080 * MS, 10_000 * MS));
    assert_eq!(clock, Some(ClockEvent::Back(40_040 * MS)));
    assert!(matches!(session.step(&mut source, PATIENCE), Step::Ended));
    assert_eq!(session.health(start).dropped, 3);
}

#[test]
fn frames_that_cannot_be_used_are_counted_with_their_reason() {
    let start = Instant::now();
    let mut session = session(start);
    assert!(matches!(session.handle(frame(0, 320, start), start), Step::Tracked { .. }));
    let Step::Unusable(reason) = session.handle(frame(40, 300, start), start) else { panic!("the size is wrong") };
    assert!(reason.contains("300x240"), "{reason}");
    assert!(matches!(session.handle(Arrival::Unusable("no depth".into()), start), Step::Unusable(_)));
    assert!(matches!(session.handle(frame(0, 320, start), start), Step::Late(40_000_000)));
    let health = session.health(start);
    assert_eq!((health.unusable, health.late, health.frames), (2, 1, 1));
    assert_eq!(health.last_unusable.as_deref(), Some("no depth"));
    assert!(health.lost_reason.is_some(), "an image without features has no pose");
}

#[test]
fn a_pause_ignores_frames_but_watches_the_camera() {
    let start = Instant::now();
    let mut session = session(start);
    session.pause(true);
    assert!(matches!(session.handle(frame(0, 320, start), start), Step::Ignored));
    assert_eq!((session.state(), session.health(start).frames), (LiveState::Paused, 0));
    session.pause(false);
    assert!(matches!(session.handle(frame(40, 320, start), start), Step::Tracked { .. }));
}
