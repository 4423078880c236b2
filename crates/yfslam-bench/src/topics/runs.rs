//! Runs of `yfslam run` with one or several methods, and the figures that all topics take from `run.json`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use serde_json::Value;

use super::Setup;
use crate::program::read_run;
use crate::row::Row;

/// The run of one method.
pub struct MethodRun {
    /// Name of the method.
    pub method: String,
    /// Its folder.
    pub folder: PathBuf,
    /// `run.json`, or why there is none.
    pub result: Result<Value, String>,
}

/// Takes a sequence through some methods side by side. Returns the command and the run of each method.
///
/// # Errors
/// The program cannot be started, does not take the arguments, or crashes. A method without a trajectory is a result.
pub fn methods(
    setup: &Setup,
    sequence: &str,
    methods: &[&str],
    options: &[String],
) -> Result<(String, Vec<MethodRun>)> {
    let out = setup.program.out.join("run");
    let _ = std::fs::remove_dir_all(&out);
    let words = ["run", sequence, "--method", &methods.join(","), "--quiet", "--out", &out.to_string_lossy()];
    let arguments: Vec<String> = words.map(str::to_owned).into_iter().chain(options.iter().cloned()).collect();
    let (text, _, code) = setup.program.try_run(&arguments)?;
    let run = |method: &&str| {
        let folder = if methods.len() == 1 { out.clone() } else { out.join(method) };
        let result = read_run(&folder).map_err(|_| {
            let failure = std::fs::read_to_string(folder.join("failure.txt"));
            failure.unwrap_or_else(|_| text.clone()).trim().to_owned()
        });
        MethodRun { method: (*method).to_owned(), folder, result }
    };
    let runs: Vec<_> = methods.iter().map(run).collect();
    let command = setup.program.command(&arguments);
    if code.is_none_or(|code| code > 1) {
        anyhow::bail!("{command} failed: {text}");
    }
    Ok((command, runs))
}

/// A number in a JSON value by its path.
pub fn number(value: &Value, path: &str) -> Option<f64> {
    value.pointer(path)?.as_f64()
}

/// The figures of accuracy that a run has.
pub fn accuracy(row: Row, run: &Value) -> Row {
    let tracked = number(run, "/frames/tracked").zip(number(run, "/frames/read"));
    row.figure("ate_m", number(run, "/evaluation/ate/translation_m/rmse"))
        .figure("tracked", tracked.map(|(tracked, read)| tracked / read.max(1.0)))
        .figure("frames_tracked", number(run, "/frames/tracked"))
        .figure("frames_read", number(run, "/frames/read"))
        .figure("rpe_frame_m", number(run, "/evaluation/rpe/0/translation_m/rmse"))
        .figure("rpe_frame_deg", number(run, "/evaluation/rpe/0/rotation_deg/rmse"))
        .figure("rpe_second_m", number(run, "/evaluation/rpe/1/translation_m/rmse"))
        .figure("rpe_second_deg", number(run, "/evaluation/rpe/1/rotation_deg/rmse"))
        .figure("path_ratio", number(run, "/evaluation/path_ratio"))
}

/// The method's row: its figures, or why there are none.
pub fn row(case: Row, run: &MethodRun, figures: impl FnOnce(Row, &Value) -> Row) -> Row {
    match &run.result {
        Ok(value) => figures(case, value),
        Err(failure) => case.figure("failure", failure.as_str()),
    }
}

/// A sequence of the renderer with some frames and a seed.
pub fn world(spec: &str, options: &[(&str, String)]) -> String {
    let words: Vec<_> = options.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let joint = if spec.contains('?') { "&" } else { "?" };
    format!("synth:{spec}{}{}", if words.is_empty() { "" } else { joint }, words.join("&"))
}

/// The path of a folder as text.
///
/// # Errors
/// It is not UTF-8.
pub fn text(path: &std::path::Path) -> Result<String> {
    Ok(path.to_str().with_context(|| format!("{} is not UTF-8", path.display()))?.to_owned())
}
