//! Frames as they come: a sequence that is played at real time, or another program. A frame for which there is no time is dropped.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use yfslam::Frame;
use yfslam_io::time::format_stamp;
use yfslam_live::{Admission, CameraEvent, ClockEvent, ClockGuard, NewestReceiver, NewestSender, Taken, Watchdog};

use super::frames::Frames;
use crate::stats::skip::Skip;
use crate::stats::stages::Stages;
use crate::ui::interrupt::Interrupt;
use crate::ui::terminal::Terminal;

/// Longest time for which a signal waits.
const TICK: Duration = Duration::from_millis(50);
/// A camera that sends nothing for longer is silent.
const PATIENCE: Duration = Duration::from_secs(2);

/// Frames that another thread delivers when it is time for them.
pub struct LivePlayer {
    frames: NewestReceiver<(Frame, Instant)>,
    aside: Arc<Mutex<Aside>>,
    clock: ClockGuard,
    watchdog: Watchdog,
    /// Dropped frames that were reported.
    reported: u64,
    /// A frame that comes after reports of dropped ones.
    waiting: Option<(Frame, Instant)>,
    /// When the frame that is being tracked came.
    in_work: Option<Instant>,
    interrupt: Interrupt,
    terminal: Terminal,
}

/// What the reading thread reports beside its frames.
#[derive(Default)]
struct Aside {
    skips: Vec<Skip>,
    stages: Stages,
}

impl LivePlayer {
    /// Starts to play; at the rate 2, frames come twice as fast as they were recorded. Without a rate, they come as they are delivered.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn start(mut frames: Frames, rate: Option<f64>, interrupt: Interrupt, terminal: Terminal) -> Result<Self> {
        let (sender, receiver) = yfslam_live::newest_queue();
        let aside = Arc::new(Mutex::new(Aside::default()));
        let to = aside.clone();
        let play = move || play(&mut frames, rate, &sender, &to);
        thread::Builder::new().name("yfslam-live".into()).spawn(play).context("no thread for live frames")?;
        Ok(Self {
            frames: receiver,
            aside,
            clock: ClockGuard::default(),
            watchdog: Watchdog::new(PATIENCE, Instant::now()),
            reported: 0,
            waiting: None,
            in_work: None,
            interrupt,
            terminal,
        })
    }

    /// Waits for the next frame; returns `None` at the end, or after a signal.
    pub fn next(&mut self, stages: &mut Stages) -> Option<Result<Frame, Skip>> {
        if let Some(arrival) = self.in_work.take() {
            stages.push("latency", arrival.elapsed());
        }
        loop {
            if let Some(skip) = lock(&self.aside).skips.pop() {
                return Some(Err(skip));
            }
            if self.waiting.is_none() {
                self.waiting = match self.frames.take(TICK) {
                    Taken::Item(frame) => Some(frame),
                    Taken::TimedOut if self.interrupt.received().is_none() => {
                        self.warn_of_silence();
                        continue;
                    }
                    Taken::TimedOut | Taken::Ended => {
                        let rest = std::mem::take(&mut *lock(&self.aside));
                        *stages = stages.and(&rest.stages);
                        return None;
                    }
                };
            }
            if self.reported < self.frames.dropped() {
                self.reported += 1;
                let message = "a frame, because a newer one was there; the computer is too slow for this rate";
                return Some(Err(Skip { reason: "dropped for a newer frame", message: message.into() }));
            }
            if let Some((frame, arrival)) = self.waiting.take() {
                return Some(self.admit(frame, arrival));
            }
        }
    }

    /// Makes the stamp of a frame later than that of the one before.
    fn admit(&mut self, mut frame: Frame, arrival: Instant) -> Result<Frame, Skip> {
        if let Some(CameraEvent::Back(silence)) = self.watchdog.frame(arrival) {
            self.terminal.note(&format!("frames come again after {:.1} s", silence.as_secs_f64()));
        }
        let own_ns = frame.timestamp_ns;
        match self.clock.admit(own_ns, arrival) {
            Admission::Late { by_ns } => {
                let message =
                    format!("the frame at {}, which is {:.3} s late", format_stamp(own_ns), by_ns as f64 / 1e9);
                Err(Skip { reason: "late or repeated", message })
            }
            Admission::Frame { stamp_ns, event } => {
                if let Some(event) = event {
                    let (ClockEvent::Back(by_ns) | ClockEvent::Ahead(by_ns)) = event;
                    let way = if matches!(event, ClockEvent::Back(_)) { "back" } else { "ahead" };
                    self.terminal.warn(&format!(
                        "the clock of the camera jumped {way} by {:.3} s at {}; stamps in the files continue with the time that has passed",
                        by_ns as f64 / 1e9,
                        format_stamp(own_ns)
                    ));
                }
                let shift_ns = stamp_ns.saturating_sub(own_ns);
                frame.timestamp_ns = stamp_ns;
                frame.depth_timestamp_ns = frame.depth_timestamp_ns.map(|ns| ns.saturating_add(shift_ns));
                self.in_work = Some(arrival);
                Ok(frame)
            }
        }
    }

    fn warn_of_silence(&mut self) {
        if let Some(CameraEvent::Silent(silence)) = self.watchdog.check(Instant::now()) {
            self.terminal.warn(&format!("no frame for {:.1} s; the program waits for more", silence.as_secs_f64()));
        }
    }
}

/// Delivers the frames when it is time for them, until they end or are no longer wanted.
fn play(frames: &mut Frames, rate: Option<f64>, to: &NewestSender<(Frame, Instant)>, aside: &Mutex<Aside>) {
    let mut start = None;
    let mut stages = Stages::default();
    while let Some(frame) = frames.next(&mut stages) {
        match frame {
            Ok(frame) => {
                if let Some(rate) = rate {
                    let (began, first_ns) = *start.get_or_insert_with(|| (Instant::now(), frame.timestamp_ns));
                    let offset_s = frame.timestamp_ns.saturating_sub(first_ns).max(0) as f64 / 1e9 / rate;
                    let due = Duration::try_from_secs_f64(offset_s).ok().and_then(|offset| began.checked_add(offset));
                    if !due.is_some_and(|due| wait_until(due, to)) {
                        break;
                    }
                }
                to.put((frame, Instant::now()));
            }
            Err(skip) => lock(aside).skips.insert(0, skip),
        }
        if !to.is_open() {
            break;
        }
    }
    lock(aside).stages = stages;
}

/// Sleeps until a time; returns whether frames are still wanted.
fn wait_until(due: Instant, to: &NewestSender<(Frame, Instant)>) -> bool {
    loop {
        let left = due.saturating_duration_since(Instant::now());
        if left.is_zero() || !to.is_open() {
            return to.is_open();
        }
        thread::sleep(left.min(TICK));
    }
}

fn lock(aside: &Mutex<Aside>) -> MutexGuard<'_, Aside> {
    aside.lock().unwrap_or_else(PoisonError::into_inner)
}
