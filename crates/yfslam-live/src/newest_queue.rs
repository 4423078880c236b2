//! A queue of one item in which the newest wins: what waits is replaced, and the replacement is counted.
//!
//! The latency of what is taken is bounded by the time between two items and the time that the receiver needs for one.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Returns both ends of a queue of one item.
pub fn newest_queue<T>() -> (NewestSender<T>, NewestReceiver<T>) {
    let shared = Arc::new(Shared { state: Mutex::new(State::default()), changed: Condvar::new() });
    (NewestSender(shared.clone()), NewestReceiver(shared))
}

/// The end into which items are put. Dropping it ends the queue.
pub struct NewestSender<T>(Arc<Shared<T>>);

/// The end from which items are taken.
pub struct NewestReceiver<T>(Arc<Shared<T>>);

/// What [`NewestReceiver::take`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken<T> {
    /// The newest item.
    Item(T),
    /// Nothing came in time.
    TimedOut,
    /// Nothing will come any more.
    Ended,
}

struct Shared<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

struct State<T> {
    waiting: Option<T>,
    dropped: u64,
    sender_is_gone: bool,
    receiver_is_gone: bool,
}

impl<T> Default for State<T> {
    fn default() -> Self {
        Self { waiting: None, dropped: 0, sender_is_gone: false, receiver_is_gone: false }
    }
}

impl<T> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> NewestSender<T> {
    /// Puts an item in; returns whether an older one was dropped for it.
    pub fn put(&self, item: T) -> bool {
        let mut state = self.0.lock();
        let older = state.waiting.replace(item);
        state.dropped += u64::from(older.is_some());
        drop(state);
        self.0.changed.notify_one();
        older.is_some()
    }

    /// Returns whether the receiver is there to take items.
    pub fn is_open(&self) -> bool {
        !self.0.lock().receiver_is_gone
    }
}

impl<T> NewestReceiver<T> {
    /// Waits for an item, but no longer than `timeout`.
    pub fn take(&self, timeout: Duration) -> Taken<T> {
        let deadline = Instant::now() + timeout;
        let mut state = self.0.lock();
        loop {
            if let Some(item) = state.waiting.take() {
                return Taken::Item(item);
            }
            if state.sender_is_gone {
                return Taken::Ended;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Taken::TimedOut;
            }
            (state, _) = self.0.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Returns how many items were dropped because a newer one came.
    pub fn dropped(&self) -> u64 {
        self.0.lock().dropped
    }
}

impl<T> Drop for NewestSender<T> {
    fn drop(&mut self) {
        self.0.lock().sender_is_gone = true;
        self.0.changed.notify_one();
    }
}

impl<T> Drop for NewestReceiver<T> {
    fn drop(&mut self) {
        self.0.lock().receiver_is_gone = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOT_LONG: Duration = Duration::from_millis(1);

    #[test]
    fn the_newest_item_wins_and_the_others_are_counted() {
        let (sender, receiver) = newest_queue();
        assert_eq!([1, 2, 3].map(|item| sender.put(item)), [false, true, true]);
        assert_eq!(receiver.take(NOT_LONG), Taken::Item(3));
        assert_eq!((receiver.take(NOT_LONG), receiver.dropped()), (Taken::TimedOut, 2));
    }

    #[test]
    fn the_last_item_is_delivered_before_the_end() {
        let (sender, receiver) = newest_queue();
        sender.put(1);
        drop(sender);
        assert_eq!((receiver.take(NOT_LONG), receiver.take(NOT_LONG)), (Taken::Item(1), Taken::Ended));
    }

    #[test]
    fn the_sender_learns_that_the_receiver_is_gone() {
        let (sender, receiver) = newest_queue();
        assert!(sender.is_open());
        drop(receiver);
        assert!(!sender.is_open());
        sender.put(1);
    }

    #[test]
    fn an_item_wakes_a_receiver_that_waits() {
        let (sender, receiver) = newest_queue();
        let waiting = std::thread::spawn(move || receiver.take(Duration::from_secs(600)));
        sender.put(7);
        assert_eq!(waiting.join().ok(), Some(Taken::Item(7)));
    }
}
