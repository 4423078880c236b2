//! `yfslam bench`: each cell is run once, and the tables have all cells.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::common::{fails, record, succeeds};

/// A world without people: quick to render, and every method tracks it.
const EMPTY: &str = "walking_xyz?people=0&width=320&height=240";

/// Returns the cells, sorted, and when they were written.
fn cells(root: &Path) -> Vec<(PathBuf, SystemTime)> {
    let mut cells: Vec<_> = fs::read_dir(root.join("b/cells")).unwrap().map(|e| e.unwrap().path()).collect();
    cells.sort();
    cells.into_iter().map(|path| (path.clone(), fs::metadata(path).unwrap().modified().unwrap())).collect()
}

#[test]
fn a_bench_continues_where_it_stopped_with_worlds_and_folders() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    record(&root.join("seq"));
    fs::write(root.join("seq/boxes.json"), r#"{"classes":["person"],"frames":[]}"#).unwrap();
    let args = ["bench", EMPTY, "seq", "--methods", "none,yf", "--seeds", "2", "--frames", "8", "--out", "b"];
    let first = succeeds(root, &args);
    for row in ["walking_xyz?people=0", "seq ", "100.0 (100.0)"] {
        assert!(first.stdout.contains(row), "no '{row}' in {}", first.stdout);
    }
    assert_eq!(fs::read_to_string(root.join("b/cells.csv")).unwrap().lines().count(), 9);
    let [page, text, ate] = ["report.html", "table.md", "tables/ate.csv"]
        .map(|name| fs::read_to_string(root.join("b").join(name)).unwrap());
    for table in ["Table 2", "Table 3", "Table 4", "Table 5", "Frames tracked"] {
        assert!(page.contains(table) && text.contains(table), "no {table}");
    }
    assert_eq!(ate.lines().count(), 5);
    assert!(!page.contains("published: ") && !ate.contains("published: "), "nothing was published about these");
    let before = cells(root);
    assert_eq!(before.len(), 8);
    // One method of a group is missing, and both of another, one of them truncated: only these are run again.
    fs::remove_file(&before[0].0).unwrap();
    fs::remove_file(&before[2].0).unwrap();
    fs::write(&before[3].0, "{\"seq").unwrap();
    let second = succeeds(root, &args);
    assert_eq!(second.stdout, first.stdout);
    let after = cells(root);
    assert!(after[1] == before[1] && after[4..] == before[4..]);
    assert!(after[0].1 > before[0].1 && after[2].1 > before[2].1 && after[3].1 > before[3].1);
    // A further method runs alone.
    succeeds(root, &[&args[..4], &["none,boxes,yf"], &args[5..]].concat());
    let more = cells(root);
    assert_eq!(more.len(), 12);
    assert!(after.iter().all(|cell| more.contains(cell)));
    // Other options give other results.
    succeeds(root, &[&args[..], &["--", "--start", "2"]].concat());
    assert!(cells(root).iter().filter(|cell| more.contains(cell)).count() == 4);
}

#[test]
fn the_failure_of_a_method_is_stored_in_its_cell_and_the_others_have_results() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let args = ["bench", EMPTY, "--methods", "none,yf", "--seeds", "1", "--frames", "8", "--out", "b"];
    let output = succeeds(root, &[&args[..], &["--", "--fault", "black@0+9"]].concat());
    assert!(output.stderr.contains("no map could be initialised"), "{}", output.stderr);
    let csv = fs::read_to_string(root.join("b/cells.csv")).unwrap();
    assert_eq!(csv.matches("no map could be initialised").count(), 2, "{csv}");
    // A file in place of the folder for the images of one method.
    let run = fs::read_dir(root.join("b/runs")).unwrap().next().unwrap().unwrap().path();
    fs::write(run.join("none/overlay"), "").unwrap();
    succeeds(root, &[&args[..], &["--", "--overlay"]].concat());
    let csv = fs::read_to_string(root.join("b/cells.csv")).unwrap();
    let line = |method: &str| csv.lines().find(|line| line.contains(&format!(",{method},1,"))).unwrap();
    assert!(line("none").contains(",none,1,,,,,,,,,,\"") && line("none").contains("overlay"), "{csv}");
    assert!(line("yf").contains(",yf,1,0.") && line("yf").ends_with(','), "{csv}");
    // A run that cannot start.
    let output = succeeds(root, &[&args[..], &["--", "--depth-factor", "5"]].concat());
    assert!(output.stderr.contains("leave out --depth-factor"), "{}", output.stderr);
    fails(root, &["bench", "nowhere"], &["nowhere is not a folder", "walking_xyz"]);
}

#[test]
fn a_folder_of_sequences_is_run_and_published_results_are_added_to_benchmark_sequences() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    for name in ["rgbd_bonn_crowd", "other"] {
        record(&root.join("data").join(name));
        fs::write(root.join("data").join(name).join("boxes.json"), r#"{"classes":["person"],"frames":[]}"#).unwrap();
    }
    let table = |out: &str| fs::read_to_string(root.join(out).join("tables/ate.csv")).unwrap();
    succeeds(root, &["bench", "data", "--methods", "none", "--seeds", "1", "--out", "all"]);
    let rows = table("all");
    assert!(rows.contains("\nother,none,") && rows.contains("\nrgbd_bonn_crowd,none,"), "{rows}");
    let quoted: Vec<&str> = rows.lines().filter(|line| line.contains("published: ")).collect();
    assert!(quoted.len() == 4 && quoted.iter().all(|line| line.starts_with("rgbd_bonn_crowd,")), "{rows}");
    // Published results are not added to a part of a sequence.
    let known = ["bench", "--known", "data", "--methods", "none", "--seeds", "1"];
    let output = succeeds(root, &[&known[..], &["--frames", "8", "--out", "part"]].concat());
    assert!(!table("part").contains("published: ") && !table("part").contains("other"), "{}", table("part"));
    for words in ["23 of 24", "rgbd_bonn_crowd2", "9 of 9", "rgbd_dataset_freiburg3_walking_rpy", "ipb.uni-bonn.de"] {
        assert!(output.stderr.contains(words), "no '{words}' in {}", output.stderr);
    }
    assert!(fs::read_to_string(root.join("part/table.md")).unwrap().contains("rgbd_bonn_crowd2"));
    fails(root, &["bench", "--known", "data/other"], &["none of the benchmark", "walking_xyz"]);
    fails(root, &["bench", "data/other/rgb"], &["lists of images"]);
}

#[test]
fn recordings_of_the_same_name_are_distinguished_by_their_parents() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    for name in ["a/rgbd_bonn_crowd", "b/rgbd_bonn_crowd"] {
        record(&root.join(name));
    }
    let args = ["bench", "a/rgbd_bonn_crowd", "b/rgbd_bonn_crowd", "b/../a/rgbd_bonn_crowd"];
    let output =
        succeeds(root, &[&args[..], &["--methods", "none", "--seeds", "1", "--jobs", "2", "--out", "o"]].concat());
    let cells: Vec<_> = fs::read_dir(root.join("o/cells")).unwrap().collect();
    assert_eq!(cells.len(), 2);
    let rows = fs::read_to_string(root.join("o/tables/ate.csv")).unwrap();
    for row in ["\na/rgbd_bonn_crowd,none,", "\nb/rgbd_bonn_crowd,none,", "published: "] {
        assert!(rows.contains(row), "{rows}");
    }
    assert!(!output.stdout.contains("2 runs"), "{}", output.stdout);
    // Names that differ only in characters that files cannot have.
    for name in ["c/x y", "c/x_y"] {
        record(&root.join(name));
    }
    fails(root, &["bench", "c/x y", "c/x_y", "--methods", "none"], &["c/x y", "c/x_y", "rename one of the folders"]);
}

#[test]
fn trajectories_of_other_systems_stand_in_the_same_tables_figures_and_statistics() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let args = ["bench", EMPTY, "--methods", "none", "--seeds", "2", "--frames", "12", "--out", "b"];
    succeeds(root, &args);
    // The other system has the same trajectory for the second seed, and a worse one for the first.
    fs::create_dir(root.join("other")).unwrap();
    let runs = root.join("b/runs");
    let mut keys: Vec<String> =
        fs::read_dir(&runs).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    keys.sort();
    let text = |key: &str| fs::read_to_string(runs.join(key).join("none/trajectory.txt")).unwrap();
    let shifted = |(index, line): (usize, &str)| {
        let mut columns: Vec<String> = line.split(' ').map(str::to_owned).collect();
        if index % 2 == 1 && !line.starts_with('#') {
            columns[1] = (columns[1].parse::<f64>().unwrap() + 0.05).to_string();
        }
        columns.join(" ") + "\n"
    };
    let worse: String = text(&keys[0]).lines().enumerate().map(shifted).collect();
    fs::write(root.join("other").join(format!("{}.txt", keys[0].trim_end_matches("-1"))), worse).unwrap();
    fs::write(root.join("other").join(format!("{}.txt", keys[1])), text(&keys[1])).unwrap();
    succeeds(root, &[&args[..], &["--external", "Other=other"]].concat());
    let read = |name: &str| fs::read_to_string(root.join("b").join(name)).unwrap();
    let cells = read("cells.csv");
    let figures = |start: &str| {
        let line = cells.lines().find(|line| line.contains(start)).unwrap_or_else(|| panic!("no {start} in {cells}"));
        line.split_once(start).unwrap().1.split(',').next().unwrap().parse::<f64>().unwrap()
    };
    // Trajectory files have nine decimals.
    assert!((figures(",none,2,") - figures(",Other,2,")).abs() < 1e-6, "{cells}");
    assert!(figures(",Other,1,") > figures(",none,1,"), "{cells}");
    assert!(read("summary.csv").contains(",Other,2,0,"), "{}", read("summary.csv"));
    assert!(read("tables/paired.csv").contains("Other,none,2,"), "{}", read("tables/paired.csv"));
    let latex = read("tables/ate.tex");
    assert!(latex.contains("\\toprule") && latex.contains("& none & \\textbf{"), "{latex}");
    assert!(read("report.html").contains("data:image/svg+xml;base64,"));
    let drawn: Vec<_> = fs::read_dir(root.join("b/figures")).unwrap().collect();
    assert!(drawn.len() >= 4, "{drawn:?}");
    let svg = read(&format!("figures/{}-trajectory-from-above.svg", keys[0]));
    assert!(svg.contains("Other") && svg.contains("ground truth"));
    // A sequence without a trajectory of the other system is a failed run.
    fs::create_dir(root.join("empty")).unwrap();
    let output = succeeds(root, &[&args[..], &["--external", "Other=empty"]].concat());
    assert!(output.stderr.contains("no trajectory such as"), "{}", output.stderr);
    fails(root, &[&args[..], &["--external", "none=other"]].concat(), &["another name"]);
    fails(root, &[&args[..], &["--external", "Other=nowhere"]].concat(), &["nowhere", "does not exist"]);
    fails(root, &[&args[..], &["--external", "Other"]].concat(), &["NAME=FILE"]);
}
