//! Measures the program `yfslam` and writes the pages of results.
//!
//! - [`topics`]: what is measured for each page, and how the page is written from the records.
//! - [`record`], [`row`], [`state`]: the records and the state of the project that they name.
//! - [`program`], [`trajectories`]: runs the program as a process of its own and reads what it leaves.
//! - [`render`]: pages from records, and the check that they agree.
//! - [`dense`], [`places`]: experiments that use the internals of the core.
//! - [`links`]: links of pages that lead nowhere.

pub mod dense;
pub mod links;
pub mod places;
pub mod program;
pub mod record;
pub mod render;
pub mod row;
pub mod state;
pub mod topics;
pub mod trajectories;

use std::path::PathBuf;

/// The root of the project.
pub fn root() -> PathBuf {
    let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    root.canonicalize().unwrap_or(root)
}
