//! `yfslam bench`: cells are run once, tables hold them all.
#![allow(clippy::unwrap_used, reason = "a test may")]

mod common;

use std::fs;

use common::{fails, record, succeeds};

#[test]
fn a_bench_goes_on_where_it_stopped_and_tells_worlds_and_folders_alike() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    record(&root.join("seq"));
    let world = "walking_xyz?people=0&width=320&height=240";
    let args = ["bench", world, "seq", "--methods", "none", "--seeds", "2", "--frames", "8", "--out", "b"];
    let first = succeeds(root, &args);
    for row in ["walking_xyz?people=0", "seq ", "100.0 (100.0)"] {
        assert!(first.stdout.contains(row), "no '{row}' in {}", first.stdout);
    }
    assert_eq!(fs::read_to_string(root.join("b/cells.csv")).unwrap().lines().count(), 5);
    let cells = || {
        let mut cells: Vec<_> = fs::read_dir(root.join("b/cells")).unwrap().map(|e| e.unwrap().path()).collect();
        cells.sort();
        cells.into_iter().map(|path| (fs::metadata(&path).unwrap().modified().unwrap(), path)).collect::<Vec<_>>()
    };
    let before = cells();
    assert_eq!(before.len(), 4);
    // One cell is missing, one is cut in half: both are run again, the others are not.
    fs::remove_file(&before[0].1).unwrap();
    fs::write(&before[1].1, "{\"seq").unwrap();
    let second = succeeds(root, &args);
    assert_eq!(second.stdout, first.stdout);
    assert_eq!(cells()[2..], before[2..]);
    // Other options, other figures.
    succeeds(root, &[&args[..], &["--", "--start", "2"]].concat());
    assert_ne!(cells()[2..], before[2..]);
}

#[test]
fn a_run_that_fails_is_a_cell_that_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["bench", "walking_xyz?people=0&width=320&height=240", "--methods", "none", "--seeds", "1"];
    let faulty = ["--frames", "8", "--out", "b", "--", "--fault", "black@0+9"];
    let output = succeeds(folder.path(), &[&args[..], &faulty].concat());
    assert!(output.stderr.contains("no map could be begun"), "{}", output.stderr);
    let csv = fs::read_to_string(folder.path().join("b/cells.csv")).unwrap();
    assert!(csv.contains("no map could be begun"), "{csv}");
    fails(folder.path(), &["bench", "nowhere"], &["nowhere is no folder", "walking_xyz"]);
}
