//! The backend on a thread of its own, and the adjustment after a loop on another.
//!
//! ```text
//! tracking ──keyframe, sightings──► mapping ──copy of the map──► adjusting
//!     ▲                               │ ▲                            │
//!     └─────────── snapshot ──────────┘ └──────── adjusted copy ─────┘
//! ```
//!
//! One keyframe is under way at most, and one adjustment: a loop that is closed meanwhile calls it off and begins another.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use super::{Backend, Inserted};
use crate::image::RgbImage;
use crate::loops::{Recogniser, WholeAdjustment};
use crate::map::{KeyFrameId, Map};
use crate::tracking::{Sightings, TrackedFrame, TwoViewStart};

/// Requests that wait: a keyframe, an adjusted copy, and a few counts of sightings.
const QUEUE: usize = 4;
/// Answers that wait: those of a keyframe and of the adjustments before and after it.
const ANSWERS: usize = 4;
/// Sightings that are sent together.
const NOTE_AT: usize = 4000;

enum Request {
    Insert(Box<TrackedFrame>, Arc<RgbImage>),
    Begin(Box<TwoViewStart>),
    Note(Sightings),
    /// The adjustment of that number is done, or has ended by a panic.
    Adjusted(u64, Option<Box<WholeAdjustment>>),
    Forget(KeyFrameId),
    Reset,
    End,
    #[cfg(test)]
    Die,
}

/// The map after a request.
struct Answer {
    map: Arc<Map>,
    inserted: Option<Inserted>,
    /// Whether an adjustment is under way.
    adjusting: bool,
}

/// A backend on a thread of its own, seen from tracking.
pub struct BackendThread {
    /// `None` once the thread has ended.
    requests: Option<SyncSender<Request>>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
    pub(super) recogniser: Arc<Mutex<Recogniser>>,
    pub(super) snapshot: Arc<Map>,
    /// Number of the adjustment that is wanted: all others give up.
    wanted: Arc<AtomicU64>,
    pub(super) busy: bool,
    adjusting: bool,
}

impl BackendThread {
    pub(super) fn spawn(backend: Backend) -> std::io::Result<Self> {
        let (requests, inbox) = sync_channel(QUEUE);
        let (outbox, answers) = sync_channel(ANSWERS);
        let (recogniser, snapshot) = (backend.recogniser(), Arc::new(backend.map.clone()));
        let wanted = Arc::new(AtomicU64::new(0));
        let adjuster = Adjuster { wanted: wanted.clone(), done: requests.clone(), thread: None };
        let worker = Worker { backend, adjuster, outbox };
        let thread = std::thread::Builder::new().name("mapping".to_owned()).spawn(move || worker.work(&inbox))?;
        Ok(Self {
            requests: Some(requests),
            answers,
            thread: Some(thread),
            recogniser,
            snapshot,
            wanted,
            busy: false,
            adjusting: false,
        })
    }

    pub(super) fn insert(&mut self, frame: &TrackedFrame, color: &Arc<RgbImage>) {
        self.busy = true;
        self.send(Request::Insert(Box::new(frame.clone()), Arc::clone(color)));
    }

    pub(super) fn begin(&mut self, start: TwoViewStart) {
        self.busy = true;
        self.send(Request::Begin(Box::new(start)));
    }

    fn send(&mut self, request: Request) {
        let sent = self.requests.as_ref().is_some_and(|requests| requests.send(request).is_ok());
        if !sent {
            self.has_ended();
        }
    }

    /// Notes that the thread is gone. What is mapped stays usable; frames worth keeping count as passed over.
    fn has_ended(&mut self) {
        if self.requests.take().is_some() {
            tracing::error!("the mapping thread has ended by a panic: the map no longer grows");
        }
        self.busy = true;
        self.adjusting = false;
    }

    /// Whether the thread is at work.
    pub(super) fn is_alive(&self) -> bool {
        self.requests.is_some()
    }

    /// Takes the answers that are there.
    pub(super) fn poll(&mut self) -> Option<Inserted> {
        let mut inserted = None;
        loop {
            match self.answers.try_recv() {
                Ok(answer) => inserted = self.adopt(answer).or(inserted),
                Err(TryRecvError::Empty) => return inserted,
                Err(TryRecvError::Disconnected) => {
                    self.has_ended();
                    return inserted;
                }
            }
        }
    }

    /// Waits for the keyframe that is under way.
    pub(super) fn wait(&mut self) -> Option<Inserted> {
        self.wait_while(|thread| thread.busy)
    }

    /// Waits for the keyframe and the adjustment that are under way.
    pub(super) fn settle(&mut self) -> Option<Inserted> {
        self.wait_while(|thread| thread.busy || thread.adjusting)
    }

    fn wait_while(&mut self, under_way: impl Fn(&Self) -> bool) -> Option<Inserted> {
        let mut inserted = None;
        while self.is_alive() && under_way(self) {
            match self.answers.recv() {
                Ok(answer) => inserted = self.adopt(answer).or(inserted),
                Err(_) => self.has_ended(),
            }
        }
        inserted
    }

    fn adopt(&mut self, answer: Answer) -> Option<Inserted> {
        self.snapshot = answer.map;
        self.adjusting = answer.adjusting;
        if answer.inserted.is_some() {
            self.busy = false;
        }
        answer.inserted
    }

    pub(super) fn note(&mut self, sightings: &mut Sightings) {
        // Counts are not urgent: if the queue is full they wait for the next frame.
        if let Some(requests) = self.requests.as_ref().filter(|_| sightings.visible.len() >= NOTE_AT)
            && let Err(error) = requests.try_send(Request::Note(std::mem::take(sightings)))
            && let TrySendError::Full(Request::Note(back)) = error
        {
            *sightings = back;
        }
    }

    pub(super) fn forget(&mut self, root: KeyFrameId) {
        self.send(Request::Forget(root));
    }

    pub(super) fn reset(&mut self) {
        self.wait();
        self.send(Request::Reset);
        // Answers given before it still hold the old map.
        while self.is_alive() && self.snapshot.keyframe_count() > 0 {
            match self.answers.recv() {
                Ok(answer) => drop(self.adopt(answer)),
                Err(_) => self.has_ended(),
            }
        }
        self.snapshot = Arc::default();
    }
}

impl Drop for BackendThread {
    fn drop(&mut self) {
        self.wanted.fetch_add(1, Ordering::Relaxed);
        if let Some(requests) = self.requests.take() {
            // Whoever has ended already needs not be told.
            let _ = requests.send(Request::End);
        }
        if let Some(thread) = self.thread.take() {
            // A panic was reported by the thread already.
            let _ = thread.join();
        }
    }
}

/// What the thread does.
struct Worker {
    backend: Backend,
    adjuster: Adjuster,
    outbox: SyncSender<Answer>,
}

impl Worker {
    fn work(mut self, inbox: &Receiver<Request>) {
        for request in inbox {
            let inserted = match request {
                Request::Insert(mut frame, color) => {
                    // The map may have moved since the frame was tracked in a snapshot of it.
                    frame.follow_map(&self.backend.map);
                    let inserted = self.backend.insert(&frame, &color);
                    if let Some(closed) = &inserted.loop_closed {
                        self.adjuster.begin(&self.backend, closed.keyframe);
                    }
                    Some(inserted)
                }
                Request::Begin(start) => Some(self.backend.begin(&start)),
                Request::Adjusted(number, adjusted) => {
                    if !self.adjuster.is_wanted(number) {
                        continue;
                    }
                    if let Some(adjusted) = adjusted {
                        adjusted.merge(&self.backend.sensor, &mut self.backend.map);
                    }
                    self.adjuster.call_off();
                    None
                }
                Request::Reset => {
                    self.adjuster.call_off();
                    self.backend.reset();
                    None
                }
                Request::Note(sightings) => {
                    self.backend.note(&sightings);
                    continue;
                }
                Request::Forget(root) => {
                    self.backend.map.remove_submap(root);
                    continue;
                }
                Request::End => return,
                #[cfg(test)]
                Request::Die => std::panic::resume_unwind(Box::new("as a test asked for")),
            };
            let answer =
                Answer { map: Arc::new(self.backend.map.clone()), inserted, adjusting: self.adjuster.thread.is_some() };
            if self.outbox.send(answer).is_err() {
                return;
            }
        }
    }
}

/// Adjusts copies of the map, one at a time.
struct Adjuster {
    wanted: Arc<AtomicU64>,
    done: SyncSender<Request>,
    thread: Option<JoinHandle<()>>,
}

impl Adjuster {
    /// Begins to adjust the submap of `keyframe`, instead of what is under way.
    fn begin(&mut self, backend: &Backend, keyframe: KeyFrameId) {
        self.call_off();
        let Some(mut copy) = WholeAdjustment::copy(&backend.sensor, &backend.map, keyframe) else { return };
        let (config, wanted, done) = (backend.config.clone(), self.wanted.clone(), self.done.clone());
        let number = wanted.load(Ordering::Relaxed);
        let work = move || {
            let mut report = Report { number, done, adjusted: None };
            copy.adjust(&config.bundle, &|| wanted.load(Ordering::Relaxed) == number);
            report.adjusted = Some(Box::new(copy));
        };
        match std::thread::Builder::new().name("adjusting".to_owned()).spawn(work) {
            Ok(thread) => self.thread = Some(thread),
            Err(error) => {
                tracing::warn!(%error, "no thread to adjust the map on: the loop is closed by its pose graph alone")
            }
        }
    }

    fn is_wanted(&self, number: u64) -> bool {
        self.wanted.load(Ordering::Relaxed) == number
    }

    /// Lets what is under way come to nothing. Its thread ends by itself after the step that it is in.
    fn call_off(&mut self) {
        self.wanted.fetch_add(1, Ordering::Relaxed);
        self.thread = None;
    }
}

/// Tells of the end of an adjustment, however it ends.
struct Report {
    number: u64,
    done: SyncSender<Request>,
    adjusted: Option<Box<WholeAdjustment>>,
}

impl Drop for Report {
    fn drop(&mut self) {
        // If mapping has ended nobody needs it.
        let _ = self.done.send(Request::Adjusted(self.number, self.adjusted.take()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::geometry::se3_exp;
    use crate::map::scene::Scene;
    use nalgebra::Vector6;
    use std::time::{Duration, Instant};

    fn backend(scene: Scene, map: Map) -> Backend {
        Backend::new(Arc::new(scene.sensor), Arc::new(Config::default()), map)
    }

    #[test]
    fn the_death_of_the_thread_is_noticed_and_nobody_waits_for_it() {
        let mut thread = BackendThread::spawn(backend(Scene::new(), Map::default())).unwrap();
        assert!(thread.is_alive());
        thread.send(Request::Die);
        thread.insert(&TrackedFrame::default(), &Arc::default());
        assert!(thread.wait().is_none() && thread.settle().is_none() && thread.poll().is_none());
        assert!(!thread.is_alive() && thread.busy, "no keyframe is handed over any more");
        thread.reset();
    }

    /// A worker with a map to adjust, and what it sends its answers to.
    fn worker() -> (Worker, Receiver<Request>, Receiver<Answer>, Vec<KeyFrameId>) {
        let (scene, mut map) = (Scene::new(), Map::default());
        let mut ids = Vec::new();
        for k in 0..6 {
            let noise = se3_exp(&(Vector6::new(0.02, -0.01, 0.02, 0.0, 0.005, 0.0) * (k % 3) as f64));
            ids.push(scene.add(&mut map, k, &(noise * scene.pose(k)), &ids));
        }
        let (done, inbox) = sync_channel(QUEUE);
        let (outbox, answers) = sync_channel(ANSWERS);
        let adjuster = Adjuster { wanted: Arc::default(), done, thread: None };
        (Worker { backend: backend(scene, map), adjuster, outbox }, inbox, answers, ids)
    }

    #[test]
    fn an_adjustment_is_merged_unless_another_was_begun_since() {
        let (mut worker, inbox, answers, ids) = worker();
        let pose = |map: &Map| map.keyframe(ids[5]).unwrap().t_cam_world;
        let before = pose(&worker.backend.map);
        worker.adjuster.begin(&worker.backend, ids[5]);
        worker.adjuster.begin(&worker.backend, ids[5]);
        let (first, second) = (inbox.recv().unwrap(), inbox.recv().unwrap());
        let number = |request: &Request| if let Request::Adjusted(number, Some(_)) = request { *number } else { 0 };
        let (stale, wanted) = if number(&first) < number(&second) { (first, second) } else { (second, first) };
        let done = worker.adjuster.done.clone();
        for request in [stale, wanted, Request::End] {
            done.send(request).unwrap();
        }
        worker.work(&inbox);
        let answer = answers.recv().unwrap();
        assert!(pose(&answer.map) != before && !answer.adjusting && answer.inserted.is_none());
        assert!(answers.recv().is_err(), "the stale one is passed over");
    }

    #[test]
    fn shutdown_ends_while_the_map_is_adjusted() {
        for _ in 0..20 {
            let (mut worker, inbox, answers, ids) = worker();
            worker.adjuster.begin(&worker.backend, ids[5]);
            let requests = Some(worker.adjuster.done.clone());
            let (recogniser, wanted) = (worker.backend.recogniser(), worker.adjuster.wanted.clone());
            let snapshot = Arc::new(worker.backend.map.clone());
            let thread = Some(std::thread::spawn(move || worker.work(&inbox)));
            let (busy, adjusting) = (false, true);
            let started = Instant::now();
            drop(BackendThread { requests, answers, thread, recogniser, snapshot, wanted, busy, adjusting });
            assert!(started.elapsed() < Duration::from_secs(5));
        }
    }
}
