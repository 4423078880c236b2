//! Runs the cells of a bench: a cell is one method on one sequence with one seed. One process runs all methods of a sequence and a seed on
//! frames that are read or rendered once.
//!
//! In: groups of cells. Out: the cells, each of which is saved as JSON and not run again.

use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context, Result};

use super::cell::{Cell, Group};
use crate::output::folder::FAILURE_FILE;
use crate::ui::interrupt::{Interrupt, Interrupted};

/// Files that a method writes at its end, with or without success.
const RESULTS: [&str; 2] = ["run.json", FAILURE_FILE];

/// Time between two looks at a process.
const POLL: Duration = Duration::from_millis(20);

/// Runs and saves cells.
pub struct Bench {
    /// Folder for cells and runs.
    pub folder: PathBuf,
    /// File of this program.
    pub program: PathBuf,
    /// CRC-32 of the program: cells of another program are run again.
    pub program_crc32: String,
    /// Number of processes at the same time.
    pub jobs: usize,
    /// Options of every `yfslam run`.
    pub extra: Vec<String>,
    /// Ends the bench.
    pub interrupt: Interrupt,
}

impl Bench {
    /// Returns the cells of `groups` in their order, and runs those that are missing. `report` gets the number of finished cells.
    ///
    /// # Errors
    /// A run cannot be started, or a signal has ended the bench; cells that are finished are saved. The failure of a method is stored in
    /// its cell.
    pub fn cells(&self, groups: &[Group], report: impl Fn(usize) + Sync) -> Result<Vec<Cell>> {
        let (next, finished) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let cells = Mutex::new(Vec::new());
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(group) = groups.get(index).filter(|_| self.interrupt.received().is_none()) else { return };
                let result = self.group(group);
                if let Ok(mut cells) = cells.lock() {
                    cells.push((index, result));
                }
                report(finished.fetch_add(group.methods.len(), Ordering::Relaxed) + group.methods.len());
            }
        };
        std::thread::scope(|scope| (0..self.jobs.max(1)).for_each(|_| drop(scope.spawn(work))));
        self.interrupt.check()?;
        let mut groups = cells.into_inner().unwrap_or_else(PoisonError::into_inner);
        groups.sort_by_key(|&(index, _)| index);
        Ok(groups.into_iter().map(|(_, cells)| cells).collect::<Result<Vec<_>>>()?.concat())
    }

    /// Returns the cells of a group: saved ones, and those of a new run of the missing methods.
    fn group(&self, group: &Group) -> Result<Vec<Cell>> {
        let saved: Vec<Option<Cell>> = group.methods.iter().map(|method| self.saved(group, method)).collect();
        let missing: Vec<&str> =
            group.methods.iter().zip(&saved).filter(|(_, saved)| saved.is_none()).map(|(m, _)| m.as_str()).collect();
        let together = if missing.is_empty() { None } else { self.run(group, &missing)? };
        let cell = |(method, saved): (&String, Option<Cell>)| {
            if let Some(cell) = saved {
                return Ok(cell);
            }
            let folder = self.folder_of(group).join(method);
            let has_no_result = RESULTS.iter().all(|name| !folder.join(name).exists());
            // If a method crashes, it ends the process of the other methods, too.
            let failure =
                if has_no_result && missing.len() > 1 { self.run(group, &[method])? } else { together.clone() };
            let arguments = group.arguments(&[method], &self.extra);
            let cell = Cell::of_run(group, method, &folder, failure.as_deref(), arguments, self.program_crc32.clone());
            cell.write(&self.path_of(group, method))?;
            Ok(cell)
        };
        group.methods.iter().zip(saved).map(cell).collect()
    }

    /// Returns the saved cell of the same program and options.
    fn saved(&self, group: &Group, method: &str) -> Option<Cell> {
        let saved = Cell::read(&self.path_of(group, method))?;
        let same =
            saved.program_crc32 == self.program_crc32 && saved.arguments == group.arguments(&[method], &self.extra);
        same.then_some(saved)
    }

    /// Runs some methods of a group, each into its own folder. Returns the error message of the program if it failed.
    ///
    /// # Errors
    /// The program cannot be started, or a signal has ended it; then its unfinished folders are removed.
    fn run(&self, group: &Group, methods: &[&str]) -> Result<Option<String>> {
        let folder = self.folder_of(group);
        for method in methods {
            // Results of an earlier program must not be mistaken for those of this one.
            for name in RESULTS {
                let _ = std::fs::remove_file(folder.join(method).join(name));
            }
        }
        // A single method writes directly to the output folder.
        let out = if let [method] = methods { folder.join(method) } else { folder };
        let mut child = Command::new(&self.program)
            .args(group.arguments(methods, &self.extra))
            .arg("--quiet")
            .arg("--out")
            .arg(&out)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start {}", self.program.display()))?;
        let (status, message) = self.wait(&mut child)?;
        if let Some(interrupted) = self.interrupt.received().or_else(|| signal_of(status)) {
            self.remove_unfinished(group, methods);
            return Err(interrupted.into());
        }
        Ok((!status.success()).then_some(message))
    }

    /// Waits for the end of a process, or ends it after a signal. Returns what it wrote to standard error, too.
    fn wait(&self, child: &mut Child) -> Result<(ExitStatus, String)> {
        let mut errors = child.stderr.take();
        std::thread::scope(|scope| {
            let reader = scope.spawn(move || {
                let mut bytes = Vec::new();
                // A message that is cut short is better than none.
                let _ = errors.as_mut().map(|errors| errors.read_to_end(&mut bytes));
                String::from_utf8_lossy(&bytes).trim().to_owned()
            });
            let status = loop {
                if self.interrupt.received().is_some() {
                    // Its folders are removed, so that it need not end in order. It fails if the process has ended already.
                    let _ = child.kill();
                    break child.wait()?;
                }
                match child.try_wait()? {
                    Some(status) => break status,
                    None => std::thread::sleep(POLL),
                }
            };
            Ok((status, reader.join().unwrap_or_default()))
        })
    }

    /// Removes the folders of methods that have not ended; those of other methods in the folder of the group stay.
    fn remove_unfinished(&self, group: &Group, methods: &[&str]) {
        let folder = self.folder_of(group);
        for method in methods {
            // What stays is overwritten when the bench continues.
            let _ = std::fs::remove_dir_all(folder.join(method));
        }
        // It stays if it holds results of other methods.
        let _ = std::fs::remove_dir(folder);
    }

    fn folder_of(&self, group: &Group) -> PathBuf {
        self.folder.join("runs").join(group.key())
    }

    fn path_of(&self, group: &Group, method: &str) -> PathBuf {
        self.folder.join("cells").join(format!("{}-{method}.json", group.key()))
    }
}

/// Returns the signal that ended the process, if it was sent to the process and not to the bench.
fn signal_of(status: ExitStatus) -> Option<Interrupted> {
    status.code().and_then(Interrupted::of_exit_code)
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// A program that crashes with the method `boxes`, alone or among others.
    const CRASHES: &str = "#!/bin/sh
case \"$4\" in *boxes*) echo boom >&2; exit 101;; esac
for out in \"$@\"; do :; done
mkdir -p \"$out\"
echo '{\"evaluation\":{\"ate\":{\"translation_m\":{\"rmse\":0.5}}}}' > \"$out/run.json\"
";

    #[test]
    fn a_method_that_crashes_does_not_prevent_results_of_the_others() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("program");
        std::fs::write(&program, CRASHES).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        let bench = Bench {
            folder: folder.path().into(),
            program,
            program_crc32: String::new(),
            jobs: 1,
            extra: Vec::new(),
            interrupt: Interrupt::watch().unwrap(),
        };
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
