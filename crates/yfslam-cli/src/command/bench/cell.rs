//! The results of one method on one sequence with one seed, and the groups that one process computes.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use yfslam_io::write_atomically;

use crate::output::folder::FAILURE_FILE;

/// The cells of one sequence and one seed, which one process computes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Name in the table.
    pub sequence: String,
    /// Sequence for `yfslam run`.
    pub source: String,
    /// Names of the methods, each once.
    pub methods: Vec<String>,
    /// Seed of the world or of the random draws of the method.
    pub seed: u64,
    /// Options that set frames and seed.
    pub options: Vec<String>,
    /// Options that set a detector, for methods that need one.
    pub detector: Vec<String>,
    /// Whether it is a whole recorded sequence without changes: only then is it compared with published results.
    pub whole: bool,
}

impl Group {
    /// Returns the name of the group's folder.
    pub fn key(&self) -> String {
        let name: String = self.sequence.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        format!("{name}-{}", self.seed)
    }

    /// Returns the arguments that run some of the methods, without the output folder.
    pub fn arguments(&self, methods: &[&str], extra: &[String]) -> Vec<String> {
        let arguments = ["run", &self.source, "--method", &methods.join(",")].map(str::to_owned);
        let detector = if methods.iter().any(|method| *method != "none") { &self.detector[..] } else { &[] };
        arguments.into_iter().chain([&self.options, detector, extra].concat()).collect()
    }
}

/// The results of one method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Name in the table.
    pub sequence: String,
    /// Name of the method.
    pub method: String,
    /// Seed of the world or of the random draws of the method.
    pub seed: u64,
    /// Absolute trajectory error after alignment by SE(3), RMSE, m.
    pub ate_rmse_m: Option<f64>,
    /// The same, standard deviation, m.
    pub ate_std_m: Option<f64>,
    /// Share of the frames that are tracked.
    pub tracked: Option<f64>,
    /// Relative pose error over a frame, RMSE, m.
    pub rpe_frame_m: Option<f64>,
    /// Relative pose error over a second, RMSE, m.
    pub rpe_second_m: Option<f64>,
    /// The same, standard deviation, m.
    pub rpe_second_std_m: Option<f64>,
    /// Its rotation, RMSE, degrees.
    pub rpe_second_deg: Option<f64>,
    /// The same, standard deviation, degrees.
    pub rpe_second_std_deg: Option<f64>,
    /// Median wall time of each stage of the run, ms.
    pub stages_ms: BTreeMap<String, f64>,
    /// Processor time of the process for a frame, without that of other methods in the same process, ms.
    pub process_ms_per_frame: Option<f64>,
    /// As in [`Group`].
    pub whole: bool,
    /// Why there are no results.
    pub failure: Option<String>,
    /// Arguments with which this program computes the cell alone, with the same results.
    pub arguments: Vec<String>,
    /// CRC-32 of the program.
    pub program_crc32: String,
}

impl Cell {
    /// Reads the results of a method from its output folder; `failure` is used if the folder has no result.
    pub fn of_run(
        group: &Group,
        method: &str,
        folder: &Path,
        failure: Option<&str>,
        arguments: Vec<String>,
        program_crc32: String,
    ) -> Self {
        let text = std::fs::read_to_string(folder.join("run.json")).unwrap_or_default();
        let run: Value = serde_json::from_str(&text).unwrap_or_default();
        let figure = |pointer: &str| run.pointer(pointer).and_then(Value::as_f64);
        let ate_rmse_m = figure("/evaluation/ate/translation_m/rmse");
        let other_methods_ms = figure("/process_parts_ms_per_frame/other_methods").unwrap_or(0.0);
        let own_failure = || Some(std::fs::read_to_string(folder.join(FAILURE_FILE)).ok()?.trim().to_owned());
        let failure = match run {
            Value::Null => own_failure().or_else(|| failure.map(str::to_owned)),
            _ if ate_rmse_m.is_none() => Some("no ground truth for the evaluation".into()),
            _ => None,
        };
        let stages = run.pointer("/times").and_then(Value::as_object).into_iter().flatten();
        let median = |(name, stage): (&String, &Value)| Some((name.clone(), stage.get("median_ms")?.as_f64()?));
        Self {
            sequence: group.sequence.clone(),
            method: method.to_owned(),
            seed: group.seed,
            ate_rmse_m,
            ate_std_m: figure("/evaluation/ate/translation_m/std"),
            tracked: figure("/evaluation/coverage/fraction"),
            rpe_frame_m: figure("/evaluation/rpe/0/translation_m/rmse"),
            rpe_second_m: figure("/evaluation/rpe/1/translation_m/rmse"),
            rpe_second_std_m: figure("/evaluation/rpe/1/translation_m/std"),
            rpe_second_deg: figure("/evaluation/rpe/1/rotation_deg/rmse"),
            rpe_second_std_deg: figure("/evaluation/rpe/1/rotation_deg/std"),
            stages_ms: stages.filter_map(median).collect(),
            process_ms_per_frame: figure("/process_ms_per_frame").map(|ms| ms - other_methods_ms),
            whole: group.whole,
            failure,
            arguments,
            program_crc32,
        }
    }

    /// Reads the cell at `path`; `None` if it is missing or damaged.
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
