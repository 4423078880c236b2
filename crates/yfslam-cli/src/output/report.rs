//! The content of `run.json`.

use serde::Serialize;
use yfslam::{Camera, Config};
use yfslam_eval::Evaluation;
use yfslam_io::Fault;
use yfslam_io::sequence::{AssociationReport, UsedTopics};

use super::map_frame::Frames;
use super::recorder::ReportImages;
use crate::input::boxes::BoxOrigin;
use crate::input::source::{MaskTally, Source, Truth};
use crate::run::dense::DenseCost;
use crate::run::method_run::RunResult;
use crate::run::resume::ResumePoint;
use crate::stats::health::HealthTally;
use crate::stats::process::FrameCost;
use crate::stats::readout::ReadoutReport;
use crate::stats::recognition::RecognitionTally;
use crate::stats::stages::Stages;
use crate::stats::tally::{DynamicTally, FrameTally};
use crate::ui::interrupt::Interrupted;

/// One method run as the reports need it.
#[derive(Clone, Copy)]
pub struct ReportedRun<'a> {
    /// As the user named it.
    pub sequence: &'a str,
    pub source: &'a Source,
    pub faults: &'a [Fault],
    pub truth: Option<&'a Truth>,
    pub result: &'a RunResult<'a>,
    pub images: &'a ReportImages,
    /// Processor time of a frame; `None` where the system does not measure it.
    pub cost: Option<FrameCost>,
    /// The signal that ended the run before its last frame.
    pub interrupted: Option<Interrupted>,
}

/// The content of `run.json`.
#[derive(Serialize)]
pub struct RunReport<'a> {
    /// Version of this program.
    pub yfslam: &'static str,
    pub sequence: &'a str,
    pub camera_origin: &'a str,
    pub camera: &'a Camera,
    /// The readout time of the rows that was in use, and its estimate.
    pub readout: ReadoutReport,
    /// Where the boxes of movable objects come from.
    pub boxes: &'a BoxOrigin,
    /// Which frames had a mask, where masks were asked for.
    pub masks: Option<&'a MaskTally>,
    /// Faults put into the frames on purpose.
    pub faults: Vec<String>,
    pub frames: &'a FrameTally,
    /// The frames in which the files of the run have their coordinates.
    pub coordinates: Frames,
    /// Whether a signal ended the run before its last frame.
    pub interrupted: bool,
    /// The topics in use; `null` unless the sequence is a bag. `camera_origin` names that of the calibration.
    pub topics: Option<&'a UsedTopics>,
    /// The association of colour images with depth or right images; `null` for synthetic worlds.
    pub association: Option<Association>,
    /// Where the run has gone on from a checkpoint; `null` if it began at the first frame.
    pub resumed: Option<ResumePoint>,
    /// Signs that the result may be wrong although no stage has reported an error: in how many frames, and when.
    pub health: &'a HealthTally,
    pub dynamic: &'a DynamicTally,
    /// Loops that were closed, and periods in which the camera was lost.
    pub loops_and_relocalisation: &'a RecognitionTally,
    pub map: MapSize,
    /// Cost of the dense map; `null` if none was made.
    pub dense: Option<DenseCost>,
    /// Wall time of each stage over all frames; `mapping` over keyframes. Decoding runs on threads of its own; `detector` runs in parallel
    /// with `features` or, with several methods, once for all of them.
    pub times: Stages,
    pub wall_s: f64,
    pub fps: f64,
    /// Processor time of the whole process over all frames, all methods of the run together; `null` where the system does not measure
    /// it.
    pub process_cpu_s: Option<f64>,
    /// The same for one frame.
    pub process_ms_per_frame: Option<f64>,
    /// What it consists of, ms for one frame.
    pub process_parts_ms_per_frame: Option<FrameCost>,
    /// Peak resident memory, MB (10⁶ bytes); `null` where the system does not report it.
    pub peak_memory_mb: Option<f64>,
    /// Errors against the ground truth, if there is one.
    pub groundtruth: Option<&'a str>,
    pub evaluation: Option<&'a Evaluation>,
    /// The resolved configuration.
    pub config: &'a Config,
}

#[derive(Serialize)]
pub struct MapSize {
    pub keyframes: usize,
    pub landmarks: usize,
}

/// The association of colour images with depth or right images.
#[derive(Serialize)]
pub struct Association {
    pub color_listed: usize,
    pub paired_images_listed: usize,
    pub pairs: usize,
    pub color_unmatched: usize,
    pub paired_images_unmatched: usize,
    pub duplicate_stamps_skipped: usize,
    pub backward_stamps_skipped: usize,
    pub unstamped_skipped: usize,
}

impl<'a> RunReport<'a> {
    /// Builds the report of one method run.
    pub fn new(run: &ReportedRun<'a>) -> Self {
        let ReportedRun { sequence, source, faults, truth, result, cost, interrupted, .. } = *run;
        let RunResult { config, outcome, boxes, shared, .. } = result;
        Self {
            yfslam: env!("CARGO_PKG_VERSION"),
            sequence,
            camera_origin: &source.camera.origin,
            camera: &source.camera.camera,
            readout: outcome.readout,
            boxes,
            masks: source.masks.as_ref(),
            faults: faults.iter().map(ToString::to_string).collect(),
            frames: &outcome.frames,
            coordinates: Frames::from(&outcome.map_frame),
            interrupted: interrupted.is_some(),
            topics: source.topics.as_ref(),
            association: source.association.as_ref().map(Association::from),
            resumed: outcome.resumed,
            health: &outcome.health,
            dynamic: &outcome.dynamic,
            loops_and_relocalisation: &outcome.recognition,
            map: MapSize { keyframes: outcome.keyframes.len(), landmarks: outcome.landmarks.len() },
            dense: result.dense_cost,
            times: shared.and(&outcome.stages),
            wall_s: outcome.wall.as_secs_f64(),
            fps: outcome.fps(),
            process_cpu_s: cost.map(|cost| cost.process_s),
            process_ms_per_frame: cost.map(|cost| cost.total),
            process_parts_ms_per_frame: cost,
            peak_memory_mb: peak_memory_mb(),
            groundtruth: truth.map(|truth| truth.origin.as_str()),
            evaluation: result.evaluation(),
            config,
        }
    }
}

impl From<&AssociationReport> for Association {
    fn from(report: &AssociationReport) -> Self {
        Self {
            color_listed: report.color_listed,
            paired_images_listed: report.paired_images_listed,
            pairs: report.paired,
            color_unmatched: report.color_unmatched,
            paired_images_unmatched: report.paired_images_unmatched,
            duplicate_stamps_skipped: report.duplicates_skipped,
            backward_stamps_skipped: report.backward_skipped,
            unstamped_skipped: report.unstamped_skipped,
        }
    }
}

/// Returns the peak resident memory of this process, MB (10⁶ bytes); `None` where the system does not report it.
fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some((kib * 1.024 / 1e2).round() / 10.0)
}
