//! Figures of evaluated trajectories as files.

use std::path::Path;

use anyhow::Result;
use yfslam_eval::{Evaluation, StampedPose};
use yfslam_io::{prepare_folder, write_atomically};
use yfslam_report::{FigureFile, Frames, MethodReport, Report, Times};

/// An evaluated trajectory in a figure.
pub struct Plotted<'a> {
    /// Name in the legend.
    pub name: String,
    pub trajectory: &'a [StampedPose],
    pub evaluation: &'a Evaluation,
}

/// Returns the figures of estimates of one sequence.
pub fn figures(sequence: &str, truth: &[StampedPose], estimates: &[Plotted<'_>]) -> Vec<FigureFile> {
    let methods = estimates.iter().map(|Plotted { name, trajectory, evaluation }| MethodReport {
        name,
        summary: "",
        trajectory,
        evaluation: Some(evaluation),
        frames: Frames::default(),
        times: Times::default(),
        snapshots: Vec::new(),
        dense: None,
        landmarks: Vec::new(),
        keyframes: &[],
        config: String::new(),
    });
    let report = Report {
        sequence,
        facts: Vec::new(),
        frames_ns: &[],
        truth: Some(truth),
        methods: methods.collect(),
        shared_stages: Vec::new(),
        wall_s: 0.0,
        processor_time: None,
        version: env!("CARGO_PKG_VERSION"),
        command: String::new(),
        scene_script: "",
    };
    report.figures()
}

/// Writes figures into a folder, as SVG and PDF; `prefix` begins their names.
///
/// # Errors
/// A file cannot be written.
pub fn write_figures(folder: &Path, prefix: &str, figures: &[FigureFile]) -> Result<()> {
    prepare_folder(folder)?;
    for FigureFile { name, svg, pdf, .. } in figures {
        write_atomically(&folder.join(format!("{prefix}{name}.svg")), |file| file.write_all(svg.as_bytes()))?;
        write_atomically(&folder.join(format!("{prefix}{name}.pdf")), |file| file.write_all(pdf))?;
    }
    Ok(())
}

/// Returns the name of a trajectory: that of its file, or of its folder where the file has the name that every run gives.
pub fn name_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = path.parent().and_then(Path::file_name).map(|folder| folder.to_string_lossy().into_owned());
    folder.filter(|_| stem == "trajectory").unwrap_or(stem)
}
