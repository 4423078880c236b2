//! The command `yfslam`.

use std::process::ExitCode;

fn main() -> ExitCode {
    yfslam_cli::run_program(std::env::args_os())
}
