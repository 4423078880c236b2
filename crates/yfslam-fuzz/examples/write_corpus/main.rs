//! Writes the files of the corpus that are made from synthetic input: `cargo run -p yfslam-fuzz --example write_corpus`.
//!
//! Files beside them, such as inputs that a fuzzer has found, are left as they are.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a tool for developers")]

#[path = "../../../yfslam-io/tests/common/bags.rs"]
mod bags;
#[path = "../../../yfslam-detect/tests/common/mod.rs"]
mod nets;
#[path = "../../../yfslam-io/tests/common/sqlite.rs"]
mod sqlite;

mod binaries;
mod texts;

use std::fs;
use std::path::Path;

/// A file of the corpus: its target, its name, its content.
type File = (&'static str, &'static str, Vec<u8>);

fn main() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let mut bytes = 0;
    for (target, name, content) in texts::all().into_iter().chain(binaries::all()) {
        let folder = folder.join(target);
        fs::create_dir_all(&folder).unwrap();
        bytes += content.len();
        fs::write(folder.join(name), content).unwrap();
    }
    println!("{bytes} bytes");
}
