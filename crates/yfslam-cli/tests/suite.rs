//! The standing suite in short forms: where people walk, trusting every feature fails and the dynamic filter does not; where nothing
//! walks, the filter costs nothing. `yfslam bench --seeds 5` is the long form.
#![allow(clippy::unwrap_used, reason = "a test may")]

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use common::succeeds;
use serde_json::Value;

/// Half the size and half the rate: ten seconds of a world in a few seconds.
const SHORT: &str = "width=320&height=240&fps=15";

/// Errors (RMSE of the ATE in m, share of tracked frames) by world and method.
type Figures = BTreeMap<(String, String), (f64, f64)>;

/// Runs the named worlds, `frames` each, with `seed`.
fn figures(folder: &Path, names: &[&str], frames: usize, methods: &str) -> Figures {
    let specs: Vec<String> = names.iter().map(|name| format!("{name}?{SHORT}")).collect();
    let frames = frames.to_string();
    let mut args = vec!["bench", "-q", "--methods", methods, "--seeds", "1", "--frames", &frames, "--out", "b"];
    args.extend(["--jobs", "2"]);
    args.extend(specs.iter().map(String::as_str));
    succeeds(folder, &args);
    let mut figures = Figures::new();
    for entry in fs::read_dir(folder.join("b/cells")).unwrap() {
        let cell: Value = serde_json::from_str(&fs::read_to_string(entry.unwrap().path()).unwrap()).unwrap();
        assert_eq!(cell["failure"], Value::Null, "{cell}");
        let name = cell["sequence"].as_str().unwrap().split('?').next().unwrap().to_owned();
        let method = cell["method"].as_str().unwrap().to_owned();
        figures.insert((name, method), (cell["ate_rmse_m"].as_f64().unwrap(), cell["tracked"].as_f64().unwrap()));
    }
    println!("{figures:#?}");
    figures
}

fn of(figures: &Figures, name: &str, method: &str) -> (f64, f64) {
    figures[&(name.to_owned(), method.to_owned())]
}
