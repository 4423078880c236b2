//! Mapping and loop closing, with the map that they own; on the calling thread or on one of their own.
//!
//! In: tracked frames that become keyframes. Out: the map, and what each keyframe led to. [`Execution::Inline`] does the work at once, so
//! that the same frames give the same bits. [`Execution::Threaded`] does it beside tracking, which reads the map as it was after the last
//! finished keyframe; while one is under way no other is taken, so no queue grows. Both run the same [`Backend`].

#[cfg(test)]
mod growth;
mod mapping_worker;

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::context::Context;
use crate::features::rolling_shutter::{FrameTimes, Velocity};
use crate::image::RgbImage;
use crate::loops::{GlobalBundle, LoopCloser, LoopClosure, PlaceRecogniser};
use crate::map::{KeyFrameId, Map};
use crate::mapping::{Mapper, retime, retime_all};
use crate::tracking::{ObservationCounts, TrackedFrame, TwoViewMap};
use crate::worker::Execution;
use mapping_worker::MappingWorker;

/// What the insertion of a keyframe led to.
#[derive(Clone, Debug)]
pub(crate) struct Inserted {
    /// The keyframe.
    pub keyframe: KeyFrameId,
    /// The loop that it closed.
    pub loop_closure: Option<LoopClosure>,
    /// Time for landmarks and local bundle adjustment.
    pub mapping: Duration,
    /// Time for place recognition and loop closing.
    pub loops: Duration,
}

/// The map and everything that changes it.
#[derive(Clone, Debug)]
pub(crate) struct Backend {
    context: Arc<Context>,
    map: Map,
    mapper: Mapper,
    recogniser: Arc<Mutex<PlaceRecogniser>>,
    loops: LoopCloser,
    /// The keyframe inserted last.
    latest: Option<KeyFrameId>,
}

impl Backend {
    /// Takes a map over and enters its keyframes for place recognition.
    pub(crate) fn new(context: Arc<Context>, map: Map) -> Self {
        let mut recogniser = PlaceRecogniser::default();
        for (id, _) in map.keyframes() {
            recogniser.add_keyframe(&map, id);
        }
        let recogniser = Arc::new(Mutex::new(recogniser));
        Self { context, map, mapper: Mapper::default(), recogniser, loops: LoopCloser::default(), latest: None }
    }

    /// Place recognition, shared with relocalisation.
    fn recogniser(&self) -> Arc<Mutex<PlaceRecogniser>> {
        Arc::clone(&self.recogniser)
    }

    /// Inserts a frame as a keyframe. If that closes a loop, global bundle adjustment is left to the caller.
    fn insert(&mut self, frame: &TrackedFrame, color: &RgbImage) -> Inserted {
        let started = Instant::now();
        let keyframe = self.mapper.insert(&self.context, &mut self.map, frame, color);
        self.latest = Some(keyframe);
        let mapping = started.elapsed();
        // A panic elsewhere left the index usable: at worst it lacks a landmark.
        self.recogniser.lock().unwrap_or_else(PoisonError::into_inner).add_keyframe(&self.map, keyframe);
        let mut loop_closure = None;
        if self.context.config.loops.enabled {
            loop_closure = self.loops.close(&self.context, &self.recogniser, &mut self.map, keyframe);
        }
        Inserted { keyframe, loop_closure, mapping, loops: started.elapsed() - mapping }
    }

    /// Begins the map of a camera without depth.
    fn begin(&mut self, start: &TwoViewMap) -> Inserted {
        let started = Instant::now();
        let keyframe = self.mapper.begin(&self.context.sensor, &mut self.map, start);
        self.latest = Some(keyframe);
        self.recogniser.lock().unwrap_or_else(PoisonError::into_inner).add_keyframe(&self.map, keyframe);
        Inserted { keyframe, loop_closure: None, mapping: started.elapsed(), loops: Duration::ZERO }
    }

    /// Corrects the keyframe inserted last for the velocity that the next frame showed, if it is the frame of that time.
    fn retime(&mut self, timestamp_ns: i64, velocity: &Velocity) {
        if let Some(latest) = self.latest
            && self.map.keyframe(latest).is_some_and(|k| k.timestamp_ns == timestamp_ns)
        {
            retime(&self.context, &mut self.map, latest, velocity);
        }
    }

    /// Corrects all keyframes once it is known how the rows of their images are read.
    fn set_row_times(&mut self, times: &FrameTimes) {
        retime_all(&self.context, &mut self.map, times);
        if let Some(latest) = self.latest {
            self.adjust_submap(latest);
        }
    }

    /// Adjusts the whole submap of a keyframe.
    fn adjust_submap(&mut self, keyframe: KeyFrameId) {
        if let Some(mut bundle) = GlobalBundle::copy(&self.context.sensor, &self.map, keyframe) {
            bundle.adjust(&self.context.config.bundle, &|| true);
            bundle.merge(&self.context.sensor, &mut self.map);
        }
    }

    fn count(&mut self, counts: &ObservationCounts) {
        counts.visible.iter().for_each(|id| self.map.count_visible(*id));
        counts.found.iter().for_each(|id| self.map.count_found(*id));
        counts.in_free_space.iter().for_each(|id| self.map.count_free_space(*id));
    }

    /// Begins anew with an empty map.
    fn reset(&mut self) {
        self.map = Map::default();
        self.mapper.reset();
        self.latest = None;
        self.loops.reset();
        self.recogniser.lock().unwrap_or_else(PoisonError::into_inner).reset();
    }
}

/// The owner of the map, on the calling thread or on its own.
pub(crate) enum MapOwner {
    /// On the calling thread.
    Inline(Box<Backend>),
    /// On its own thread.
    Threaded(MappingWorker),
}

impl MapOwner {
    /// Puts a backend where `execution` says.
    ///
    /// # Errors
    /// If the operating system grants no thread.
    pub(crate) fn new(backend: Backend, execution: Execution) -> std::io::Result<Self> {
        Ok(match execution {
            Execution::Inline => Self::Inline(Box::new(backend)),
            Execution::Threaded => Self::Threaded(MappingWorker::spawn(backend)?),
        })
    }

    /// The map: as it is, or as it was after the last keyframe that is finished.
    pub(crate) fn map(&self) -> &Map {
        match self {
            Self::Inline(backend) => &backend.map,
            Self::Threaded(worker) => &worker.snapshot,
        }
    }

    /// Place recognition.
    pub(crate) fn recogniser(&self) -> Arc<Mutex<PlaceRecogniser>> {
        match self {
            Self::Inline(backend) => backend.recogniser(),
            Self::Threaded(worker) => Arc::clone(&worker.recogniser),
        }
    }

    /// Returns whether a keyframe would be taken now.
    pub(crate) fn is_free(&self) -> bool {
        match self {
            Self::Inline(_) => true,
            Self::Threaded(worker) => !worker.busy,
        }
    }

    /// Hands a keyframe over. Returns the result if it is known at once. The first keyframe of a submap is waited for: without it no
    /// frame can be tracked there.
    pub(crate) fn insert(&mut self, frame: &TrackedFrame, color: &Arc<RgbImage>, is_first: bool) -> Option<Inserted> {
        match self {
            Self::Inline(backend) => {
                let mut inserted = backend.insert(frame, color);
                if inserted.loop_closure.is_some() {
                    let started = Instant::now();
                    backend.adjust_submap(inserted.keyframe);
                    inserted.loops += started.elapsed();
                }
                Some(inserted)
            }
            Self::Threaded(worker) => {
                worker.insert(frame, color);
                if is_first { worker.wait() } else { None }
            }
        }
    }

    /// Begins the map of a camera without depth, and waits for it. Returns what the second keyframe led to.
    pub(crate) fn begin(&mut self, start: TwoViewMap) -> Option<Inserted> {
        match self {
            Self::Inline(backend) => Some(backend.begin(&start)),
            Self::Threaded(worker) => {
                worker.begin(start);
                worker.wait()
            }
        }
    }

    /// Corrects the keyframe of that time for its velocity, if it was inserted last.
    pub(crate) fn retime(&mut self, timestamp_ns: i64, velocity: &Velocity) {
        match self {
            Self::Inline(backend) => backend.retime(timestamp_ns, velocity),
            Self::Threaded(worker) => worker.retime(timestamp_ns, velocity),
        }
    }

    /// Corrects all keyframes once it is known how the rows of their images are read.
    pub(crate) fn set_row_times(&mut self, times: &FrameTimes) {
        match self {
            Self::Inline(backend) => backend.set_row_times(times),
            Self::Threaded(worker) => worker.set_row_times(times),
        }
    }

    /// Returns what a keyframe handed over earlier led to, if that is known by now.
    pub(crate) fn poll(&mut self) -> Option<Inserted> {
        match self {
            Self::Inline(_) => None,
            Self::Threaded(worker) => worker.poll(),
        }
    }

    /// Waits until every keyframe handed over is in the map, and the map is adjusted after the last loop.
    pub(crate) fn finish(&mut self) -> Option<Inserted> {
        match self {
            Self::Inline(_) => None,
            Self::Threaded(worker) => worker.finish(),
        }
    }

    /// Counts which landmarks a frame had in view and which it matched; takes them out of `counts`.
    pub(crate) fn count(&mut self, counts: &mut ObservationCounts) {
        match self {
            Self::Inline(backend) => {
                backend.count(counts);
                counts.clear();
            }
            Self::Threaded(worker) => worker.count(counts),
        }
    }

    /// Returns whether the map can still grow: false once a thread of its own has ended by a panic.
    pub(crate) fn is_alive(&self) -> bool {
        match self {
            Self::Inline(_) => true,
            Self::Threaded(worker) => worker.is_alive(),
        }
    }

    /// Removes the submap with that root.
    pub(crate) fn remove_submap(&mut self, root: KeyFrameId) {
        match self {
            Self::Inline(backend) => backend.map.remove_submap(root),
            Self::Threaded(worker) => worker.remove_submap(root),
        }
    }

    /// Begins anew with an empty map.
    pub(crate) fn reset(&mut self) {
        match self {
            Self::Inline(backend) => backend.reset(),
            Self::Threaded(worker) => worker.reset(),
        }
    }
}
