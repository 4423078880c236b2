//! One run of the table: what it is, and what came of it.

use std::path::Path;

use anyhow::Result;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use yfslam_io::write_atomically;

/// What is run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Name in the table.
    pub sequence: String,
    /// As `yfslam run` takes it.
    pub source: String,
    /// `none`, `boxes` or `yf`.
    pub method: String,
    /// Of the world, or of the method's random draws.
    pub seed: u64,
    /// Words that set frames and seed.
    pub options: Vec<String>,
}

impl Plan {
    /// Name of the cell's files.
    pub fn key(&self) -> String {
        let name: String = self.sequence.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        format!("{name}-{}-{}", self.method, self.seed)
    }

    /// Words for this program, but for the output folder.
    pub fn arguments(&self, extra: &[String]) -> Vec<String> {
        let words = ["run", &self.source, "--method", &self.method];
        words.iter().map(|word| (*word).to_owned()).chain(self.options.iter().chain(extra).cloned()).collect()
    }
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Name in the table.
    pub sequence: String,
    /// `none`, `boxes` or `yf`.
    pub method: String,
    /// Of the world, or of the method's random draws.
    pub seed: u64,
    /// Absolute trajectory error after alignment by SE(3), RMSE, m.
    pub ate_rmse_m: Option<f64>,
    /// Share of the frames whose pose is known.
    pub tracked: Option<f64>,
    /// Relative pose error over a frame, RMSE, m.
    pub rpe_frame_m: Option<f64>,
    /// Relative pose error over a second, RMSE, m.
    pub rpe_second_m: Option<f64>,
    /// Frames a second, everything together.
    pub fps: Option<f64>,
    /// Why there are no figures.
    pub failure: Option<String>,
    /// What was run.
    pub arguments: Vec<String>,
    /// CRC-32 of the program that ran.
    pub program_crc32: String,
}

impl Cell {
    /// The figures of a run from its `run.json`.
    pub fn of_run(
        plan: &Plan,
        run_json: &Path,
        failure: Option<String>,
        arguments: Vec<String>,
        program_crc32: String,
    ) -> Self {
        let text = std::fs::read_to_string(run_json).unwrap_or_default();
        let run: Value = serde_json::from_str(&text).unwrap_or_default();
        let figure = |place: &str| run.pointer(place).and_then(Value::as_f64);
        let ate_rmse_m = figure("/evaluation/ate/translation_m/rmse");
        Self {
            sequence: plan.sequence.clone(),
            method: plan.method.clone(),
            seed: plan.seed,
            ate_rmse_m,
            tracked: figure("/evaluation/coverage/fraction"),
            rpe_frame_m: figure("/evaluation/rpe/0/translation_m/rmse"),
            rpe_second_m: figure("/evaluation/rpe/1/translation_m/rmse"),
            fps: figure("/fps"),
            failure: failure.or_else(|| ate_rmse_m.is_none().then(|| "no ground truth to judge it by".into())),
            arguments,
            program_crc32,
        }
    }

    /// The cell at `path`, if a whole one is there.
    pub fn read(path: &Path) -> Option<Self> {
        serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()
    }

    /// Writes the cell to `path`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let json = serde_json::to_string_pretty(self)?;
        Ok(write_atomically(path, |file| writeln!(file, "{json}"))?)
    }
}
