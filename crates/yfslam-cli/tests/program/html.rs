//! `report.html`: one well-formed file that loads nothing, with the figures of `run.json`, the same on every run.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::common::{edit_lines, record, report, succeeds};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use serde_json::Value;
use yfslam::RgbImage;
use yfslam_io::write::write_color_png;

/// Elements that HTML leaves open.
const VOID: [&str; 2] = ["meta", "img"];

/// The content of a page, read as XML; a page that is not well formed panics.
#[derive(Default)]
struct Page {
    /// The page without the elements that hold measured times.
    untimed: String,
    /// Cells of the tables by their key.
    cells: BTreeMap<String, String>,
    /// Values of all attributes that could load something.
    loads: Vec<String>,
    elements: BTreeMap<String, usize>,
    /// All text outside the style sheet.
    text: String,
}

fn read(html: &str) -> Page {
    let mut page = Page::default();
    let mut reader = Reader::from_str(html);
    // Kept here, because of the void elements.
    reader.config_mut().check_end_names = false;
    let mut open: Vec<String> = Vec::new();
    let (mut timed_from, mut key) = (None, None);
    loop {
        let event = reader.read_event().unwrap();
        let is_timed = timed_from.is_some();
        match &event {
            Event::Eof => break,
            Event::Start(tag) | Event::Empty(tag) => {
                let name = tag.name().as_ref().to_owned();
                let attributes = attributes(tag);
                page.loads.extend(
                    ["src", "href", "xlink:href", "data", "srcset", "poster", "action"]
                        .iter()
                        .filter_map(|a| attributes.get(*a).cloned()),
                );
                key = attributes.get("data-key").cloned();
                let is_open = matches!(event, Event::Start(_)) && !VOID.contains(&name.as_str());
                if attributes.contains_key("data-timing") && timed_from.is_none() {
                    timed_from = Some(open.len());
                }
                *page.elements.entry(name.clone()).or_default() += 1;
                if is_open {
                    open.push(name);
                }
            }
            Event::End(tag) => {
                let name = tag.name().as_ref().to_owned();
                assert_eq!(open.pop().as_deref(), Some(name.as_str()), "at byte {}", reader.buffer_position());
                timed_from = timed_from.filter(|depth| *depth < open.len());
            }
            Event::Text(text) => {
                let text = text.to_string();
                if let Some(key) = key.take() {
                    page.cells.insert(key, text.clone());
                }
                if open.last().is_none_or(|name| name != "style") {
                    page.text += &text;
                }
            }
            _ => {}
        }
        if !is_timed && timed_from.is_none() {
            page.untimed += &format!("{event:?}\n");
        }
    }
    assert!(open.is_empty(), "not closed: {open:?}");
    page
}

fn attributes(tag: &BytesStart) -> BTreeMap<String, String> {
    tag.attributes().map(|a| a.unwrap()).map(|a| (a.key.as_ref().to_owned(), a.value.to_string())).collect()
}

fn page(out: &Path) -> (String, Page) {
    let html = fs::read_to_string(out.join("report.html")).unwrap();
    let page = read(&html);
    (html, page)
}

/// Checks that the cells of one method have the figures of its `run.json`.
fn assert_same_figures(page: &Page, method: &str, run: &Value) {
    let mut compared = 0;
    let evaluation = &run["evaluation"];
    let mut compare = |key: &str, value: &Value, decimals: usize| {
        let cell = &page.cells[&format!("{method}.{key}")];
        assert_eq!(cell, &format!("{:.decimals$}", value.as_f64().unwrap()), "{method}.{key}");
        compared += 1;
    };
    for figure in ["rmse", "std", "mean", "median", "max"] {
        compare(&format!("ate.translation_m.{figure}"), &evaluation["ate"]["translation_m"][figure], 4);
    }
    for rpe in evaluation["rpe"].as_array().unwrap() {
        let delta = &rpe["options"]["delta"];
        let delta = match (delta["frames"].as_u64(), delta["seconds"].as_f64()) {
            (Some(1), _) => "1 frame".to_owned(),
            (_, Some(seconds)) => format!("{seconds} s"),
            other => panic!("{other:?}"),
        };
        for kind in ["translation_m", "rotation_deg"] {
            compare(&format!("rpe.{delta}.{kind}.rmse"), &rpe[kind]["rmse"], 4);
        }
    }
    let (tracked, read) = (run["frames"]["tracked"].as_f64().unwrap(), run["frames"]["read"].as_f64().unwrap());
    compare("tracked_percent", &(100.0 * tracked / read).into(), 1);
    assert!(compared >= 8, "{compared}");
}

#[test]
fn the_report_of_a_comparison_is_one_well_formed_file_with_the_figures_of_each_run() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["demo", "--frames", "12", "--methods", "none,yf", "--out", "demo"];
    let output = succeeds(folder.path(), &args);
    let last = output.stdout.lines().last().unwrap();
    assert_eq!(last, format!("report: {}", Path::new("demo").join("report.html").display()));
    let out = folder.path().join("demo");
    let (html, page) = page(&out);
    for method in ["none", "yf"] {
        assert_same_figures(&page, method, &report(&out.join(method)));
    }
    // Two views, each method by itself, four errors over time, one chart of bars; three or four snapshots of each method.
    assert_eq!(page.elements["svg"], 9);
    // The map in three dimensions, whose script is in the page.
    assert_eq!((page.elements["script"], page.elements["canvas"]), (1, 1));
    assert!([6, 8].contains(&page.elements["img"]), "{:?}", page.elements);
    assert!(page.loads.iter().all(|load| load.starts_with("data:image/jpeg;base64,")), "{:?}", page.loads);
    let without_names = html.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for load in ["http:", "https:", "url(", "@import", "<script src", "<link", "<iframe"] {
        assert!(!without_names.contains(load), "{load}");
    }
    // The improvement is that of equation 3.
    let rmse = |method: &str| crate::common::ate_rmse(&report(&out.join(method)));
    let improvement = 100.0 * (1.0 - rmse("yf") / rmse("none"));
    assert!(page.text.contains(&format!("{improvement:.2}").replace('-', "−")), "{improvement}");
}

#[test]
fn the_same_run_twice_gives_the_same_report_apart_from_times() {
    let args = ["run", "synth:walking_xyz?people=1&width=320&height=240&frames=10", "--report", "--out", "out"];
    let untimed = || {
        let folder = tempfile::tempdir().unwrap();
        succeeds(folder.path(), &args);
        let (_, page) = page(&folder.path().join("out"));
        assert_same_figures(&page, "full", &report(&folder.path().join("out")));
        assert!(!page.untimed.contains("processor time") && page.text.contains("processor time"));
        page.untimed
    };
    let (a, b) = (untimed(), untimed());
    assert!(a == b, "{:?}", a.lines().zip(b.lines()).find(|(a, b)| a != b));
}

#[test]
fn without_ground_truth_the_report_says_so_and_draws_no_errors() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("seq"));
    fs::remove_file(folder.path().join("seq/groundtruth.txt")).unwrap();
    succeeds(folder.path(), &["run", "seq", "--method", "none", "--report", "--out", "out"]);
    let (_, page) = page(&folder.path().join("out"));
    assert!(page.text.contains("no ground truth"), "{}", page.text);
    assert!(!page.text.contains("Error over time") && !page.text.contains("ATE"), "{}", page.text);
    assert_eq!(page.elements["svg"], 2);
}

#[test]
fn lost_frames_are_marked_and_skipped_frames_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let seq = folder.path().join("seq");
    record(&seq);
    write_color_png(&seq.join("rgb/black.png"), &RgbImage::new(320, 240)).unwrap();
    let blind = |i: usize, line: &str| {
        let stamp = line.split_once(' ').unwrap().0;
        match i {
            7..=11 => format!("{stamp} rgb/black.png"),
            3 => format!("{stamp} rgb/missing.png"),
            _ => line.to_owned(),
        }
    };
    edit_lines(&seq.join("rgb.txt"), |i, line| Some(blind(i, line)));
    // With few keyframes, the map would be initialised again instead of the camera being lost.
    fs::write(folder.path().join("c.toml"), "[tracking]\nreset_max_keyframes = 0\n").unwrap();
    let args = ["run", "seq", "--method", "none", "--report", "--out", "out", "--config", "c.toml"];
    succeeds(folder.path(), &args);
    let out = folder.path().join("out");
    let (_, page) = page(&out);
    let lost = report(&out)["frames"]["lost"].as_u64().unwrap();
    assert!(lost >= 3, "{lost}");
    assert!(page.text.contains(&format!("{lost} lost")), "{}", page.text);
    assert!(page.text.contains("A cross is where tracking was lost") && page.text.contains("1 skipped (missing file)"));
}

#[test]
fn a_name_that_contains_markup_is_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let name = "<script>alert(1)<&'\"--x";
    record(&folder.path().join(name));
    succeeds(folder.path(), &["run", name, "--method", "none", "--report", "--out", "out"]);
    let (html, page) = page(&folder.path().join("out"));
    assert!(!html.contains("<script>alert"), "{html:.2000}");
    assert_eq!(page.elements["script"], 1);
    assert!(html.contains("&lt;script&gt;alert(1)&lt;&amp;"));
}
