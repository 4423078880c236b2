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
use crate::run::dense::DenseResult;
use crate::run::method_run::RunResult;

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
    /// Images of an earlier run cannot be removed.
    pub fn prepare(folder: OutputFolder, config: &Config, frames: usize, outputs: RunOutputs) -> Result<Self> {
        let open_score = config.dynamic.open_score;
        let overlay = outputs.overlay.then(|| Overlay::prepare(folder.path(), open_score)).transpose()?;
        let snapshots = outputs.snapshots.map(|count| Snapshots::new(frames, count, open_score));
        Ok(Self { folder, overlay, snapshots })
    }

    pub fn folder(&self) -> &OutputFolder {
        &self.folder
    }

    /// Records the frame that `slam` tracked last.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn record(&mut self, index: usize, frame: &Frame, slam: &Slam) -> Result<()> {
        if let Some(snapshots) = &mut self.snapshots {
            snapshots.record(index, frame, slam);
        }
        match &self.overlay {
            Some(overlay) => overlay.write(index, frame, slam),
            None => Ok(()),
        }
    }

    /// Writes the result but for `run.json`; returns the images for the report.
    ///
    /// # Errors
    /// A file cannot be written, or an image is too large for PNG.
    pub fn write(&self, result: &RunResult, dense: Option<&DenseResult>) -> Result<ReportImages> {
        self.folder.write(&result.outcome, &result.config)?;
        if let Some(dense) = dense {
            dense::write(self.folder.path(), &dense.encoded)?;
        }
        let Some(snapshots) = &self.snapshots else { return Ok(ReportImages::default()) };
        let dense = dense.map(|dense| dense::images(&result.config.dense, &dense.map)).transpose()?;
        Ok(ReportImages { snapshots: snapshots.to_images()?, dense })
    }
}
