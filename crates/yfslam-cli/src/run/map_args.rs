//! Saved maps: where a run's map comes from, where it is saved, and on which thread mapping runs.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Args;
use yfslam::{Execution, MapUse, SavedMap, Slam, SlamBuilder};
use yfslam_io::write_atomically;

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
        let bytes = std::fs::read(path).with_context(|| format!("the map {} cannot be read", path.display()))?;
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
        // Another name: an earlier map at `path` stays until it is replaced.
        let mut probe = path.clone().into_os_string();
        probe.push(".probe");
        let probe = PathBuf::from(probe);
        write_atomically(&probe, |_| Ok(()))
            .with_context(|| format!("the map {} cannot be written", path.display()))?;
        // A probe that stays does no harm.
        let _ = std::fs::remove_file(probe);
        Ok(())
    }

    /// Writes the map, with the dense map if there is one, if that was asked for.
    ///
    /// # Errors
    /// The file cannot be written; an earlier file then stays.
    pub fn save(&self, pipeline: &mut Pipeline) -> Result<()> {
        let Some(path) = &self.save_map else { return Ok(()) };
        let map = pipeline.save_map()?;
        Ok(write_atomically(path, |file| file.write_all(&map))?)
    }
}
