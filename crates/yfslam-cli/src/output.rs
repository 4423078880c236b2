//! The folder that a run leaves behind; every file is written whole or not at all.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::Serialize;
use yfslam::{Camera, Config};
use yfslam_eval::Evaluation;
use yfslam_io::sequence::AssociationReport;
use yfslam_io::write::write_ply;
use yfslam_io::{write_atomically, write_trajectory};

use crate::detector::ModelIdentity;
use crate::pipeline::{DynamicTally, FrameTally, Outcome, Stages};

/// Folder for the folders of runs whose `--out` is left out.
const DEFAULT_PARENT: &str = "yfslam-out";

/// A folder that can be written to.
#[derive(Clone, Debug)]
pub struct OutputFolder(PathBuf);

/// Everything that `run.json` says.
#[derive(Serialize)]
pub struct Report<'a> {
    /// Version of this program.
    pub yfslam: &'static str,
    pub sequence: &'a str,
    pub camera_origin: &'a str,
    pub camera: &'a Camera,
    /// Where the boxes of movable objects come from.
    pub boxes: BoxSource<'a>,
    pub frames: &'a FrameTally,
    /// What was left out when colour and depth images were paired.
    pub association: Option<Association>,
    pub dynamic: &'a DynamicTally,
    pub map: MapSize,
    /// Wall time of each stage over all frames; `mapping` over keyframes. `detector` runs beside `features`, decoding beside all.
    pub times: &'a Stages,
    pub wall_s: f64,
    pub fps: f64,
    /// Peak resident memory, MB (10⁶ bytes); `null` where the system does not tell.
    pub peak_memory_mb: Option<f64>,
    /// Errors against the ground truth, if there is one.
    pub groundtruth: Option<&'a str>,
    pub evaluation: Option<&'a Evaluation>,
    /// The resolved configuration.
    pub config: &'a Config,
}

/// Where the boxes of movable objects come from.
#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BoxSource<'a> {
    /// The method needs none.
    None,
    /// The synthetic world knows them.
    Renderer,
    /// A network.
    Detector(&'a ModelIdentity),
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
    pub depth_listed: usize,
    pub paired: usize,
    pub color_unmatched: usize,
    pub depth_unmatched: usize,
    pub duplicate_stamps_skipped: usize,
    pub backward_stamps_skipped: usize,
}

impl From<&AssociationReport> for Association {
    fn from(report: &AssociationReport) -> Self {
        Self {
            color_listed: report.color_listed,
            depth_listed: report.depth_listed,
            paired: report.paired,
            color_unmatched: report.color_unmatched,
            depth_unmatched: report.depth_unmatched,
            duplicate_stamps_skipped: report.duplicates_skipped,
            backward_stamps_skipped: report.backward_skipped,
        }
    }
}

impl OutputFolder {
    /// Makes the folder `out`, or else one named after the sequence, and proves that files can be written there.
    ///
    /// # Errors
    /// It cannot be written to: better known before a long run than after.
    pub fn prepare(out: Option<&Path>, name: &str) -> Result<Self> {
        let folder = out.map_or_else(|| Path::new(DEFAULT_PARENT).join(name), PathBuf::from);
        let probe = folder.join(".yfslam-probe");
        write_atomically(&probe, |_| Ok(()))
            .with_context(|| format!("the output folder {} cannot be used", folder.display()))?;
        // Left behind it does no harm.
        let _ = std::fs::remove_file(&probe);
        Ok(Self(folder))
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes everything but the report.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, outcome: &Outcome, config: &Config) -> Result<()> {
        write_trajectory(&self.0.join("trajectory.txt"), &outcome.trajectory)?;
        write_trajectory(&self.0.join("keyframes.txt"), &outcome.keyframes)?;
        write_trajectory(&self.0.join("live.txt"), &outcome.live)?;
        write_ply(&self.0.join("map.ply"), outcome.landmarks.iter().copied())?;
        let toml = config.to_commented_toml()?;
        Ok(write_atomically(&self.0.join("config.toml"), |file| file.write_all(toml.as_bytes()))?)
    }

    /// Writes `run.json`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_report(&self, report: &Report) -> Result<()> {
        let json = serde_json::to_string_pretty(report)?;
        Ok(write_atomically(&self.0.join("run.json"), |file| writeln!(file, "{json}"))?)
    }
}

/// Peak resident memory of this process, MB (10⁶ bytes); `None` where the system does not tell.
pub fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some((kib * 1.024 / 1e2).round() / 10.0)
}
