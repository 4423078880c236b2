//! The owner of the patches of keyframes and of the volume made of them: the mapper itself or a thread.
//!
//! In: patches, and the poses of all patches after each correction of the map. Out: the volume at these poses, and the patches.

use std::sync::Arc;

use nalgebra::UnitQuaternion;

use crate::config::DenseConfig;
use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::volume::Volume;
use crate::dense::{DenseError, MapFrame};
use crate::geometry::Pose;
use crate::worker::{Execution, Worker};

/// Length of the thread's queue.
const QUEUE_LENGTH: usize = 2;

/// A patch with its time, ns; shared with snapshots.
pub(crate) type TimedPatch = (i64, Arc<KeyframePatch>);

/// The owner of patches and volume.
pub(crate) struct FusionOwner(Owner);

/// This object or a thread.
enum Owner {
    Inline(Box<Fusion>),
    Threaded(Worker<Request, Answer>),
}

/// A request to the thread.
enum Request {
    Integrate(Vec<TimedPatch>, Vec<Option<Pose>>),
    Volume,
    Patches,
    Clear,
}

/// An answer of the thread.
enum Answer {
    Volume(Box<Volume>),
    Patches(Vec<TimedPatch>),
}

/// Patches and the volume made of them.
#[derive(Clone, Debug)]
struct Fusion {
    grid: CellGrid,
    /// Turns the world so that the z-axis points up.
    up: UnitQuaternion<f64>,
    patches: Vec<TimedPatch>,
    volume: Volume,
}
impl FusionOwner {
    /// Returns an owner without patches, whose volume is in the map frame.
    ///
    /// # Errors
    /// If a thread cannot be started.
    pub(crate) fn new(
        config: &DenseConfig,
        grid: &CellGrid,
        execution: Execution,
        frame: &MapFrame,
    ) -> Result<Self, DenseError> {
        let mut fusion =
            Fusion { grid: grid.clone(), up: frame.r_map_world, patches: Vec::new(), volume: Volume::new(config) };
        Ok(Self(match execution {
            Execution::Inline => Owner::Inline(Box::new(fusion)),
            Execution::Threaded => {
                Owner::Threaded(Worker::spawn("dense map", QUEUE_LENGTH, |_| move |request| fusion.handle(request))?)
            }
        }))
    }

    /// Integrates patches and moves all to `poses`. Returns whether the patches were accepted.
    pub(crate) fn integrate(&mut self, patches: Vec<TimedPatch>, poses: Vec<Option<Pose>>) -> bool {
        match &mut self.0 {
            Owner::Inline(fusion) => {
                fusion.integrate(patches, &poses);
                true
            }
            Owner::Threaded(worker) => worker.try_send(Request::Integrate(patches, poses)).is_ok(),
        }
    }

    pub(crate) fn volume(&mut self, poses: Vec<Option<Pose>>) -> Option<Volume> {
        match &mut self.0 {
            Owner::Inline(fusion) => {
                fusion.integrate(Vec::new(), &poses);
                Some(fusion.updated_volume())
            }
            Owner::Threaded(worker) => {
                let sent = worker.send(Request::Integrate(Vec::new(), poses)) && worker.send(Request::Volume);
                match sent.then(|| worker.wait())?? {
                    Answer::Volume(volume) => Some(*volume),
                    Answer::Patches(_) => None,
                }
            }
        }
    }

    pub(crate) fn patches(&mut self) -> Vec<TimedPatch> {
        match &mut self.0 {
            Owner::Inline(fusion) => fusion.patches.clone(),
            Owner::Threaded(worker) => match worker.send(Request::Patches).then(|| worker.wait()).flatten() {
                Some(Answer::Patches(patches)) => patches,
                _ => Vec::new(),
            },
        }
    }

    pub(crate) fn clear(&mut self) {
        match &mut self.0 {
            Owner::Inline(fusion) => fusion.clear(),
            Owner::Threaded(worker) => {
                // A thread that has ended has nothing to remove.
                worker.send(Request::Clear);
            }
        }
    }
}

impl Fusion {
    fn handle(&mut self, request: Request) -> Option<Answer> {
        match request {
            Request::Integrate(patches, poses) => self.integrate(patches, &poses),
            Request::Volume => return Some(Answer::Volume(Box::new(self.updated_volume()))),
            Request::Patches => return Some(Answer::Patches(self.patches.clone())),
            Request::Clear => self.clear(),
        }
        None
    }

    /// Adds patches, and moves all patches to their poses.
    fn integrate(&mut self, patches: Vec<TimedPatch>, poses: &[Option<Pose>]) {
        self.patches.extend(patches);
        for (number, ((_, patch), pose)) in self.patches.iter().zip(poses).enumerate() {
            let pose = pose.map(|t_world_cam| self.up * t_world_cam);
            self.volume.integrate(number, &self.grid, patch, pose.as_ref());
        }
    }

    fn updated_volume(&mut self) -> Volume {
        self.volume.update();
        self.volume.clone()
    }

    fn clear(&mut self) {
        self.patches.clear();
        self.volume = Volume::new(self.volume.config());
    }
}
