//! Fuzz targets: every reader of the project as a function of bytes.
//!
//! ```text
//! fuzz/corpus/<target>/ ──┬─► tests/mutations.rs          bounded, the same cases on every run, with `cargo test`
//!   small files that are  ├─► examples/mutate.rs          the same mutations for as long as one likes
//!   read as they should   └─► fuzz/fuzz_targets/*.rs      cargo-fuzz, guided by coverage (tools/fuzz.sh)
//!                                    │
//!                                    ▼
//!                         TARGETS: a function for each reader
//! ```
//!
//! A target must return, whatever the bytes are: without a panic, in a time that does not depend on numbers in the bytes, and with memory
//! that does not either. What it returns says whether the bytes were accepted, so that a test can show that the files of the corpus get
//! as far as they should.
#![forbid(unsafe_code)]

pub mod mutation;
mod scratch;
mod targets;

/// A reader that is fuzzed.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Name of the target and of the folder of its corpus.
    pub name: &'static str,
    /// Reads bytes and returns whether they were accepted.
    pub run: fn(&[u8]) -> bool,
    /// Longest input that is worth trying, bytes.
    pub max_length: usize,
}

/// All targets, in the order of their names.
pub const TARGETS: &[Target] = &[
    Target { name: "bag_db3", run: targets::bags::db3, max_length: 16_384 },
    Target { name: "bag_folder", run: targets::bags::folder, max_length: 4_096 },
    Target { name: "bag_mcap", run: targets::bags::mcap, max_length: 8_192 },
    Target { name: "bag_ros1", run: targets::bags::ros1, max_length: 16_384 },
    Target { name: "camera", run: targets::texts::camera, max_length: 4_096 },
    Target { name: "config", run: targets::texts::config, max_length: 8_192 },
    Target { name: "dense_map", run: targets::maps::dense_map, max_length: 65_536 },
    Target { name: "dense_map_records", run: targets::maps::dense_map_records, max_length: 65_536 },
    Target { name: "detections", run: targets::texts::detections, max_length: 4_096 },
    Target { name: "eval", run: targets::evaluation::eval, max_length: 8_192 },
    Target { name: "frames", run: targets::frames::frames, max_length: 64 },
    Target { name: "image_color", run: targets::images::color, max_length: 8_192 },
    Target { name: "image_depth", run: targets::images::depth, max_length: 8_192 },
    Target { name: "image_mask", run: targets::images::mask, max_length: 8_192 },
    Target { name: "lists", run: targets::sequences::lists, max_length: 4_096 },
    Target { name: "map", run: targets::maps::map, max_length: 65_536 },
    Target { name: "map_records", run: targets::maps::map_records, max_length: 65_536 },
    Target { name: "message", run: targets::bags::message, max_length: 8_192 },
    Target { name: "network", run: targets::network::network, max_length: 65_536 },
    Target { name: "pipe", run: targets::pipe::pipe, max_length: 8_192 },
    Target { name: "sequence", run: targets::sequences::sequence, max_length: 8_192 },
    Target { name: "synth_spec", run: targets::texts::synth_spec, max_length: 1_024 },
    Target { name: "trajectory", run: targets::texts::trajectory, max_length: 4_096 },
];

/// Returns the target of this name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_sorted_and_found() {
        assert!(TARGETS.is_sorted_by(|a, b| a.name < b.name));
        assert_eq!(target("pipe").map(|target| target.name), Some("pipe"));
        assert!(target("nothing").is_none());
    }
}
