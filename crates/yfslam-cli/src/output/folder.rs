//! The folder that a run leaves behind; every file is written whole or not at all.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use yfslam::Config;
use yfslam_io::write::write_ply;
use yfslam_io::{write_atomically, write_trajectory};

use crate::output::report::Report;
use crate::run::pipeline::Outcome;

/// Folder for the folders of runs whose `--out` is left out.
const DEFAULT_PARENT: &str = "yfslam-out";
/// Why one method of several has no result.
pub const FAILURE_FILE: &str = "failure.txt";

/// A folder that can be written to.
#[derive(Clone, Debug)]
pub struct OutputFolder(PathBuf);

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

    /// A folder in it for one method of several, without word of an earlier failure.
    ///
    /// # Errors
    /// As [`OutputFolder::prepare`].
    pub fn of_method(&self, name: &str) -> Result<Self> {
        let folder = Self::prepare(Some(&self.0.join(name)), name)?;
        // None is there, or it is overwritten if there is a new one.
        let _ = std::fs::remove_file(folder.0.join(FAILURE_FILE));
        Ok(folder)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes why the method has no result.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_failure(&self, why: &str) -> Result<()> {
        Ok(write_atomically(&self.0.join(FAILURE_FILE), |file| writeln!(file, "{why}"))?)
    }

    /// Writes everything but the report.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, outcome: &Outcome, config: &Config) -> Result<()> {
        write_trajectory(&self.0.join("trajectory.txt"), &outcome.trajectory)?;
        write_trajectory(&self.0.join("keyframes.txt"), &outcome.keyframes)?;
        write_trajectory(&self.0.join("live.txt"), &outcome.live)?;
        write_ply(&self.0.join("map.ply"), outcome.landmarks.iter().copied(), None)?;
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
