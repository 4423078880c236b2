//! Records what one method run leaves behind.
//!
//! In: every tracked frame, then the run's result. Out: the files of the output folder, and the images for the report.

use anyhow::Result;
use yfslam::{Config, Frame, Slam};
use yfslam_report::{DenseMapImages, Snapshot};

use super::dense;
use super::folder::OutputFolder;
use super::overlay::Overlay;
use super::snapshots::Snapshots;
use crate::run::map_args::MapArgs;
use crate::run::method_run::{Maps, RunResult};
use crate::run::pipeline::Pipeline;
use crate::ui::failures::Failures;

/// What a method run leaves behind besides its trajectory.
#[derive(Clone, Copy, Debug)]
pub struct RunOutputs {
    /// An image of every frame.
    pub overlay: bool,
    /// Number of evenly spread snapshots; `None` without a report.
    pub snapshots: Option<usize>,
}

/// Writes the files of one method run.
pub struct Recorder {
    folder: OutputFolder,
    overlay: Option<Overlay>,
    snapshots: Option<Snapshots>,
}

/// Images of one method run for the report.
#[derive(Clone, Debug, Default)]
pub struct ReportImages {
    pub snapshots: Vec<Snapshot>,
    pub dense: Option<DenseMapImages>,
}

impl Recorder {
    /// Prepares the output of a run of `frames` frames.
    ///
    /// # Errors
    /// A folder cannot be written to.
    pub fn prepare(folder: OutputFolder, config: &Config, frames: usize, outputs: RunOutputs) -> Result<Self> {
        let open_score = config.dynamic.open_score;
        let overlay = outputs.overlay.then(|| Overlay::prepare(folder.path(), open_score)).transpose()?;
        let snapshots = outputs.snapshots.map(|count| Snapshots::new(frames, count, open_score));
        Ok(Self { folder, overlay, snapshots })
    }

    pub fn folder(&self) -> &OutputFolder {
        &self.folder
    }

    /// Begins to record: removes the results of an earlier run, and writes the configuration.
    ///
    /// # Errors
    /// A file cannot be removed or written.
    pub fn begin(&self, config: &Config) -> Result<()> {
        self.folder.remove_results()?;
        self.folder.write_config(config)
    }

    /// Records the frame that `slam` tracked last. After an image that cannot be written there are no more.
    pub fn record(&mut self, index: usize, frame: &Frame, slam: &Slam, failures: &mut Failures) {
        if let Some(snapshots) = &mut self.snapshots {
            snapshots.record(index, frame, slam);
        }
        if let Some(overlay) = &self.overlay
            && failures.keep(overlay.write(index, frame, slam)).is_none()
        {
            self.overlay = None;
        }
    }

    /// Writes the trajectories and, if it is to be saved, the map as they are now; nothing if no frame is tracked yet.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_checkpoint(&self, pipeline: &mut Pipeline, map: &MapArgs) -> Result<()> {
        pipeline.finish_mapping();
        let trajectory = pipeline.trajectory();
        if trajectory.is_empty() {
            return Ok(());
        }
        self.folder.write_poses(&trajectory, pipeline.live())?;
        map.encode(pipeline).map_or(Ok(()), |encoded| map.write(&encoded?))
    }

    /// Writes the result but for `run.json`; returns the images for the report.
    pub fn write(&self, result: &RunResult, maps: Maps, map: &MapArgs, failures: &mut Failures) -> ReportImages {
        self.folder.write(&result.outcome, failures);
        if let Some(encoded) = maps.saved.and_then(|encoded| failures.keep(encoded)) {
            failures.keep(map.write(&encoded));
        }
        let dense = maps.dense.and_then(|dense| failures.keep(dense));
        if let Some(dense) = &dense {
            failures.keep(dense::write(self.folder.path(), &dense.encoded));
        }
        let Some(snapshots) = &self.snapshots else { return ReportImages::default() };
        let images = dense.and_then(|dense| failures.keep(dense::images(&result.config.dense, &dense.map)));
        ReportImages { snapshots: failures.keep(snapshots.to_images()).unwrap_or_default(), dense: images }
    }
}
