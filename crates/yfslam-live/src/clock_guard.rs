//! Makes time stamps ascend, whatever the clock of the camera does.
//!
//! In: the stamp of each frame, and when it came. Out: a stamp for the tracker, or why the frame is refused.
//!
//! A stamp that is a little older than the last one belongs to a late or repeated frame, which is refused. A stamp that is much older, or
//! much newer while the frames come as always, is a jump of the clock: a recording that begins again, a simulator that is reset, a
//! clock that is set. The tracker then continues one frame later on its own time, so that its motion model and its history stay valid.

use std::time::{Duration, Instant};

/// A stamp that is older by less than this belongs to a late frame; by more, the clock has jumped.
const LATE: i64 = 1_000_000_000;

/// A stamp may be ahead of the time that has passed by this much; by more, the clock has jumped.
const AHEAD: i64 = 2_000_000_000;

/// Time between two frames after a jump, if it is not known, ns.
const USUAL_STEP: i64 = 33_333_333;

/// Longest time between two frames that is repeated after a jump, ns.
const LONGEST_STEP: i64 = 200_000_000;

/// Makes time stamps ascend.
#[derive(Clone, Debug, Default)]
pub struct ClockGuard {
    last: Option<Last>,
    /// What is added to a stamp, ns.
    offset_ns: i64,
    jumps: u64,
    late: u64,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    stamp_ns: i64,
    arrival: Instant,
    step_ns: i64,
}

/// What becomes of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Admission {
    /// The frame is used with this stamp.
    Frame {
        /// Stamp for the tracker, ns; the frame's own one until the clock jumps.
        stamp_ns: i64,
        /// What the clock has done since the last frame.
        event: Option<ClockEvent>,
    },
    /// The frame is late or repeated, and is refused.
    Late {
        /// By how much it is older than the last one, ns; 0 for a repeated one.
        by_ns: i64,
    },
}

/// A jump of the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClockEvent {
    /// The clock went back by so much, ns.
    Back(i64),
    /// The clock went ahead of the time that had passed by so much, ns.
    Ahead(i64),
}

impl ClockGuard {
    /// Judges a frame with the stamp `stamp_ns` that came at `arrival`.
    pub fn admit(&mut self, stamp_ns: i64, arrival: Instant) -> Admission {
        let Some(last) = self.last else {
            self.last = Some(Last { stamp_ns, arrival, step_ns: USUAL_STEP });
            return Admission::Frame { stamp_ns, event: None };
        };
        let step_ns = stamp_ns.saturating_sub(last.stamp_ns);
        if step_ns <= 0 && step_ns > -LATE {
            self.late += 1;
            return Admission::Late { by_ns: -step_ns };
        }
        let passed_ns = nanoseconds(arrival.saturating_duration_since(last.arrival));
        let ahead_ns = step_ns.saturating_sub(passed_ns);
        let event = match step_ns {
            ..0 => Some(ClockEvent::Back(step_ns.saturating_neg())),
            _ if ahead_ns > AHEAD => Some(ClockEvent::Ahead(ahead_ns)),
            _ => None,
        };
        let mut now = Last { stamp_ns, arrival, step_ns: step_ns.min(LONGEST_STEP) };
        if event.is_some() {
            // A camera that was silent during the jump has moved on for as long as it was silent.
            now.step_ns = last.step_ns;
            let continued_ns = passed_ns.max(last.step_ns);
            self.offset_ns = self.offset_ns.saturating_add(continued_ns.saturating_sub(step_ns));
            self.jumps += 1;
        }
        self.last = Some(now);
        Admission::Frame { stamp_ns: stamp_ns.saturating_add(self.offset_ns), event }
    }

    /// Returns how many jumps there were.
    pub fn jumps(&self) -> u64 {
        self.jumps
    }

    /// Returns how many frames were refused.
    pub fn late(&self) -> u64 {
        self.late
    }
}

fn nanoseconds(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// Feeds stamps (ms) that come at these times (ms).
    fn feed(frames: &[(i64, u64)]) -> (Vec<Admission>, ClockGuard) {
        let (start, mut guard) = (Instant::now(), ClockGuard::default());
        let admit = |&(stamp, at): &(i64, u64)| guard.admit(stamp * MS, start + Duration::from_millis(at));
        (frames.iter().map(admit).collect(), guard)
    }

    fn frame(stamp_ms: i64, event: Option<ClockEvent>) -> Admission {
        Admission::Frame { stamp_ns: stamp_ms * MS, event }
    }

    #[test]
    fn stamps_that_ascend_stay_as_they_are_also_after_a_silence() {
        let (found, guard) = feed(&[(5000, 0), (5033, 33), (5066, 66), (65_000, 60_000)]);
        assert_eq!(found, [5000, 5033, 5066, 65_000].map(|ms| frame(ms, None)));
        assert_eq!(guard.jumps(), 0);
    }

    #[test]
    fn late_and_repeated_frames_are_refused() {
        let (found, guard) = feed(&[(5000, 0), (5033, 33), (5033, 35), (4990, 40), (5066, 66)]);
        assert_eq!(found[2..4], [Admission::Late { by_ns: 0 }, Admission::Late { by_ns: 43 * MS }]);
        assert_eq!((found[4], guard.late()), (frame(5066, None), 2));
    }

    #[test]
    fn a_recording_that_begins_again_continues_on_the_same_time() {
        let (found, guard) = feed(&[(50_000, 0), (50_040, 40), (10_000, 80), (10_040, 120)]);
        assert_eq!(found[2], frame(50_080, Some(ClockEvent::Back(40_040 * MS))));
        assert_eq!((found[3], guard.jumps()), (frame(50_120, None), 1));
    }

    #[test]
    fn a_clock_that_is_set_ahead_is_bridged() {
        let (found, _) = feed(&[(5000, 0), (5040, 40), (905_080, 80), (905_120, 120)]);
        assert_eq!(found[2], frame(5080, Some(ClockEvent::Ahead(900_000 * MS))));
        assert_eq!(found[3], frame(5120, None));
    }

    #[test]
    fn the_most_extreme_stamps_do_not_overflow() {
        let (found, guard) = feed(&[(0, 0), (i64::MAX / MS, 33), (i64::MIN / MS, 66), (0, 99)]);
        assert!(found.iter().all(|admission| matches!(admission, Admission::Frame { .. })));
        assert_eq!(guard.jumps(), 3);
    }
}
