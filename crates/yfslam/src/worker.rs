//! A thread with a bounded queue of requests: all threads of the system that take work one after another.
//!
//! ```text
//! owner ──requests (bounded)──► worker thread
//!   ▲                               │
//!   └───────answers (bounded)───────┘
//! ```
//!
//! One policy for panics: the panic ends the worker; its queues close; the owner is told by `false` and `None` and goes on without it;
//! an error is logged once. Dropping the owner ends the thread after the request that it is working on.

use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

/// Where mapping, loop closing and the dense map run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Execution {
    /// On the calling thread, at fixed points: the same bits on every run.
    #[default]
    Inline,
    /// On threads of their own: tracking never waits for them. Results depend on timing.
    Threaded,
}

/// Answers that can wait beyond the number of requests that can wait.
const SPARE_ANSWERS: usize = 2;

/// A thread that handles requests in order and may answer each. After warm-up no call allocates.
pub struct Worker<Q, A> {
    name: &'static str,
    /// `None` once the thread has ended.
    requests: Option<Requests<Q>>,
    /// The mutex is never locked: it makes the owner `Sync`.
    answers: Option<Mutex<Receiver<A>>>,
    thread: Option<JoinHandle<()>>,
}

/// The sending side of a worker's queue.
pub struct Requests<Q>(SyncSender<Message<Q>>);

enum Message<Q> {
    Work(Q),
    End,
}

impl<Q> Clone for Requests<Q> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<Q> Requests<Q> {
    /// Sends a request and waits while the queue is full. Returns whether the worker is there to handle it.
    pub fn send(&self, request: Q) -> bool {
        self.0.send(Message::Work(request)).is_ok()
    }
}

impl<Q: Send + 'static, A: Send + 'static> Worker<Q, A> {
    /// Starts a thread whose queue holds `capacity` requests. `handler` makes the function that handles a request; it receives the
    /// sending side of the queue, for work that the thread gives to others and whose result comes back as a request.
    ///
    /// # Errors
    /// If the operating system grants no thread.
    pub fn spawn<H>(
        name: &'static str,
        capacity: usize,
        handler: impl FnOnce(Requests<Q>) -> H,
    ) -> std::io::Result<Self>
    where
        H: FnMut(Q) -> Option<A> + Send + 'static,
    {
        let (requests, inbox) = sync_channel(capacity);
        let (outbox, answers) = sync_channel(capacity + SPARE_ANSWERS);
        let requests = Requests(requests);
        let mut handle = handler(requests.clone());
        let thread = Builder::new().name(name.to_owned()).spawn(move || {
            while let Ok(Message::Work(request)) = inbox.recv() {
                if let Some(answer) = handle(request)
                    && outbox.send(answer).is_err()
                {
                    return;
                }
            }
        })?;
        Ok(Self { name, requests: Some(requests), answers: Some(Mutex::new(answers)), thread: Some(thread) })
    }

    /// Sends a request and waits while the queue is full. Returns whether the worker is there to handle it.
    pub fn send(&mut self, request: Q) -> bool {
        let sent = self.requests.as_ref().is_some_and(|requests| requests.send(request));
        if !sent {
            self.note_end();
        }
        sent
    }

    /// Sends a request unless the queue is full or the worker has ended.
    ///
    /// # Errors
    /// The request, if it was not sent.
    pub(crate) fn try_send(&mut self, request: Q) -> Result<(), Q> {
        let Some(requests) = &self.requests else { return Err(request) };
        match requests.0.try_send(Message::Work(request)) {
            Err(TrySendError::Full(Message::Work(request))) => Err(request),
            Err(TrySendError::Disconnected(Message::Work(request))) => {
                self.note_end();
                Err(request)
            }
            _ => Ok(()),
        }
    }

    /// Waits for the next answer; `None` if the worker has ended.
    pub fn wait(&mut self) -> Option<A> {
        let answers = self.answers.as_mut()?.get_mut().unwrap_or_else(PoisonError::into_inner);
        let answer = answers.recv().ok();
        if answer.is_none() {
            self.note_end();
        }
        answer
    }

    /// Returns the next answer, if there is one.
    pub(crate) fn poll(&mut self) -> Option<A> {
        let answers = self.answers.as_mut()?.get_mut().unwrap_or_else(PoisonError::into_inner);
        match answers.try_recv() {
            Ok(answer) => Some(answer),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.note_end();
                None
            }
        }
    }

    /// Returns whether the worker can take requests; a panic that was not yet noticed does not count.
    pub(crate) fn is_alive(&self) -> bool {
        self.requests.is_some()
    }

    fn note_end(&mut self) {
        if self.requests.take().is_some() {
            tracing::error!("the {} thread has ended by a panic; the program continues without it", self.name);
        }
    }
}

impl<Q, A> Drop for Worker<Q, A> {
    fn drop(&mut self) {
        // A worker that waits to answer must not wait for ever.
        self.answers = None;
        if let Some(requests) = self.requests.take() {
            // The thread may have ended already.
            let _ = requests.0.send(Message::End);
        }
        if let Some(thread) = self.thread.take() {
            // The panic of a thread was reported by the thread.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_answered_in_order() {
        let mut worker = Worker::spawn("test", 2, |_| |n: u32| Some(n * n)).unwrap();
        for n in 0..50 {
            assert!(worker.send(n));
            assert_eq!(worker.wait(), Some(n * n));
        }
        assert_eq!(worker.poll(), None);
    }

    #[test]
    fn a_panic_ends_the_worker_and_its_owner_goes_on() {
        let handler = |_| {
            |fails: bool| -> Option<()> {
                if fails {
                    std::panic::resume_unwind(Box::new("as the test asks for"));
                }
                Some(())
            }
        };
        let mut worker = Worker::spawn("test", 1, handler).unwrap();
        assert!(worker.send(false) && worker.wait() == Some(()) && worker.is_alive());
        worker.send(true);
        assert_eq!(worker.wait(), None);
        assert!(!worker.is_alive() && !worker.send(false) && worker.try_send(false) == Err(false));
        assert_eq!((worker.wait(), worker.poll()), (None, None));
    }

    #[test]
    fn a_full_queue_gives_the_request_back() {
        let (release, gate) = sync_channel::<()>(0);
        let mut worker = Worker::spawn("test", 1, |_| move |n: u32| gate.recv().ok().map(|()| n)).unwrap();
        assert!(worker.send(0));
        let sent = (1..100).find(|n| worker.try_send(*n).is_err()).unwrap();
        assert!(sent <= 3, "one is handled and one waits");
        drop(release);
    }

    #[test]
    fn dropping_the_owner_ends_a_worker_whose_answers_were_not_taken() {
        let mut worker = Worker::spawn("test", 1, |_| |n: u32| Some(n)).unwrap();
        for n in 0..3 {
            worker.send(n);
        }
        drop(worker);
    }
}
