//! The corpus of the tree: each file of it is read as far as it should, and no mutation of it makes a reader panic or take memory
//! without bound.
#![allow(clippy::unwrap_used, reason = "a test may")]

mod counted;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use counted::Counted;
use yfslam_fuzz::mutation::Mutator;
use yfslam_fuzz::{TARGETS, Target};

#[global_allocator]
static MEMORY: Counted = Counted;

/// Time for the mutations of each target. The cases are the same on every run, but a slow machine tries fewer of them.
const TIME: Duration = Duration::from_millis(500);
/// Most mutations of each target.
const CASES: usize = 20_000;
/// Most memory that a target may take for a file of a few kilobytes, bytes. The largest chunk of a bag and the largest image are less.
const MOST_BYTES: usize = 1 << 30;
/// Longest time that a target may take for one input. It takes milliseconds; a shared machine may stop for long.
const LONGEST: Duration = Duration::from_secs(20);

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus")
}

/// Returns the names and the contents of the files of a target, in the order of their names.
fn files(target: &Target) -> Vec<(String, Vec<u8>)> {
    let folder = corpus().join(target.name);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = paths
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(&path).unwrap()))
        .collect();
    files.sort();
    files
}

#[test]
fn files_of_the_corpus_are_read_and_those_named_bad_are_refused() {
    let mut wrong = Vec::new();
    for target in TARGETS {
        let files = files(target);
        assert!(files.iter().any(|(name, _)| !name.starts_with("bad")), "{} has no good file", target.name);
        for (name, bytes) in files {
            if (target.run)(&bytes) == name.starts_with("bad") {
                wrong.push(format!("{}/{name}", target.name));
            }
            assert!(bytes.len() <= target.max_length, "{}/{name} is longer than its target reads", target.name);
        }
    }
    assert!(wrong.is_empty(), "refused, or accepted though their names begin with `bad`: {}", wrong.join(", "));
}

#[test]
fn the_corpus_is_small_and_has_a_folder_for_each_target() {
    let mut bytes = 0;
    for entry in fs::read_dir(corpus()).unwrap() {
        let folder = entry.unwrap();
        let name = folder.file_name();
        let target = TARGETS.iter().find(|target| target.name == name);
        let target = target.unwrap_or_else(|| panic!("{} belongs to no target", folder.path().display()));
        bytes += files(target).iter().map(|(_, bytes)| bytes.len()).sum::<usize>();
    }
    assert!(bytes < 300_000, "the corpus has {bytes} bytes");
}

#[test]
fn mutations_of_the_corpus_cause_no_panic_and_take_neither_time_nor_memory_without_bound() {
    for target in TARGETS {
        let files: Vec<Vec<u8>> = files(target).into_iter().map(|(_, bytes)| bytes).collect();
        let mut mutator = Mutator::new(1, target.max_length);
        let begin = Instant::now();
        for case in 0..CASES {
            let bytes = mutator.mutate(&files);
            let run = Instant::now();
            let (_, most) = counted::most_bytes(|| (target.run)(&bytes));
            assert!(most <= MOST_BYTES, "{} took {most} bytes for case {case}", target.name);
            let took = run.elapsed();
            assert!(took <= LONGEST, "{} took {took:?} for case {case}", target.name);
            if begin.elapsed() > TIME {
                break;
            }
        }
    }
}
