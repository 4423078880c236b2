//! Messages on standard error, which can neither end nor hold up the program: a thread writes them.
//!
//! In: lines. Out: the same lines, in the same order, on standard error. It may be closed, on a full disk, or a pipe that is not read;
//! then lines are left out, and the results of the program do not depend on it.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::{Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

/// Lines that wait to be written.
const CAPACITY: usize = 4096;
/// Time without any progress after which standard error counts as stuck.
const PATIENCE: Duration = Duration::from_secs(1);

/// Lines on their way to standard error.
struct Messages {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Vec<u8>>,
    /// Whether the thread is writing a line.
    is_writing: bool,
    /// Number of lines that were written.
    written: usize,
    /// Lines left out since the last one that was written.
    left_out: usize,
    /// Standard error is not read: no thread waits for it until it is.
    is_stuck: bool,
}

/// Writes a message, whole lines with their ends.
pub fn write(lines: Vec<u8>) {
    match messages() {
        Some(messages) => messages.push(lines),
        // There is no thread; an error of standard error has no other place to be reported.
        None => drop(io::stderr().lock().write_all(&lines)),
    }
}

/// Waits until all messages are written, unless standard error is stuck.
pub fn flush() {
    if let Some(Some(messages)) = MESSAGES.get() {
        messages.flush();
    }
}

/// Each write is a message; it never fails.
#[derive(Clone, Copy, Debug)]
pub struct MessageWriter;

impl Write for MessageWriter {
    fn write(&mut self, lines: &[u8]) -> io::Result<usize> {
        write(lines.to_vec());
        Ok(lines.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

static MESSAGES: OnceLock<Option<&'static Messages>> = OnceLock::new();

/// Starts the thread with the first message; `None` if it cannot be started.
fn messages() -> Option<&'static Messages> {
    *MESSAGES.get_or_init(|| {
        let messages: &'static Messages =
            Box::leak(Box::new(Messages { state: Mutex::default(), changed: Condvar::new() }));
        let thread = std::thread::Builder::new().name("yfslam-messages".into());
        thread.spawn(|| messages.write_to(&mut io::stderr())).ok().map(|_| messages)
    })
}

impl Messages {
    fn push(&self, lines: Vec<u8>) {
        let mut state = self.lock();
        if state.waiting.len() >= CAPACITY && !state.is_stuck {
            state = self.wait_for(state, |state| state.waiting.len() < CAPACITY);
        }
        if state.waiting.len() >= CAPACITY {
            state.left_out += 1;
        } else {
            state.waiting.push_back(lines);
            self.changed.notify_all();
        }
    }

    fn flush(&self) {
        let state = self.lock();
        if !state.is_stuck {
            drop(self.wait_for(state, |state| state.waiting.is_empty() && !state.is_writing));
        }
    }

    /// Waits while lines are written; after a time without progress standard error is stuck.
    fn wait_for<'a>(
        &'a self,
        mut state: MutexGuard<'a, State>,
        is_reached: impl Fn(&State) -> bool,
    ) -> MutexGuard<'a, State> {
        while !is_reached(&state) && !state.is_stuck {
            let before = state.written;
            let unchanged = |state: &mut State| state.written == before && !is_reached(state);
            let (now, result) =
                self.changed.wait_timeout_while(state, PATIENCE, unchanged).unwrap_or_else(PoisonError::into_inner);
            state = now;
            state.is_stuck |= result.timed_out();
        }
        state
    }

    /// Writes the lines one after the other, for ever.
    fn write_to(&self, out: &mut impl Write) {
        let mut state = self.lock();
        loop {
            let Some(lines) = state.waiting.pop_front() else {
                state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            state.is_writing = true;
            drop(state);
            // There is no other place to report that standard error cannot be written.
            let _ = out.write_all(&lines);
            state = self.lock();
            state.is_writing = false;
            state.is_stuck = false;
            state.written += 1;
            match std::mem::take(&mut state.left_out) {
                0 => {}
                count => {
                    let note = format!("note: {count} messages were left out, because standard error was not read\n");
                    state.waiting.push_back(note.into_bytes());
                }
            }
            self.changed.notify_all();
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
