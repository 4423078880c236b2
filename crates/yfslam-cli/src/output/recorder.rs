//! Records what one method run leaves behind.
//!
//! In: every tracked frame, then the run's result. Out: the files of the output folder, and the images for the report.

use std::path::PathBuf;

use anyhow::Result;
use yfslam::{Camera, Config, Frame, Slam, Tracked};
use yfslam_report::{DenseMapImages, Snapshot};

use super::dense;
use super::folder::OutputFolder;
use super::overlay::{Overlay, draw_captioned};
use super::recording::Recording;
use super::snapshots::Snapshots;
use super::video::Video;
use crate::run::map_args::MapArgs;
use crate::run::method_run::{Maps, RunResult};
use crate::run::pipeline::Pipeline;
use crate::run::resume::RunIdentity;
use crate::ui::failures::Failures;

/// What a method run leaves behind besides its trajectory.
#[derive(Clone, Debug)]
pub struct RunOutputs {
    /// An image of every frame.
    pub overlay: bool,
    /// Number of evenly spread snapshots; `None` without a report.
    pub snapshots: Option<usize>,
    /// A recording of messages, in a file of this name.
    pub record: Option<PathBuf>,
    /// A film of the overlay, in a file of this name.
    pub video: Option<PathBuf>,
}

impl RunOutputs {
    /// Returns the outputs of one method of several, in files of its own: `run.mcap` becomes `run.full.mcap`.
    pub fn of_method(&self, method: Option<&str>) -> Self {
        let name = |path: &PathBuf| match (method, path.file_stem(), path.extension()) {
            (Some(method), Some(stem), Some(extension)) => {
                path.with_file_name(format!("{}.{method}.{}", stem.to_string_lossy(), extension.to_string_lossy()))
            }
            (Some(method), ..) => path.with_extension(method),
            _ => path.clone(),
        };
        Self { record: self.record.as_ref().map(name), video: self.video.as_ref().map(name), ..*self }
    }
}

/// Writes the files of one method run.
pub struct Recorder {
    folder: OutputFolder,
    overlay: Option<Overlay>,
    snapshots: Option<Snapshots>,
    recording: Option<Recording>,
    video: Option<Video>,
    open_score: f32,
    /// Time stamps of the first frame and the last one, ns.
    span_ns: Option<[i64; 2]>,
}

/// Images of one method run for the report.
#[derive(Clone, Debug, Default)]
pub struct ReportImages {
    pub snapshots: Vec<Snapshot>,
    pub dense: Option<DenseMapImages>,
}

impl Recorder {
    /// Prepares the output of a run of `frames` frames of a camera.
    ///
    /// # Errors
    /// A folder or a file cannot be written to.
    pub fn prepare(
        folder: OutputFolder,
        config: &Config,
        camera: &Camera,
        frames: usize,
        outputs: &RunOutputs,
    ) -> Result<Self> {
        let open_score = config.dynamic.open_score;
        let overlay = outputs.overlay.then(|| Overlay::prepare(folder.path())).transpose()?;
        let snapshots = outputs.snapshots.map(|count| Snapshots::new(frames, count, open_score));
        let recording = outputs.record.as_deref().map(|path| Recording::create(path, camera)).transpose()?;
        let video = outputs.video.as_deref().map(|path| Video::create(path, camera.fps, frames)).transpose()?;
        Ok(Self { folder, overlay, snapshots, recording, video, open_score, span_ns: None })
    }

    pub fn folder(&self) -> &OutputFolder {
        &self.folder
    }

    /// Begins to record: removes the results of an earlier run, unless this one goes on from its checkpoint, and writes the configuration.
    ///
    /// # Errors
    /// A file cannot be removed or written.
    pub fn begin(&self, config: &Config, resumes: bool) -> Result<()> {
        if !resumes {
            self.folder.remove_results()?;
        }
        self.folder.write_config(config)
    }

    /// Records the frame that `slam` tracked last. After an image that cannot be written there are no more.
    pub fn record(
        &mut self,
        index: usize,
        frame: &Frame,
        tracked: Option<&Tracked>,
        slam: &Slam,
        failures: &mut Failures,
    ) {
        if let Some(snapshots) = &mut self.snapshots {
            snapshots.record(index, frame, slam);
        }
        let [first_ns, _] = self.span_ns.unwrap_or([frame.timestamp_ns; 2]);
        self.span_ns = Some([first_ns, frame.timestamp_ns]);
        if self.overlay.is_none() && self.recording.is_none() && self.video.is_none() {
            return;
        }
        let seconds = frame.timestamp_ns.saturating_sub(first_ns) as f64 / 1e9;
        let image = draw_captioned(index, seconds, frame, tracked, slam, self.open_score);
        if let Some(overlay) = &self.overlay
            && failures.keep(overlay.write(index, &image)).is_none()
        {
            self.overlay = None;
        }
        if let (Some(recording), Some(tracked)) = (&mut self.recording, tracked)
            && failures.keep(recording.write(&image, frame, tracked, slam)).is_none()
        {
            self.recording = None;
        }
        if let Some(video) = &mut self.video
            && failures.keep(video.write(&image)).is_none()
        {
            self.video = None;
        }
    }

    /// Ends the recording and the film.
    pub fn finish_films(&mut self, slam: &Slam, failures: &mut Failures) {
        let last_ns = self.span_ns.map_or(0, |[_, last_ns]| last_ns);
        if let Some(recording) = self.recording.take() {
            failures.keep(recording.finish(last_ns, slam));
        }
        if let Some(video) = self.video.take() {
            failures.keep(video.finish());
        }
    }

    /// Writes the trajectories and the map as they are now, for a later run that goes on; nothing if no frame is tracked yet.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_checkpoint(&self, pipeline: &mut Pipeline, map: &MapArgs, run: &RunIdentity) -> Result<()> {
        pipeline.finish_mapping();
        let trajectory = pipeline.trajectory();
        let Some(checkpoint) = pipeline.checkpoint(run).filter(|_| !trajectory.is_empty()) else { return Ok(()) };
        self.folder.write_poses(&trajectory, pipeline.live())?;
        let encoded = pipeline.save_map()?;
        self.folder.write_checkpoint(&checkpoint, &encoded)?;
        map.write(&encoded)
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
