//! Many runs for one table: a cell is one method on one sequence with one seed. One process runs the methods of a sequence and a seed
//! together, on frames that are read or rendered once.
//!
//! In: what to run. Out: one JSON a cell, which is not run again, then tables of all of them.

use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};

use super::cell::{Cell, Group};
use crate::output::folder::FAILURE_FILE;

/// What a method leaves in its folder when it has ended, well or not.
const RESULTS: [&str; 2] = ["run.json", FAILURE_FILE];

/// Runs cells and remembers them.
pub struct Bench {
    /// Where cells and their runs go.
    pub folder: PathBuf,
    /// This program.
    pub program: PathBuf,
    /// CRC-32 of the program: another one runs all cells anew.
    pub program_crc32: String,
    /// Processes at a time.
    pub jobs: usize,
    /// Words for every `yfslam run`.
    pub extra: Vec<String>,
}

impl Bench {
    /// The cells of `groups`, in their order; those that are not done yet are run. `done` is told the number of cells that are.
    ///
    /// # Errors
    /// A run cannot be started or a cell cannot be written. A method that fails is a cell that says so.
    pub fn cells(&self, groups: &[Group], done: impl Fn(usize) + Sync) -> Result<Vec<Cell>> {
        let (next, finished) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let cells = Mutex::new(Vec::new());
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(group) = groups.get(index) else { return };
                let found = self.group(group);
                if let Ok(mut cells) = cells.lock() {
                    cells.push((index, found));
                }
                done(finished.fetch_add(group.methods.len(), Ordering::Relaxed) + group.methods.len());
            }
        };
        std::thread::scope(|scope| (0..self.jobs.max(1)).for_each(|_| drop(scope.spawn(work))));
        let mut groups = cells.into_inner().unwrap_or_else(PoisonError::into_inner);
        groups.sort_by_key(|&(index, _)| index);
        Ok(groups.into_iter().map(|(_, cells)| cells).collect::<Result<Vec<_>>>()?.concat())
    }

    /// The cells that are there already, and those of a new run of the methods that are missing.
    fn group(&self, group: &Group) -> Result<Vec<Cell>> {
        let known: Vec<Option<Cell>> = group.methods.iter().map(|method| self.known(group, method)).collect();
        let missing: Vec<&str> =
            group.methods.iter().zip(&known).filter(|(_, known)| known.is_none()).map(|(m, _)| m.as_str()).collect();
        let together = if missing.is_empty() { None } else { self.run(group, &missing)? };
        let cell = |(method, known): (&String, Option<Cell>)| {
            if let Some(cell) = known {
                return Ok(cell);
            }
            let folder = self.folder_of(group).join(method);
            let left_nothing = RESULTS.iter().all(|name| !folder.join(name).exists());
            // A method that crashed may have taken others along.
            let failure =
                if left_nothing && missing.len() > 1 { self.run(group, &[method])? } else { together.clone() };
            let arguments = group.arguments(&[method], &self.extra);
            let cell = Cell::of_run(group, method, &folder, failure.as_deref(), arguments, self.program_crc32.clone());
            cell.write(&self.path_of(group, method))?;
            Ok(cell)
        };
        group.methods.iter().zip(known).map(cell).collect()
    }

    /// The cell that is there already, of the same program and options.
    fn known(&self, group: &Group, method: &str) -> Option<Cell> {
        let known = Cell::read(&self.path_of(group, method))?;
        let same =
            known.program_crc32 == self.program_crc32 && known.arguments == group.arguments(&[method], &self.extra);
        same.then_some(known)
    }

    /// Runs some methods of a group, each into a folder of its own. Returns what the program said if it failed as a whole.
    fn run(&self, group: &Group, methods: &[&str]) -> Result<Option<String>> {
        let folder = self.folder_of(group);
        for method in methods {
            // What an earlier program left must not pass for the result of this one.
            for name in RESULTS {
                let _ = std::fs::remove_file(folder.join(method).join(name));
            }
        }
        // One method alone has no folder of its own in the output folder.
        let out = if let [method] = methods { folder.join(method) } else { folder };
        let output = Command::new(&self.program)
            .args(group.arguments(methods, &self.extra))
            .arg("--quiet")
            .arg("--out")
            .arg(&out)
            .output()
            .with_context(|| format!("cannot start {}", self.program.display()))?;
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        Ok((!output.status.success()).then_some(said))
    }

    fn folder_of(&self, group: &Group) -> PathBuf {
        self.folder.join("runs").join(group.key())
    }

    fn path_of(&self, group: &Group, method: &str) -> PathBuf {
        self.folder.join("cells").join(format!("{}-{method}.json", group.key()))
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// A program that crashes with the method `boxes`, and so with several.
    const CRASHES: &str = "#!/bin/sh
case \"$4\" in *boxes*) echo boom >&2; exit 101;; esac
for out in \"$@\"; do :; done
mkdir -p \"$out\"
echo '{\"evaluation\":{\"ate\":{\"translation_m\":{\"rmse\":0.5}}}}' > \"$out/run.json\"
";

    #[test]
    fn a_method_that_crashes_does_not_take_the_others_along() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("program");
        std::fs::write(&program, CRASHES).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        let bench =
            Bench { folder: folder.path().into(), program, program_crc32: String::new(), jobs: 1, extra: Vec::new() };
        let group = Group {
            sequence: "world".into(),
            source: "synth:world".into(),
            methods: ["none", "boxes", "yf"].map(str::to_owned).into(),
            seed: 1,
            options: Vec::new(),
            detector: Vec::new(),
            whole: false,
        };
        let cells = bench.cells(&[group], |_| {}).unwrap();
        let figures: Vec<_> = cells.iter().map(|cell| (cell.ate_rmse_m, cell.failure.as_deref())).collect();
        assert_eq!(figures, [(Some(0.5), None), (None, Some("boom")), (Some(0.5), None)]);
    }
}
