//! The backend on a thread of its own, and global bundle adjustment after a loop on another.
//!
//! ```text
//! tracking ──keyframe, counts──► mapping ──copy of the map──► global bundle adjustment
//!     ▲                            │ ▲                            │
//!     └──────── snapshot ──────────┘ └─────── adjusted copy ──────┘
//! ```
//!
//! One keyframe is under way at most, and one adjustment: a loop that is closed meanwhile cancels it and starts another.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use super::{Backend, Inserted};
use crate::features::rolling_shutter::{FrameTimes, Velocity};
use crate::image::RgbImage;
use crate::loops::{GlobalBundle, PlaceRecogniser};
use crate::map::{KeyFrameId, Map};
use crate::tracking::{ObservationCounts, TrackedFrame, TwoViewMap};
use crate::worker::{Requests, Worker};

/// Requests that can wait: a keyframe, its velocity, the row times, an adjusted copy, and a few observation counts.
const QUEUE: usize = 6;
/// Observation counts that are sent together.
const SEND_COUNTS_AT: usize = 4000;

enum Request {
    Insert(Box<TrackedFrame>, Arc<RgbImage>),
    Begin(Box<TwoViewMap>),
    Count(ObservationCounts),
    /// Velocity of the frame of that time.
    Retime(i64, Velocity),
    /// How the rows of all images are read.
    SetRowTimes(FrameTimes),
    /// The adjustment of that number has finished, or has ended by a panic.
    Adjusted(u64, Option<Box<GlobalBundle>>),
    RemoveSubmap(KeyFrameId),
    Reset,
    #[cfg(test)]
    Adjust(KeyFrameId),
    #[cfg(test)]
    Panic,
}

/// The map after a request.
struct Answer {
    map: Arc<Map>,
    inserted: Option<Inserted>,
    /// Whether an adjustment is under way.
    adjusting: bool,
}

/// A backend on a thread of its own, as tracking uses it.
pub(crate) struct MappingWorker {
    worker: Worker<Request, Answer>,
    pub(super) recogniser: Arc<Mutex<PlaceRecogniser>>,
    pub(super) snapshot: Arc<Map>,
    /// Number of the adjustment that is wanted: all others stop.
    wanted: Arc<AtomicU64>,
    pub(super) busy: bool,
    adjusting: bool,
}

impl MappingWorker {
    pub(super) fn spawn(backend: Backend) -> std::io::Result<Self> {
        let (recogniser, snapshot) = (backend.recogniser(), Arc::new(backend.map.clone()));
        let wanted = Arc::new(AtomicU64::new(0));
        let adjuster_wanted = wanted.clone();
        let worker = Worker::spawn("mapping", QUEUE, |requests| {
            let mut mapping =
                Mapping { backend, adjuster: Adjuster { wanted: adjuster_wanted, requests, active: false } };
            move |request| mapping.handle(request)
        })?;
        Ok(Self { worker, recogniser, snapshot, wanted, busy: false, adjusting: false })
    }

    pub(super) fn insert(&mut self, frame: &TrackedFrame, color: &Arc<RgbImage>) {
        self.busy = true;
        self.send(Request::Insert(Box::new(frame.clone()), Arc::clone(color)));
    }

    pub(super) fn begin(&mut self, start: TwoViewMap) {
        self.busy = true;
        self.send(Request::Begin(Box::new(start)));
    }

    fn send(&mut self, request: Request) {
        if !self.worker.send(request) {
            self.note_end();
        }
    }

    /// Without its thread the map stays usable but no longer grows: keyframes count as skipped.
    fn note_end(&mut self) {
        self.busy = true;
        self.adjusting = false;
    }

    /// Returns whether the thread is there.
    pub(super) fn is_alive(&self) -> bool {
        self.worker.is_alive()
    }

    /// Takes the answers that are ready.
    pub(super) fn poll(&mut self) -> Option<Inserted> {
        let mut inserted = None;
        while let Some(answer) = self.worker.poll() {
            inserted = self.adopt(answer).or(inserted);
        }
        if !self.is_alive() {
            self.note_end();
        }
        inserted
    }

    /// Waits for the keyframe that is under way.
    pub(super) fn wait(&mut self) -> Option<Inserted> {
        self.wait_while(|worker| worker.busy)
    }

    /// Waits for the keyframe and the adjustment that are under way.
    pub(super) fn finish(&mut self) -> Option<Inserted> {
        self.wait_while(|worker| worker.busy || worker.adjusting)
    }

    fn wait_while(&mut self, under_way: impl Fn(&Self) -> bool) -> Option<Inserted> {
        let mut inserted = None;
        while self.is_alive() && under_way(self) {
            match self.worker.wait() {
                Some(answer) => inserted = self.adopt(answer).or(inserted),
                None => self.note_end(),
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

    pub(super) fn count(&mut self, counts: &mut ObservationCounts) {
        if counts.visible.len() < SEND_COUNTS_AT {
            return;
        }
        // Counts are not urgent: if the queue is full they wait for the next frame.
        if let Err(Request::Count(back)) = self.worker.try_send(Request::Count(std::mem::take(counts))) {
            *counts = back;
        }
    }

    pub(super) fn retime(&mut self, timestamp_ns: i64, velocity: &Velocity) {
        self.send(Request::Retime(timestamp_ns, *velocity));
    }

    pub(super) fn set_row_times(&mut self, times: &FrameTimes) {
        self.send(Request::SetRowTimes(*times));
    }

    pub(super) fn remove_submap(&mut self, root: KeyFrameId) {
        self.send(Request::RemoveSubmap(root));
    }

    pub(super) fn reset(&mut self) {
        self.wait();
        self.send(Request::Reset);
        // Answers given before it still hold the old map.
        while self.is_alive() && self.snapshot.keyframe_count() > 0 {
            match self.worker.wait() {
                Some(answer) => drop(self.adopt(answer)),
                None => self.note_end(),
            }
        }
        self.snapshot = Arc::default();
    }
}

impl Drop for MappingWorker {
    fn drop(&mut self) {
        // An adjustment that is under way stops at its next step.
        self.wanted.fetch_add(1, Ordering::Relaxed);
    }
}

/// The state of the mapping thread.
struct Mapping {
    backend: Backend,
    adjuster: Adjuster,
}

impl Mapping {
    fn handle(&mut self, request: Request) -> Option<Answer> {
        let inserted = match request {
            Request::Insert(mut frame, color) => {
                // The map may have moved since the frame was tracked in a snapshot of it.
                frame.follow_map(&self.backend.map);
                let inserted = self.backend.insert(&frame, &color);
                if let Some(closed) = &inserted.loop_closure {
                    self.adjuster.start(&self.backend, closed.keyframe);
                }
                Some(inserted)
            }
            Request::Begin(start) => Some(self.backend.begin(&start)),
            Request::Adjusted(number, adjusted) => {
                if !self.adjuster.is_wanted(number) {
                    return None;
                }
                if let Some(adjusted) = adjusted {
                    adjusted.merge(&self.backend.context.sensor, &mut self.backend.map);
                }
                self.adjuster.cancel();
                None
            }
            Request::Reset => {
                self.adjuster.cancel();
                self.backend.reset();
                None
            }
            Request::Count(counts) => {
                self.backend.count(&counts);
                return None;
            }
            Request::Retime(timestamp_ns, velocity) => {
                self.backend.retime(timestamp_ns, &velocity);
                return None;
            }
            Request::SetRowTimes(times) => {
                self.backend.set_row_times(&times);
                None
            }
            Request::RemoveSubmap(root) => {
                self.backend.map.remove_submap(root);
                return None;
            }
            #[cfg(test)]
            Request::Adjust(keyframe) => {
                self.adjuster.start(&self.backend, keyframe);
                None
            }
            #[cfg(test)]
            Request::Panic => std::panic::resume_unwind(Box::new("as a test asks for")),
        };
        Some(Answer { map: Arc::new(self.backend.map.clone()), inserted, adjusting: self.adjuster.active })
    }
}

/// Adjusts copies of the map, one at a time, each on a thread that ends with it.
struct Adjuster {
    wanted: Arc<AtomicU64>,
    requests: Requests<Request>,
    active: bool,
}

impl Adjuster {
    /// Starts to adjust the submap of `keyframe`, instead of what is under way.
    fn start(&mut self, backend: &Backend, keyframe: KeyFrameId) {
        self.cancel();
        let Some(mut copy) = GlobalBundle::copy(&backend.context.sensor, &backend.map, keyframe) else { return };
        let (context, wanted, requests) = (backend.context.clone(), self.wanted.clone(), self.requests.clone());
        let number = wanted.load(Ordering::Relaxed);
        let work = move || {
            let mut report = Report { number, requests, adjusted: None };
            copy.adjust(&context.config.bundle, &|| wanted.load(Ordering::Relaxed) == number);
            report.adjusted = Some(Box::new(copy));
        };
        match std::thread::Builder::new().name("global bundle".to_owned()).spawn(work) {
            Ok(_) => self.active = true,
            Err(error) => {
                tracing::warn!(%error, "no thread for global bundle adjustment: the loop is closed by its pose graph alone")
            }
        }
    }

    fn is_wanted(&self, number: u64) -> bool {
        self.wanted.load(Ordering::Relaxed) == number
    }

    /// Cancels the adjustment that is under way. Its thread ends after the step that it is in.
    fn cancel(&mut self) {
        self.wanted.fetch_add(1, Ordering::Relaxed);
        self.active = false;
    }
}

/// Reports the end of an adjustment, also one that ends by a panic.
struct Report {
    number: u64,
    requests: Requests<Request>,
    adjusted: Option<Box<GlobalBundle>>,
}

impl Drop for Report {
    fn drop(&mut self) {
        // If mapping has ended there is nothing to adjust.
        self.requests.send(Request::Adjusted(self.number, self.adjusted.take()));
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;
    use crate::config::Config;
    use crate::context::Context;
    use crate::geometry::se3_exp;
    use crate::map::scene::Scene;
    use nalgebra::Vector6;

    fn backend(scene: Scene, map: Map) -> Backend {
        Backend::new(Arc::new(Context { sensor: scene.sensor, config: Config::default() }), map)
    }

    #[test]
    fn the_end_of_the_thread_by_a_panic_is_noticed_and_no_call_waits_for_it() {
        let mut worker = MappingWorker::spawn(backend(Scene::new(), Map::default())).unwrap();
        assert!(worker.is_alive());
        worker.send(Request::Panic);
        worker.insert(&TrackedFrame::default(), &Arc::default());
        assert!(worker.wait().is_none() && worker.finish().is_none() && worker.poll().is_none());
        assert!(!worker.is_alive() && worker.busy, "no more keyframes are handed over");
        worker.reset();
    }

    /// A backend whose map has to be adjusted, and its keyframes.
    fn unadjusted() -> (Backend, Vec<KeyFrameId>) {
        let (scene, mut map) = (Scene::new(), Map::default());
        let mut ids = Vec::new();
        for k in 0..6 {
            let noise = se3_exp(&(Vector6::new(0.02, -0.01, 0.02, 0.0, 0.005, 0.0) * (k % 3) as f64));
            ids.push(scene.add(&mut map, k, &(noise * scene.pose(k)), &ids));
        }
        (backend(scene, map), ids)
    }

    #[test]
    fn an_adjustment_is_merged_unless_another_was_started_since() {
        let (backend, ids) = unadjusted();
        let pose = |map: &Map| map.keyframe(ids[5]).unwrap().t_cam_world;
        let before = pose(&backend.map);
        // A worker in the place of the mapping thread that gives back what it receives.
        let mut requests = None;
        let mut echo = Worker::spawn("test", QUEUE, |sender| {
            requests = Some(sender);
            |request: Request| Some(request)
        })
        .unwrap();
        let adjuster = Adjuster { wanted: Arc::default(), requests: requests.unwrap(), active: false };
        let mut mapping = Mapping { backend, adjuster };
        mapping.adjuster.start(&mapping.backend, ids[5]);
        mapping.adjuster.start(&mapping.backend, ids[5]);
        let (first, second) = (echo.wait().unwrap(), echo.wait().unwrap());
        let number = |request: &Request| if let Request::Adjusted(number, Some(_)) = request { *number } else { 0 };
        let (stale, wanted) = if number(&first) < number(&second) { (first, second) } else { (second, first) };
        assert!(mapping.handle(stale).is_none());
        let answer = mapping.handle(wanted).unwrap();
        assert!(pose(&answer.map) != before && !answer.adjusting && answer.inserted.is_none());
    }

    #[test]
    fn shutdown_ends_while_the_map_is_adjusted() {
        for _ in 0..20 {
            let (backend, ids) = unadjusted();
            let mut worker = MappingWorker::spawn(backend).unwrap();
            worker.send(Request::Adjust(ids[5]));
            let started = Instant::now();
            drop(worker);
            assert!(started.elapsed() < Duration::from_secs(5));
        }
    }
}
