//! Saved maps: where a run's map comes from, where it is saved, and on which thread mapping runs.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use yfslam::{Execution, MapUse, SavedMap, Slam, SlamBuilder};
use yfslam_io::{prepare_folder, read_file, write_atomically};

use super::pipeline::Pipeline;

/// Where a run's map comes from, where it is saved, and how it is made.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Map")]
pub struct MapArgs {
    /// Load the map of an earlier run; it is extended after relocalisation in it.
    #[arg(long, value_name = "FILE")]
    pub load_map: Option<PathBuf>,
    /// Only localise in the loaded map, without changing it.
    #[arg(long, visible_alias = "localize", requires = "load_map", conflicts_with = "save_map")]
    pub localise: bool,
    /// Save the map for --load-map and, with --dense, for `yfslam map`.
    #[arg(long, value_name = "FILE")]
    pub save_map: Option<PathBuf>,
    /// Run mapping on its own thread, for live use; results then differ from run to run.
    #[arg(long)]
    pub threaded: bool,
}

impl MapArgs {
    /// Returns the given options that a run of several methods cannot have, because each method makes its own map.
    pub fn single_method_options(&self) -> Vec<&'static str> {
        let options = [
            ("--load-map", self.load_map.is_some()),
            ("--save-map", self.save_map.is_some()),
            ("--threaded", self.threaded),
        ];
        options.iter().filter(|(_, given)| *given).map(|(name, _)| *name).collect()
    }

    /// Returns the thread on which mapping runs.
    pub fn execution(&self) -> Execution {
        if self.threaded { Execution::Threaded } else { Execution::Inline }
    }

    /// Builds the system with these options.
    ///
    /// # Errors
    /// The file cannot be read, is not a map, was made with other settings or, to be extended, with another camera; or it has a dense map
    /// that this run would not save with it.
    pub fn build(&self, builder: SlamBuilder, makes_dense_map: bool) -> Result<Slam> {
        let builder = builder.execution(self.execution());
        let Some(path) = &self.load_map else { return Ok(builder.build()?) };
        let map_use = if self.localise { MapUse::Localise } else { MapUse::Extend };
        let bytes = read_file(path).with_context(|| format!("the map {} cannot be read", path.display()))?;
        let saved =
            SavedMap::from_bytes(&bytes).with_context(|| format!("{} cannot be used as a map", path.display()))?;
        ensure!(
            makes_dense_map || self.save_map.is_none() || saved.dense().is_none(),
            "{} holds a dense map, which only a run with --dense continues; add --dense, or leave out --save-map",
            path.display()
        );
        let built = builder.map(saved, map_use).build();
        built.with_context(|| format!("the map {} cannot be used here", path.display()))
    }

    /// Checks before a run that the map can be written after it.
    ///
    /// # Errors
    /// The map cannot be written.
    pub fn check(&self) -> Result<()> {
        let Some(path) = &self.save_map else { return Ok(()) };
        ensure!(!path.is_dir(), "the map {} cannot be written, because it is a folder; name a file", path.display());
        // Links are followed; the map replaces the file that they lead to. A device has no room to be checked.
        let target = path.canonicalize().unwrap_or_else(|_| path.clone());
        if target.exists() && !target.is_file() {
            return Ok(());
        }
        prepare_folder(target.parent().unwrap_or(Path::new("")))
            .with_context(|| format!("the map {} cannot be written", path.display()))
    }

    /// Returns the map as the bytes of its file, with the dense map if there is one; `None` if it is not to be saved.
    pub fn encode(&self, pipeline: &mut Pipeline) -> Option<Result<Vec<u8>>> {
        self.save_map.as_ref().map(|_| pipeline.save_map())
    }

    /// Writes the map, if that was asked for.
    ///
    /// # Errors
    /// The file cannot be written; an earlier file then stays.
    pub fn write(&self, encoded: &[u8]) -> Result<()> {
        let Some(path) = &self.save_map else { return Ok(()) };
        Ok(write_atomically(path, |file| file.write_all(encoded))?)
    }
}
