//! The owner of the map: takes keyframes in, refines, closes loops; on the calling thread or on one of its own.
//!
//! In: tracked frames that are worth keeping. Out: the map, and what became of each. [`Execution::Inline`] does the work at once, so that
//! the same frames give the same bits. [`Execution::Threaded`] does it beside tracking, which reads the map as it was after the last
//! finished keyframe; while one is under way no other is taken, so no queue grows. Both run the same [`Backend`].

use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::config::Config;
use crate::image::RgbImage;
use crate::loops::{LoopClosed, LoopCloser, Recogniser};
use crate::map::{KeyFrameId, Map};
use crate::mapping::Mapper;
use crate::sensor::SensorModel;
use crate::tracking::{Sightings, TrackedFrame};

/// Where mapping and loop closing run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Execution {
    /// On the calling thread, at fixed points: the same bits on every run.
    #[default]
    Inline,
    /// On a thread of their own: tracking never waits for them. Results depend on timing.
    Threaded,
}

/// What became of a keyframe.
#[derive(Clone, Debug)]
pub struct Inserted {
    /// The keyframe.
    pub keyframe: KeyFrameId,
    /// The loop that it closed.
    pub loop_closed: Option<LoopClosed>,
    /// Time for landmarks and local bundle adjustment.
    pub mapping: Duration,
    /// Time for place recognition and loop closing.
    pub places: Duration,
}

/// The map and all that changes it.
#[derive(Clone, Debug)]
pub struct Backend {
    sensor: Arc<SensorModel>,
    config: Arc<Config>,
    map: Map,
    mapper: Mapper,
    recogniser: Arc<Mutex<Recogniser>>,
    loops: LoopCloser,
}

impl Backend {
    /// The owner of `map`, whose places it learns.
    pub fn new(sensor: Arc<SensorModel>, config: Arc<Config>, map: Map) -> Self {
        let mut recogniser = Recogniser::default();
        for (id, _) in map.keyframes() {
            recogniser.learn(&map, id);
        }
        let recogniser = Arc::new(Mutex::new(recogniser));
        Self { sensor, config, map, mapper: Mapper::default(), recogniser, loops: LoopCloser::default() }
    }

    /// What recognises places, shared with whoever is lost.
    fn recogniser(&self) -> Arc<Mutex<Recogniser>> {
        Arc::clone(&self.recogniser)
    }

    /// Takes a frame into the map.
    fn insert(&mut self, frame: &TrackedFrame, color: &RgbImage) -> Inserted {
        let started = Instant::now();
        let keyframe = self.mapper.insert(&self.sensor, &self.config, &mut self.map, frame, color);
        let mapping = started.elapsed();
        // A panic elsewhere left the index usable: at worst it lacks a landmark.
        self.recogniser.lock().unwrap_or_else(PoisonError::into_inner).learn(&self.map, keyframe);
        let mut loop_closed = None;
        if self.config.loops.enabled {
            loop_closed = self.loops.close(&self.sensor, &self.config, &self.recogniser, &mut self.map, keyframe);
        }
        Inserted { keyframe, loop_closed, mapping, places: started.elapsed() - mapping }
    }

    fn note(&mut self, sightings: &Sightings) {
        sightings.visible.iter().for_each(|id| self.map.count_visible(*id));
        sightings.found.iter().for_each(|id| self.map.count_found(*id));
    }

    /// Begins anew with an empty map.
    fn reset(&mut self) {
        self.map = Map::default();
        self.mapper.reset();
        self.loops.reset();
        self.recogniser.lock().unwrap_or_else(PoisonError::into_inner).reset();
    }
}

/// A backend, here or on its thread.
pub enum MapOwner {
    /// Here.
    Inline(Box<Backend>),
    /// On its thread.
    Threaded(BackendThread),
}

impl MapOwner {
    /// Sets a backend to work.
    ///
    /// # Errors
    /// If the operating system grants no thread.
    pub fn new(backend: Backend, execution: Execution) -> std::io::Result<Self> {
        Ok(match execution {
            Execution::Inline => Self::Inline(Box::new(backend)),
            Execution::Threaded => Self::Threaded(BackendThread::spawn(backend)?),
        })
    }

    /// The map: as it is, or as it was after the last keyframe that is finished.
    pub fn map(&self) -> &Map {
        match self {
            Self::Inline(backend) => &backend.map,
            Self::Threaded(thread) => &thread.snapshot,
        }
    }

    /// What recognises places.
    pub fn recogniser(&self) -> Arc<Mutex<Recogniser>> {
        match self {
            Self::Inline(backend) => backend.recogniser(),
            Self::Threaded(thread) => Arc::clone(&thread.recogniser),
        }
    }

    /// Whether a keyframe would be taken now.
    pub fn is_free(&self) -> bool {
        match self {
            Self::Inline(_) => true,
            Self::Threaded(thread) => !thread.busy,
        }
    }

    /// Hands a keyframe over. What became of it, if that is known at once.
    pub fn insert(&mut self, frame: &TrackedFrame, color: &Arc<RgbImage>) -> Option<Inserted> {
        match self {
            Self::Inline(backend) => Some(backend.insert(frame, color)),
            Self::Threaded(thread) => {
                thread.insert(frame, color);
                // Nothing can be tracked in an empty map: the first keyframe is waited for.
                if thread.snapshot.keyframe_count() == 0 { thread.wait() } else { None }
            }
        }
    }

    /// What became of a keyframe handed over earlier, if that is known by now.
    pub fn poll(&mut self) -> Option<Inserted> {
        match self {
            Self::Inline(_) => None,
            Self::Threaded(thread) => thread.poll(),
        }
    }

    /// Waits until every keyframe handed over is in the map.
    pub fn settle(&mut self) -> Option<Inserted> {
        match self {
            Self::Inline(_) => None,
            Self::Threaded(thread) => thread.wait(),
        }
    }

    /// Counts which landmarks a frame should have seen and which it saw; takes them out of `sightings`.
    pub fn note(&mut self, sightings: &mut Sightings) {
        match self {
            Self::Inline(backend) => {
                backend.note(sightings);
                sightings.clear();
            }
            Self::Threaded(thread) => thread.note(sightings),
        }
    }

    /// Begins anew with an empty map.
    pub fn reset(&mut self) {
        match self {
            Self::Inline(backend) => backend.reset(),
            Self::Threaded(thread) => thread.reset(),
        }
    }
}

enum Request {
    Insert(Box<TrackedFrame>, Arc<RgbImage>),
    Note(Sightings),
    Reset,
}

/// A backend on a thread of its own.
pub struct BackendThread {
    /// `None` once the thread was told to end.
    requests: Option<SyncSender<Request>>,
    answers: Receiver<(Arc<Map>, Inserted)>,
    thread: Option<JoinHandle<()>>,
    recogniser: Arc<Mutex<Recogniser>>,
    snapshot: Arc<Map>,
    busy: bool,
}

/// Requests that wait: a keyframe, and a few counts of sightings.
const QUEUE: usize = 4;

impl BackendThread {
    fn spawn(mut backend: Backend) -> std::io::Result<Self> {
        let (requests, inbox) = sync_channel(QUEUE);
        // One keyframe is under way at most: its answer always finds room.
        let (outbox, answers) = sync_channel(1);
        let (recogniser, snapshot) = (backend.recogniser(), Arc::new(backend.map.clone()));
        let work = move || {
            for request in inbox {
                match request {
                    Request::Insert(mut frame, color) => {
                        // The map may have moved since the frame was tracked in a snapshot of it.
                        frame.follow_map(&backend.map);
                        let inserted = backend.insert(&frame, &color);
                        if outbox.send((Arc::new(backend.map.clone()), inserted)).is_err() {
                            return;
                        }
                    }
                    Request::Note(sightings) => backend.note(&sightings),
                    Request::Reset => backend.reset(),
                }
            }
        };
        let thread = std::thread::Builder::new().name("mapping".to_owned()).spawn(work)?;
        Ok(Self { requests: Some(requests), answers, thread: Some(thread), recogniser, snapshot, busy: false })
    }

    fn insert(&mut self, frame: &TrackedFrame, color: &Arc<RgbImage>) {
        self.busy = true;
        self.send(Request::Insert(Box::new(frame.clone()), Arc::clone(color)));
    }

    fn send(&mut self, request: Request) {
        let sent = self.requests.as_ref().is_some_and(|requests| requests.send(request).is_ok());
        if !sent {
            // The thread has ended by a panic, which it reported; what is mapped stays usable.
            self.requests = None;
        }
    }

    fn poll(&mut self) -> Option<Inserted> {
        match self.answers.try_recv() {
            Ok(answer) => Some(self.adopt(answer)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                if self.requests.take().is_some() {
                    tracing::error!("the mapping thread has ended by a panic: the map no longer grows");
                }
                // No more keyframes are handed over; they count as passed over.
                self.busy = true;
                None
            }
        }
    }

    fn wait(&mut self) -> Option<Inserted> {
        if !self.busy {
            return None;
        }
        let answer = self.answers.recv().ok()?;
        Some(self.adopt(answer))
    }

    fn adopt(&mut self, (map, inserted): (Arc<Map>, Inserted)) -> Inserted {
        self.snapshot = map;
        self.busy = false;
        inserted
    }

    fn note(&mut self, sightings: &mut Sightings) {
        // Counts are not urgent: if the queue is full they wait for the next frame.
        if let Some(requests) = self.requests.as_ref().filter(|_| sightings.visible.len() >= NOTE_AT)
            && let Err(error) = requests.try_send(Request::Note(std::mem::take(sightings)))
            && let std::sync::mpsc::TrySendError::Full(Request::Note(back)) = error
        {
            *sightings = back;
        }
    }

    fn reset(&mut self) {
        self.wait();
        self.send(Request::Reset);
        self.snapshot = Arc::default();
    }
}

/// Sightings that are sent together.
const NOTE_AT: usize = 4000;

impl Drop for BackendThread {
    fn drop(&mut self) {
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // A panic was reported by the thread already.
            let _ = thread.join();
        }
    }
}
