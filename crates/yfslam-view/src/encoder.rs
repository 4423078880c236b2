//! The thread that makes packets of what the run has handed over.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::align::Truth;
use crate::cells::{Cells, Keyframe};
use crate::map::MapCopy;
use crate::moment::Moment;
use crate::shared::Shared;

/// Frames are encoded so seldom that they take one of so many parts of the time of a processor core.
const FRAME_SHARE: u32 = 30;
/// The same for maps.
const MAP_SHARE: u32 = 100;

/// What the packets of all runs need.
pub struct Encoder {
    pub shared: Arc<Shared>,
    pub cells: Cells,
    pub truth: Truth,
}

impl Encoder {
    /// Makes packets until the view is closed.
    pub fn run(self) {
        let mut turn = 0;
        let mut images = Duration::ZERO;
        while let Some((index, work)) = self.next(turn) {
            turn = index + 1;
            let (start_ns, started) = (work.start_ns, Instant::now());
            let frame = work.moment.map(|moment| moment.encode(&work.ticks, &self.cells, start_ns));
            if frame.is_some() {
                images = started.elapsed();
            }
            let patch = work.keyframe.and_then(|keyframe| self.cells.patch(&keyframe, start_ns));
            let copied = work.copy.map(|(number, copy)| {
                [copy.map_packet(number, start_ns), copy.path_packet(number, index, start_ns, &self.truth)]
            });
            let (now, took) = (Instant::now(), started.elapsed());
            self.shared.change(|state| {
                let Some(run) = state.runs.get_mut(index) else { return };
                run.is_encoding = false;
                if let Some(frame) = frame {
                    run.frame = Some(frame);
                    run.next_frame = Some(now + images * FRAME_SHARE);
                }
                if let Some(patch) = patch {
                    run.keep_patch(patch);
                }
                if let Some([map, path]) = copied {
                    (run.map, run.path) = (Some(map), Some(path));
                    run.next_copy = run.next_copy.max(Some(now + took * MAP_SHARE));
                }
            });
        }
    }

    /// Waits for work and takes it, that of run `turn` first; `None` when the view is closed.
    fn next(&self, turn: usize) -> Option<(usize, Work)> {
        let mut state = self.shared.lock();
        loop {
            if state.closing {
                return None;
            }
            let (count, at_once) = (state.runs.len(), state.hurries || state.control.paused);
            let start_ns = state.start_ns.unwrap_or_default();
            let next = (turn..turn + count).map(|at| at % count).find(|index| state.runs[*index].is_due(at_once));
            if let Some(index) = next {
                let run = &mut state.runs[index];
                run.is_encoding = true;
                let moment = if run.is_frame_due(at_once) { run.moment.take() } else { None };
                let ticks = if moment.is_some() { std::mem::take(&mut run.ticks) } else { Vec::new() };
                let (keyframe, copy) = (run.keyframes.pop_front(), run.copy.take().map(|copy| (run.frames, copy)));
                return Some((index, Work { moment, ticks, keyframe, copy, start_ns }));
            }
            let waiting = state.runs.iter().filter(|run| run.moment.is_some());
            state = match waiting.filter_map(|run| run.next_frame).min() {
                Some(due) => self.shared.wait(state, due).0,
                None => self.shared.wait_long(state),
            };
        }
    }
}

/// What waits to be encoded.
struct Work {
    moment: Option<Moment>,
    ticks: Vec<[f64; 4]>,
    keyframe: Option<Keyframe>,
    copy: Option<(u64, MapCopy)>,
    start_ns: i64,
}
