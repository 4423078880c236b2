//! The command `yfslam`.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    yfslam_cli::run_program(std::env::args_os())
}
