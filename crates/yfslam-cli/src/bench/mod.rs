//! Many runs for one table: each cell is a run of one sequence with one method and one seed, in a process of its own.
//!
//! In: what to run. Out: one JSON a cell, which is not run again, then [`table`]s of all of them.

mod cell;
mod table;

use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};

pub use cell::{Cell, Plan};
pub use table::{csv, markdown};

/// Runs cells and remembers them.
pub struct Bench {
    /// Where cells and their runs go.
    pub folder: PathBuf,
    /// This program.
    pub program: PathBuf,
    /// CRC-32 of the program: another one runs all cells anew.
    pub program_crc32: String,
    /// Cells at a time.
    pub jobs: usize,
    /// Words for every `yfslam run`.
    pub extra: Vec<String>,
}

impl Bench {
    /// The cells of `plans`, in their order; those that are not done yet are run. `done` is told the number of cells that are.
    ///
    /// # Errors
    /// A run cannot be started or its cell cannot be written. A run that fails is a cell that says so.
    pub fn cells(&self, plans: &[Plan], done: impl Fn(usize) + Sync) -> Result<Vec<Cell>> {
        let (next, finished) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let cells = Mutex::new(Vec::new());
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(plan) = plans.get(index) else { return };
                let cell = self.cell(plan);
                if let Ok(mut cells) = cells.lock() {
                    cells.push((index, cell));
                }
                done(finished.fetch_add(1, Ordering::Relaxed) + 1);
            }
        };
        std::thread::scope(|scope| (0..self.jobs.max(1)).for_each(|_| drop(scope.spawn(work))));
        let mut cells = cells.into_inner().unwrap_or_else(PoisonError::into_inner);
        cells.sort_by_key(|&(index, _)| index);
        cells.into_iter().map(|(_, cell)| cell).collect()
    }

    /// The cell that is there already, or that of a new run.
    fn cell(&self, plan: &Plan) -> Result<Cell> {
        let path = self.folder.join("cells").join(plan.key() + ".json");
        let arguments = plan.arguments(&self.extra);
        if let Some(known) = Cell::read(&path)
            && known.program_crc32 == self.program_crc32
            && known.arguments == arguments
        {
            return Ok(known);
        }
        let run = self.folder.join("runs").join(plan.key());
        // What an earlier program left must not pass for the result of this one.
        let _ = std::fs::remove_file(run.join("run.json"));
        let output = Command::new(&self.program)
            .args(&arguments)
            .arg("--quiet")
            .arg("--out")
            .arg(&run)
            .output()
            .with_context(|| format!("cannot start {}", self.program.display()))?;
        let error = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        let failure = (!output.status.success()).then_some(error);
        let cell = Cell::of_run(plan, &run.join("run.json"), failure, arguments, self.program_crc32.clone());
        cell.write(&path)?;
        Ok(cell)
    }
}
