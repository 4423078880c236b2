//! The thread that makes packets of what the run has handed over.

use std::sync::Arc;

use crate::align::Truth;
use crate::cells::{Cells, Keyframe};
use crate::map::MapCopy;
use crate::moment::Moment;
use crate::shared::Shared;

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
        while let Some((index, work)) = self.next(turn) {
            turn = index + 1;
            let start_ns = work.start_ns;
            let frame = work.moment.map(|moment| moment.encode(&self.cells, start_ns));
            let patch = work.keyframe.and_then(|keyframe| self.cells.patch(&keyframe, start_ns));
            let copied = work.copy.map(|(number, copy)| {
                [copy.map_packet(number, start_ns), copy.path_packet(number, index, start_ns, &self.truth)]
            });
            self.shared.change(|state| {
                let Some(run) = state.runs.get_mut(index) else { return };
                run.is_encoding = false;
                if let Some(frame) = frame {
                    run.frame = Some(frame);
                }
                if let Some(patch) = patch {
                    run.keep_patch(patch);
                }
                if let Some([map, path]) = copied {
                    (run.map, run.path) = (Some(map), Some(path));
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
            let count = state.runs.len();
            let next = (turn..turn + count).map(|at| at % count).find(|index| !state.runs[*index].is_idle());
            if let Some(index) = next {
                let start_ns = state.start_ns.unwrap_or_default();
                let run = &mut state.runs[index];
                run.is_encoding = true;
                let (moment, keyframe) = (run.moment.take(), run.keyframes.pop_front());
                let copy = run.copy.take().map(|copy| (run.frames, copy));
                return Some((index, Work { moment, keyframe, copy, start_ns }));
            }
            state = self.shared.wait_long(state);
        }
    }
}

/// What waits to be encoded.
struct Work {
    moment: Option<Moment>,
    keyframe: Option<Keyframe>,
    copy: Option<(u64, MapCopy)>,
    start_ns: i64,
}
