//! What the threads of the view share: the newest state of each run. It is bounded, and what is newer replaces what is older.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::cells::Keyframe;
use crate::map::MapCopy;
use crate::moment::Moment;
use crate::packet::{Numbered, Packet};

/// Patches of keyframes that are kept for viewers who come later.
const MAX_PATCHES: usize = 400;
/// Keyframes that wait for the encoder.
const MAX_WAITING: usize = 8;
/// Frames whose figures wait for the next frame that is encoded.
const MAX_TICKS: usize = 500;
/// Patches in one answer.
const PATCHES_AT_ONCE: usize = 8;
/// Time after which a viewer that does not ask counts no longer.
const GONE_AFTER: Duration = Duration::from_secs(3);

/// The state, and a signal for every change.
#[derive(Default)]
pub struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

/// The newest state.
#[derive(Default)]
pub struct State {
    pub runs: Vec<RunState>,
    pub control: Control,
    /// Number of the last change of the control.
    pub control_number: u64,
    pub connections: usize,
    /// Time stamp of the first frame, ns.
    pub start_ns: Option<i64>,
    /// When a viewer last asked for anything.
    pub asked: Option<Instant>,
    /// Whether the encoder shall not wait until a frame is due.
    pub hurries: bool,
    /// Whether there will be no more frames.
    pub ended: bool,
    /// Whether the threads shall end.
    pub closing: bool,
}

/// What viewers may ask of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Control {
    pub paused: bool,
    /// Frames that may pass although the run is paused.
    pub steps: u32,
    /// Multiple of the speed of the recording; 0 is as fast as possible.
    pub speed: f64,
}

/// The newest state of one run.
#[derive(Default)]
pub struct RunState {
    pub frame: Option<Numbered>,
    pub map: Option<Numbered>,
    pub path: Option<Numbered>,
    pub patches: VecDeque<Numbered>,
    /// The newest frame that is not encoded yet.
    pub moment: Option<Moment>,
    /// Keyframes whose points are not encoded yet.
    pub keyframes: VecDeque<Keyframe>,
    pub copy: Option<MapCopy>,
    pub frames: u64,
    /// When a viewer last asked for this run.
    pub asked: Option<Instant>,
    /// Before this instant the map is not copied again.
    pub next_copy: Option<Instant>,
    /// Before this instant no frame is encoded, unless the run is paused.
    pub next_frame: Option<Instant>,
    /// Number, time in seconds, inliers and duration in ms of frames since the last one that was encoded.
    pub ticks: Vec<[f64; 4]>,
    pub is_encoding: bool,
}

/// What a viewer has.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// The run that it shows; `None` while the page is hidden.
    pub run: Option<usize>,
    pub frame: u64,
    pub map: u64,
    pub patch: u64,
    pub control: u64,
    /// The newest trajectory of each run.
    pub paths: Vec<u64>,
}

impl Shared {
    pub fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state and wakes the other threads.
    pub fn change<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        let result = change(&mut self.lock());
        self.changed.notify_all();
        result
    }

    /// Waits for a change at most until `until`; returns `false` when that is over.
    pub fn wait<'a>(&self, state: MutexGuard<'a, State>, until: Instant) -> (MutexGuard<'a, State>, bool) {
        let left = until.saturating_duration_since(Instant::now());
        let (state, _) = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner);
        (state, !left.is_zero())
    }

    /// Waits for a change.
    pub fn wait_long<'a>(&self, state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Returns whether a viewer shows this run now.
    pub fn is_watched(&self, run: usize) -> bool {
        self.runs.get(run).is_some_and(|run| is_recent(run.asked))
    }

    /// Returns whether there is a viewer.
    pub fn has_viewer(&self) -> bool {
        is_recent(self.asked)
    }

    /// Returns the packets that a viewer does not have yet.
    pub fn newer(&self, seen: &Seen) -> Vec<Packet> {
        let is_newer = |numbered: &&Numbered, than: u64| numbered.number > than;
        let mut found: Vec<&Numbered> = Vec::new();
        if let Some(run) = seen.run.and_then(|run| self.runs.get(run)) {
            found.extend(run.frame.iter().filter(|frame| is_newer(frame, seen.frame)));
            found.extend(run.map.iter().filter(|map| is_newer(map, seen.map)));
            let patches = run.patches.iter().filter(|patch| is_newer(patch, seen.patch));
            found.extend(patches.take(PATCHES_AT_ONCE));
            for (index, run) in self.runs.iter().enumerate() {
                let than = seen.paths.get(index).copied().unwrap_or(0);
                found.extend(run.path.iter().filter(|path| is_newer(path, than)));
            }
        }
        found.into_iter().map(|numbered| numbered.packet.clone()).collect()
    }
}

impl RunState {
    /// Notes the figures of a frame that is not encoded; the oldest are forgotten.
    pub fn tick(&mut self, figures: [f64; 4]) {
        if self.ticks.len() >= MAX_TICKS {
            self.ticks.remove(0);
        }
        self.ticks.push(figures);
    }

    /// Takes a frame for the encoder; one that waits is replaced.
    pub fn offer(&mut self, moment: Moment) {
        self.moment = Some(moment);
    }

    /// Takes a keyframe for the encoder.
    pub fn offer_keyframe(&mut self, keyframe: Keyframe) {
        if self.keyframes.len() >= MAX_WAITING {
            self.keyframes.pop_front();
        }
        self.keyframes.push_back(keyframe);
    }

    /// Keeps the points of a keyframe.
    pub fn keep_patch(&mut self, patch: Numbered) {
        if self.patches.len() >= MAX_PATCHES {
            self.patches.pop_front();
        }
        self.patches.push_back(patch);
    }

    /// Returns whether the newest frame is to be encoded.
    pub fn is_frame_due(&self, at_once: bool) -> bool {
        self.moment.is_some() && (at_once || self.next_frame.is_none_or(|due| due <= Instant::now()))
    }

    /// Returns whether there is work for the encoder.
    pub fn is_due(&self, at_once: bool) -> bool {
        self.is_frame_due(at_once) || !self.keyframes.is_empty() || self.copy.is_some()
    }

    /// Returns whether nothing waits for the encoder.
    pub fn is_idle(&self) -> bool {
        self.moment.is_none() && self.keyframes.is_empty() && self.copy.is_none() && !self.is_encoding
    }
}

fn is_recent(asked: Option<Instant>) -> bool {
    asked.is_some_and(|asked| asked.elapsed() < GONE_AFTER)
}
