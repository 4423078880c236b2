//! Tells when a camera is silent, and when it is back.

use std::time::{Duration, Instant};

/// Watches the arrivals of frames.
#[derive(Clone, Debug)]
pub struct Watchdog {
    /// A camera that sends nothing for longer is silent.
    patience: Duration,
    /// When the last frame came, or when watching began.
    last: Instant,
    is_silent: bool,
    has_come: bool,
    returns: u64,
}

/// What has changed about a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraEvent {
    /// No frame has come for so long.
    Silent(Duration),
    /// Frames come again after so long.
    Back(Duration),
}

impl Watchdog {
    /// Begins to watch at `now`.
    pub fn new(patience: Duration, now: Instant) -> Self {
        Self { patience, last: now, is_silent: false, has_come: false, returns: 0 }
    }

    /// Notes a frame that came at `now`; returns whether it ends a silence.
    pub fn frame(&mut self, now: Instant) -> Option<CameraEvent> {
        let silence = now.saturating_duration_since(self.last);
        let was_silent = std::mem::replace(&mut self.is_silent, false);
        let came_before = std::mem::replace(&mut self.has_come, true);
        self.last = now;
        if !(was_silent && came_before) {
            return None;
        }
        self.returns += 1;
        Some(CameraEvent::Back(silence))
    }

    /// Looks at the clock; returns the beginning of a silence once.
    pub fn check(&mut self, now: Instant) -> Option<CameraEvent> {
        let silence = self.silence(now);
        if self.is_silent || silence < self.patience {
            return None;
        }
        self.is_silent = true;
        Some(CameraEvent::Silent(silence))
    }

    /// Returns for how long no frame has come.
    pub fn silence(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.last)
    }

    /// Returns whether the camera is silent.
    pub fn is_silent(&self) -> bool {
        self.is_silent
    }

    /// Returns whether a frame has ever come.
    pub fn has_come(&self) -> bool {
        self.has_come
    }

    /// Returns how many times the camera came back.
    pub fn returns(&self) -> u64 {
        self.returns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_silence_is_told_once_and_so_is_its_end() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut watchdog = Watchdog::new(Duration::from_millis(500), start);
        assert_eq!((watchdog.check(at(400)), watchdog.frame(at(450))), (None, None));
        assert_eq!(watchdog.check(at(949)), None);
        assert_eq!(watchdog.check(at(960)), Some(CameraEvent::Silent(Duration::from_millis(510))));
        assert_eq!(watchdog.check(at(2000)), None);
        assert_eq!(watchdog.frame(at(2450)), Some(CameraEvent::Back(Duration::from_millis(2000))));
        assert_eq!((watchdog.frame(at(2480)), watchdog.returns()), (None, 1));
    }

    #[test]
    fn a_camera_that_starts_late_has_not_come_back() {
        let start = Instant::now();
        let mut watchdog = Watchdog::new(Duration::from_millis(500), start);
        assert!(watchdog.check(start + Duration::from_secs(9)).is_some() && !watchdog.has_come());
        assert_eq!((watchdog.frame(start + Duration::from_secs(10)), watchdog.returns()), (None, 0));
    }
}
