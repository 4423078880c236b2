//! The program `yfslam` in the package, so that installing the package installs the program.

use std::ffi::OsString;
use std::path::PathBuf;

use pyo3::prelude::*;
use yfslam_cli::ProgramFiles;

/// Runs the program with these arguments, the first of which is its name. `start` is the file that starts it, `content` that of this
/// module. Returns its exit code, or ends the process.
#[pyfunction]
pub fn run_program(py: Python<'_>, arguments: Vec<OsString>, start: PathBuf, content: PathBuf) -> u8 {
    py.detach(|| {
        yfslam_cli::set_files(ProgramFiles { start, content });
        exit_code(yfslam_cli::run_program(arguments))
    })
}

/// Returns the number of an exit code, which the standard library does not show.
fn exit_code(code: std::process::ExitCode) -> u8 {
    (0..=u8::MAX).find(|&number| std::process::ExitCode::from(number) == code).unwrap_or(1)
}
