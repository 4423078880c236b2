//! The output folder of a command; every file is written whole or not at all.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use yfslam::Config;
use yfslam_io::write::write_ply;
use yfslam_io::{write_atomically, write_trajectory};

use super::report::RunReport;
use crate::run::pipeline::Outcome;

/// Parent of the output folders of runs without `--out`.
const DEFAULT_PARENT: &str = "yfslam-out";
/// File with the reason why one method of several has no result.
pub const FAILURE_FILE: &str = "failure.txt";

/// A folder that can be written to.
#[derive(Clone, Debug)]
pub struct OutputFolder(PathBuf);

impl OutputFolder {
    /// Creates the folder `out`, or else one named after the sequence, and checks that files can be written there.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn prepare(out: Option<&Path>, name: &str) -> Result<Self> {
        let folder = out.map_or_else(|| Path::new(DEFAULT_PARENT).join(name), PathBuf::from);
        let probe = folder.join(".yfslam-probe");
        write_atomically(&probe, |_| Ok(()))
            .with_context(|| format!("the output folder {} cannot be used", folder.display()))?;
        // A probe that stays does no harm.
        let _ = std::fs::remove_file(&probe);
        Ok(Self(folder))
    }

    /// Creates a folder in it for one method of several, and removes the failure of an earlier run.
    ///
    /// # Errors
    /// As [`OutputFolder::prepare`].
    pub fn for_method(&self, name: &str) -> Result<Self> {
        let folder = Self::prepare(Some(&self.0.join(name)), name)?;
        // The file may not exist; if it cannot be removed, a new failure overwrites it.
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
    pub fn write_failure(&self, reason: &str) -> Result<()> {
        Ok(write_atomically(&self.0.join(FAILURE_FILE), |file| writeln!(file, "{reason}"))?)
    }

    /// Writes trajectories, landmarks and configuration.
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
    pub fn write_report(&self, report: &RunReport) -> Result<()> {
        let json = serde_json::to_string_pretty(report)?;
        Ok(write_atomically(&self.0.join("run.json"), |file| writeln!(file, "{json}"))?)
    }
}

/// Removes the files of an earlier run, recognised by their names, from a folder that need not exist.
///
/// # Errors
/// A file cannot be removed.
pub fn remove_files(folder: &Path, is_ours: impl Fn(&str) -> bool) -> Result<()> {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if is_ours(&entry.file_name().to_string_lossy()) {
            let path = entry.path();
            std::fs::remove_file(&path).with_context(|| format!("cannot remove the old {}", path.display()))?;
        }
    }
    Ok(())
}
