//! Figures of evaluated trajectories as files.

use std::path::Path;

use anyhow::Result;
use yfslam_eval::{Evaluation, StampedPose};
use yfslam_io::{prepare_folder, write_atomically};
use yfslam_report::{Frames, MethodReport, Report, Times};

/// Writes all figures of the estimates into a folder, as SVG and PDF, and returns their number.
///
/// # Errors
/// A file cannot be written.
pub fn write_plots(
    folder: &Path,
    truth_file: &Path,
    truth: &[StampedPose],
    estimates: &[(&Path, &[StampedPose], &Evaluation)],
) -> Result<usize> {
    let names: Vec<String> = estimates.iter().map(|(path, ..)| name(path)).collect();
    let methods = estimates.iter().zip(&names).map(|((_, trajectory, evaluation), name)| MethodReport {
        name,
        summary: "",
        trajectory,
        evaluation: Some(evaluation),
        frames: Frames::default(),
        times: Times::default(),
        snapshots: Vec::new(),
        dense: None,
        config: String::new(),
    });
    let sequence = name(truth_file);
    let report = Report {
        sequence: &sequence,
        facts: Vec::new(),
        frames_ns: &[],
        truth: Some(truth),
        methods: methods.collect(),
        shared_stages: Vec::new(),
        wall_s: 0.0,
        processor_time: None,
        version: env!("CARGO_PKG_VERSION"),
        command: String::new(),
    };
    prepare_folder(folder)?;
    let figures = report.figures();
    for figure in &figures {
        write_atomically(&folder.join(format!("{}.svg", figure.name)), |file| file.write_all(figure.svg.as_bytes()))?;
        write_atomically(&folder.join(format!("{}.pdf", figure.name)), |file| file.write_all(&figure.pdf))?;
    }
    Ok(figures.len())
}

/// Returns the name of a file, or of its folder where the name is that of every run.
fn name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = path.parent().and_then(Path::file_name).map(|folder| folder.to_string_lossy().into_owned());
    folder.filter(|_| stem == "trajectory").unwrap_or(stem)
}
