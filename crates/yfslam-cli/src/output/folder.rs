//! The output folder of a command; every file is written whole or not at all.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use yfslam::{Config, Method};
use yfslam_io::write::{Coordinates, write_ply};
use yfslam_io::{StampedPose, prepare_folder, write_atomically, write_trajectory};

use super::dense::DENSE_FILE;
use super::map_frame::{self, MAP_FRAME_FILE};
use super::overlay;
use super::report::RunReport;
use crate::input::settings::describe;
use crate::run::pipeline::Outcome;
use crate::run::resume::{Checkpoint, Resumed, RunIdentity};
use crate::ui::failures::Failures;

/// Parent of the output folders of runs without `--out`.
const DEFAULT_PARENT: &str = "yfslam-out";
/// File with the reason why one method of several has no result.
pub const FAILURE_FILE: &str = "failure.txt";
/// Page with the results.
pub const REPORT_FILE: &str = "report.html";

const TRAJECTORY_FILE: &str = "trajectory.txt";
const KEYFRAMES_FILE: &str = "keyframes.txt";
const LIVE_FILE: &str = "live.txt";
const LANDMARKS_FILE: &str = "map.ply";
const RUN_FILE: &str = "run.json";
const CONFIG_FILE: &str = "config.toml";
/// The state of a run at a checkpoint, and its map.
const CHECKPOINT_FILE: &str = "checkpoint.json";
const CHECKPOINT_MAP_FILE: &str = "checkpoint.map";

/// The results of a run; `config.toml` is no result, and may be the input that repeats the run.
const RESULT_FILES: [&str; 11] = [
    TRAJECTORY_FILE,
    KEYFRAMES_FILE,
    LIVE_FILE,
    LANDMARKS_FILE,
    MAP_FRAME_FILE,
    RUN_FILE,
    REPORT_FILE,
    DENSE_FILE,
    FAILURE_FILE,
    CHECKPOINT_FILE,
    CHECKPOINT_MAP_FILE,
];

/// The folder in which `yfslam map` writes, and its files but for those of backgrounds, which are named after keyframes.
pub const PRODUCTS_FOLDER: &str = "map";
const PRODUCT_FILES: [&str; 15] = [
    MAP_FRAME_FILE,
    "path.txt",
    "cloud.ply",
    "cloud.pcd",
    "above.png",
    "corner.png",
    "classes.png",
    "classes.json",
    "octomap.bt",
    "octomap.ot",
    "semantic.ot",
    "grid.pgm",
    "grid.yaml",
    "grid.png",
    "mesh.ply",
];

/// A folder that can be written to.
#[derive(Clone, Debug)]
pub struct OutputFolder(PathBuf);

impl OutputFolder {
    /// Creates the folder `out`, or else one named after the sequence, and checks that files can be written there. Incomplete files of
    /// killed runs are removed.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn prepare(out: Option<&Path>, name: &str) -> Result<Self> {
        let folder = out.map_or_else(|| Path::new(DEFAULT_PARENT).join(name), PathBuf::from);
        prepare_folder(&folder).with_context(|| format!("the output folder {} cannot be used", folder.display()))?;
        Ok(Self(folder))
    }

    /// Creates a folder in it for one method of several.
    ///
    /// # Errors
    /// As [`OutputFolder::prepare`].
    pub fn for_method(&self, name: &str) -> Result<Self> {
        Self::prepare(Some(&self.0.join(name)), name)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Returns whether `path` is a file of a run in this folder.
    pub fn has_result(&self, path: &Path) -> bool {
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let is_here = matches!((parent.canonicalize(), self.0.canonicalize()), (Ok(a), Ok(b)) if a == b);
        let names = RESULT_FILES.iter().chain([&CONFIG_FILE]);
        is_here && names.map(OsStr::new).any(|name| path.file_name() == Some(name))
    }

    /// Removes the results of an earlier run of one or several methods and what `yfslam map` has made of it, which must not be taken for
    /// results of this one.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn remove_results(&self) -> Result<()> {
        let is_run = |folder: &PathBuf| folder.join(RUN_FILE).is_file() || folder.join(FAILURE_FILE).is_file();
        let methods = Method::ALL.map(|method| self.0.join(describe(method).0));
        for folder in methods.iter().filter(|folder| is_run(folder)).chain([&self.0]) {
            remove_files(folder, |name| RESULT_FILES.contains(&name))?;
            overlay::remove(folder)?;
            let products = folder.join(PRODUCTS_FOLDER);
            if products.join(MAP_FRAME_FILE).is_file() {
                remove_files(&products, |name| PRODUCT_FILES.contains(&name))?;
            }
        }
        Ok(())
    }

    /// Writes why the method has no result.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_failure(&self, reason: &str) -> Result<()> {
        Ok(write_atomically(&self.0.join(FAILURE_FILE), |file| writeln!(file, "{reason}"))?)
    }

    /// Writes the configuration.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_config(&self, config: &Config) -> Result<()> {
        let toml = config.to_commented_toml()?;
        Ok(write_atomically(&self.0.join(CONFIG_FILE), |file| file.write_all(toml.as_bytes()))?)
    }

    /// Writes trajectories as they are now.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_poses(&self, trajectory: &[StampedPose], live: &[StampedPose]) -> Result<()> {
        write_trajectory(&self.0.join(TRAJECTORY_FILE), trajectory)?;
        Ok(write_trajectory(&self.0.join(LIVE_FILE), live)?)
    }

    /// Writes what a later run needs to go on: the map first and the state last, so that a state without its map never is there.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_checkpoint(&self, checkpoint: &Checkpoint, map: &[u8]) -> Result<()> {
        write_atomically(&self.0.join(CHECKPOINT_MAP_FILE), |file| file.write_all(map))?;
        let json = serde_json::to_string(checkpoint)?;
        Ok(write_atomically(&self.0.join(CHECKPOINT_FILE), |file| writeln!(file, "{json}"))?)
    }

    /// Reads the checkpoint of the run `run`.
    ///
    /// # Errors
    /// See [`Resumed::read`].
    pub fn read_checkpoint(&self, run: &RunIdentity) -> Result<Resumed> {
        Resumed::read(&self.0, run, [CHECKPOINT_FILE, CHECKPOINT_MAP_FILE, TRAJECTORY_FILE, LIVE_FILE])
    }

    /// Returns the map of the checkpoint.
    pub fn checkpoint_map(&self) -> PathBuf {
        self.0.join(CHECKPOINT_MAP_FILE)
    }

    /// Removes the checkpoint of a run that has ended.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn remove_checkpoint(&self) -> Result<()> {
        remove_files(&self.0, |name| [CHECKPOINT_FILE, CHECKPOINT_MAP_FILE].contains(&name))
    }

    /// Writes trajectories and landmarks.
    pub fn write(&self, outcome: &Outcome, failures: &mut Failures) {
        let Outcome { trajectory, keyframes, live, landmarks, .. } = outcome;
        for (name, poses) in [(TRAJECTORY_FILE, trajectory), (KEYFRAMES_FILE, keyframes), (LIVE_FILE, live)] {
            failures.keep(write_trajectory(&self.0.join(name), poses));
        }
        failures.keep(write_ply(&self.0.join(LANDMARKS_FILE), Coordinates::World, landmarks.iter().copied(), None));
        failures.keep(map_frame::write(&self.0, &outcome.map_frame));
    }

    /// Writes `run.json`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_report(&self, report: &RunReport) -> Result<()> {
        let json = serde_json::to_string_pretty(report)?;
        Ok(write_atomically(&self.0.join(RUN_FILE), |file| writeln!(file, "{json}"))?)
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
            std::fs::remove_file(&path)
                .with_context(|| format!("cannot remove the old {}; choose another folder", path.display()))?;
        }
    }
    Ok(())
}
