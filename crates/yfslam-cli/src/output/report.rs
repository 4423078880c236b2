//! What `run.json` says about a run.

use serde::Serialize;
use yfslam::{Camera, Config};
use yfslam_eval::Evaluation;
use yfslam_io::Fault;
use yfslam_io::sequence::AssociationReport;

use crate::input::boxes::BoxOrigin;
use crate::input::source::{MaskTally, Source, Truth};
use crate::run::dense::DenseCost;
use crate::run::method_run::Judged;
use crate::stats::recognition::PlaceTally;
use crate::stats::stages::Stages;
use crate::stats::tally::{DynamicTally, FrameTally};

/// What a report is made of.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// As the user named it.
    pub sequence: &'a str,
    pub source: &'a Source,
    pub faults: &'a [Fault],
    pub truth: Option<&'a Truth>,
    pub judged: &'a Judged<'a>,
}

/// Everything that `run.json` says.
#[derive(Serialize)]
pub struct Report<'a> {
    /// Version of this program.
    pub yfslam: &'static str,
    pub sequence: &'a str,
    pub camera_origin: &'a str,
    pub camera: &'a Camera,
    /// Where the boxes of movable objects come from.
    pub boxes: &'a BoxOrigin,
    /// Which frames had a mask, where masks were asked for.
    pub masks: Option<&'a MaskTally>,
    /// Faults put into the frames on purpose.
    pub faults: Vec<String>,
    pub frames: &'a FrameTally,
    /// What was left out when colour and depth images were paired.
    pub association: Option<Association>,
    pub dynamic: &'a DynamicTally,
    /// Loops that were closed, and stretches over which the camera was lost.
    pub places: &'a PlaceTally,
    pub map: MapSize,
    /// What the dense map took; `null` if none was made.
    pub dense: Option<DenseCost>,
    /// Wall time of each stage over all frames; `mapping` over keyframes. Decoding runs beside all; `detector` runs beside `features`
    /// or, if the frames are taken through several methods, once for all of them.
    pub times: Stages,
    pub wall_s: f64,
    pub fps: f64,
    /// Processor time of tracking and detection, without reading or rendering; `null` where the system does not tell. Detection counts
    /// in full for each method that it was done for.
    pub cpu_s: Option<f64>,
    /// Peak resident memory, MB (10⁶ bytes); `null` where the system does not tell.
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

/// What was left out when colour and depth images were paired.
#[derive(Serialize)]
pub struct Association {
    pub color_listed: usize,
    pub companions_listed: usize,
    pub paired: usize,
    pub color_unmatched: usize,
    pub companions_unmatched: usize,
    pub duplicate_stamps_skipped: usize,
    pub backward_stamps_skipped: usize,
    pub unstamped_skipped: usize,
}

impl<'a> Report<'a> {
    /// The report of one run.
    pub fn new(run: &Run<'a>) -> Self {
        let Run { sequence, source, faults, truth, judged } = *run;
        let Judged { config, outcome, boxes, shared, .. } = judged;
        Self {
            yfslam: env!("CARGO_PKG_VERSION"),
            sequence,
            camera_origin: &source.camera.origin,
            camera: &source.camera.camera,
            boxes,
            masks: source.masks.as_ref(),
            faults: faults.iter().map(ToString::to_string).collect(),
            frames: &outcome.frames,
            association: source.association.as_ref().map(Association::from),
            dynamic: &outcome.dynamic,
            places: &outcome.places,
            map: MapSize { keyframes: outcome.keyframes.len(), landmarks: outcome.landmarks.len() },
            dense: judged.dense_cost,
            times: shared.and(&outcome.stages),
            wall_s: outcome.wall.as_secs_f64(),
            fps: outcome.fps(),
            cpu_s: outcome.cpu.map(|cpu| cpu.as_secs_f64()),
            peak_memory_mb: peak_memory_mb(),
            groundtruth: truth.map(|truth| truth.origin.as_str()),
            evaluation: judged.evaluation(),
            config,
        }
    }
}

impl From<&AssociationReport> for Association {
    fn from(report: &AssociationReport) -> Self {
        Self {
            color_listed: report.color_listed,
            companions_listed: report.companions_listed,
            paired: report.paired,
            color_unmatched: report.color_unmatched,
            companions_unmatched: report.companions_unmatched,
            duplicate_stamps_skipped: report.duplicates_skipped,
            backward_stamps_skipped: report.backward_skipped,
            unstamped_skipped: report.unstamped_skipped,
        }
    }
}

/// Peak resident memory of this process, MB (10⁶ bytes); `None` where the system does not tell.
fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some((kib * 1.024 / 1e2).round() / 10.0)
}
