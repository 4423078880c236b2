//! The files of this program, for commands that start it again.

use std::io;
use std::path::PathBuf;
use std::sync::OnceLock;

/// The files of this program.
#[derive(Clone, Debug)]
pub struct ProgramFiles {
    /// What starts it.
    pub start: PathBuf,
    /// What differs from version to version.
    pub content: PathBuf,
}

/// The files of a program that is part of another one, such as of the Python package.
static FILES: OnceLock<ProgramFiles> = OnceLock::new();

/// Sets the files, where they are not those of the process; the first call counts.
pub fn set_files(files: ProgramFiles) {
    let _ = FILES.set(files);
}

/// Returns the files.
///
/// # Errors
/// The file of the process is not known.
pub fn files() -> io::Result<ProgramFiles> {
    match FILES.get() {
        Some(files) => Ok(files.clone()),
        None => std::env::current_exe().map(|file| ProgramFiles { start: file.clone(), content: file }),
    }
}
