//! The header says what the library does.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may")]

mod layout;
mod names;

use crate::error::{Failure, Status};
use crate::ffi::guarded;

/// The header.
const HEADER: &str = include_str!("../../include/yfslam.h");

/// Returns the value of a macro of the header.
fn macro_value(name: &str) -> i32 {
    let value = HEADER.lines().find_map(|line| line.strip_prefix(&format!("#define {name} ")));
    value.unwrap_or_else(|| panic!("the header has no {name}")).parse().unwrap()
}

#[test]
fn a_panic_becomes_a_status_and_leaves_a_text() {
    let status = guarded(|| panic!("a test of panics"));
    assert_eq!(status, macro_value("YFSLAM_ERROR_INTERNAL"));
    assert_eq!(guarded(|| Err(Failure::argument("a\0b"))), macro_value("YFSLAM_ERROR_ARGUMENT"));
    assert_eq!(guarded(|| Ok(())), macro_value("YFSLAM_OK"));
}

#[test]
fn numbers_of_the_header_are_those_of_the_library() {
    let statuses = [
        ("YFSLAM_OK", Status::Ok),
        ("YFSLAM_ERROR_ARGUMENT", Status::Argument),
        ("YFSLAM_ERROR_SETUP", Status::Setup),
        ("YFSLAM_ERROR_FRAME", Status::Frame),
        ("YFSLAM_ERROR_FILE", Status::File),
        ("YFSLAM_ERROR_INTERNAL", Status::Internal),
        ("YFSLAM_END", Status::End),
    ];
    for (name, status) in statuses {
        assert_eq!(macro_value(name), status as i32, "{name}");
    }
    assert_eq!(macro_value("YFSLAM_ABI_VERSION"), crate::exports::library::ABI_VERSION as i32);
}
