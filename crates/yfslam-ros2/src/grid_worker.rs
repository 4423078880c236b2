//! Makes grids on a thread of its own, so that tracking does not wait for them.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Instant;

use nalgebra::Isometry3;
use yfslam::dense::Volume;

use crate::grid::occupancy_grid;
use crate::messages::{Header, OccupancyGrid};

/// What a grid is made of.
pub struct GridJob {
    pub header: Header,
    pub volume: Volume,
    pub t_map_volume: Isometry3<f64>,
    pub heights_m: [f64; 2],
}

/// The thread that makes grids.
pub struct GridWorker {
    jobs: SyncSender<GridJob>,
    grids: Receiver<(Option<OccupancyGrid>, f64)>,
    is_busy: bool,
}

impl GridWorker {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system grants none.
    pub fn start() -> std::io::Result<Self> {
        let (jobs, to_do) = sync_channel::<GridJob>(1);
        let (done, grids) = sync_channel(1);
        thread::Builder::new().name("yfslam-grid".into()).spawn(move || {
            for GridJob { header, volume, t_map_volume, heights_m } in to_do {
                let started = Instant::now();
                let grid = occupancy_grid(header, &volume, &t_map_volume, heights_m);
                if done.send((grid, started.elapsed().as_secs_f64() * 1e3)).is_err() {
                    break;
                }
            }
        })?;
        Ok(Self { jobs, grids, is_busy: false })
    }

    /// Returns whether a grid is being made.
    pub fn is_busy(&self) -> bool {
        self.is_busy
    }

    /// Begins a grid, unless one is being made.
    pub fn begin(&mut self, job: GridJob) {
        self.is_busy |= self.jobs.try_send(job).is_ok();
    }

    /// Returns a grid that is ready, and how long it took, ms.
    pub fn poll(&mut self) -> Option<(Option<OccupancyGrid>, f64)> {
        let ready = self.grids.try_recv().ok();
        self.is_busy &= ready.is_none();
        ready
    }
}
