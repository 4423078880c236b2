//! The owner of the map: takes keyframes in, refines, closes loops; on the calling thread or on one of its own.
//!
//! In: tracked frames that are worth keeping. Out: the map, and what became of each. [`Execution::Inline`] does the work at once, so that
//! the same frames give the same bits. [`Execution::Threaded`] does it beside tracking, which reads the map as it was after the last
//! finished keyframe; while one is under way no other is taken, so no queue grows. Both run the same [`Backend`].

mod thread;

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::config::Config;
use crate::image::RgbImage;
use crate::loops::{LoopClosed, LoopCloser, Recogniser, WholeAdjustment};
use crate::map::{KeyFrameId, Map};
use crate::mapping::Mapper;
use crate::sensor::SensorModel;
use crate::tracking::{Sightings, TrackedFrame, TwoViewStart};
pub use thread::BackendThread;

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

    /// Takes a frame into the map. If that closes a loop, the map is left to be adjusted as a whole.
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

    /// Begins the map of a camera without depth.
    fn begin(&mut self, start: &TwoViewStart) -> Inserted {
        let started = Instant::now();
        let keyframe = self.mapper.begin(&self.sensor, &mut self.map, start);
        self.recogniser.lock().unwrap_or_else(PoisonError::into_inner).learn(&self.map, keyframe);
        Inserted { keyframe, loop_closed: None, mapping: started.elapsed(), places: Duration::ZERO }
    }

    /// Adjusts the whole submap of a keyframe.
    fn adjust_whole(&mut self, keyframe: KeyFrameId) {
        if let Some(mut whole) = WholeAdjustment::copy(&self.sensor, &self.map, keyframe) {
            whole.adjust(&self.config.bundle, &|| true);
            whole.merge(&self.sensor, &mut self.map);
        }
    }

    fn note(&mut self, sightings: &Sightings) {
        sightings.visible.iter().for_each(|id| self.map.count_visible(*id));
        sightings.found.iter().for_each(|id| self.map.count_found(*id));
        sightings.seen_through.iter().for_each(|id| self.map.note_seen_through(*id));
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

    /// Hands a keyframe over. What became of it, if that is known at once. The first of a submap is waited for: without it nothing can
    /// be tracked there.
    pub fn insert(&mut self, frame: &TrackedFrame, color: &Arc<RgbImage>, is_first: bool) -> Option<Inserted> {
        match self {
            Self::Inline(backend) => {
                let mut inserted = backend.insert(frame, color);
                if inserted.loop_closed.is_some() {
                    let started = Instant::now();
                    backend.adjust_whole(inserted.keyframe);
                    inserted.places += started.elapsed();
                }
                Some(inserted)
            }
            Self::Threaded(thread) => {
                thread.insert(frame, color);
                if is_first { thread.wait() } else { None }
            }
        }
    }

    /// Begins the map of a camera without depth, and waits for it. Returns what became of the second keyframe.
    pub fn begin(&mut self, start: TwoViewStart) -> Option<Inserted> {
        match self {
            Self::Inline(backend) => Some(backend.begin(&start)),
            Self::Threaded(thread) => {
                thread.begin(start);
                thread.wait()
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

    /// Waits until every keyframe handed over is in the map, and the map adjusted after the last loop.
    pub fn settle(&mut self) -> Option<Inserted> {
        match self {
            Self::Inline(_) => None,
            Self::Threaded(thread) => thread.settle(),
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

    /// Whether the map can still grow: false once a thread of its own has ended by a panic.
    pub fn is_alive(&self) -> bool {
        match self {
            Self::Inline(_) => true,
            Self::Threaded(thread) => thread.is_alive(),
        }
    }

    /// Gives the submap with that root up.
    pub fn forget(&mut self, root: KeyFrameId) {
        match self {
            Self::Inline(backend) => backend.map.remove_submap(root),
            Self::Threaded(thread) => thread.forget(root),
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
