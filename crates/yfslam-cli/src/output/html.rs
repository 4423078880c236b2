//! Collects the content of `report.html`.
//!
//! In: the runs of one or more methods on one sequence. Out: the page in the output folder.

use std::path::PathBuf;

use anyhow::Result;
use yfslam_eval::StampedPose;
use yfslam_io::write_atomically;
use yfslam_report::{Frames, MethodReport, Report, Stage, Times};

use super::folder::{OutputFolder, REPORT_FILE};
use super::processor_time::processor_time;
use super::report::ReportedRun;
use crate::input::boxes::BoxOrigin;
use crate::input::settings::describe;
use crate::run::method_run::RunResult;
use crate::stats::stages::{StageSummary, Stages};
use crate::ui::command_line::command_line;

/// Writes `report.html` into the folder and returns its path; `shared` are stages that all runs have in common. Runs must be of the
/// same sequence; the first is what the others are compared with.
///
/// # Errors
/// The file cannot be written, or a configuration cannot be.
pub fn write(out: &OutputFolder, runs: &[ReportedRun], shared: &Stages) -> Result<PathBuf> {
    let path = out.path().join(REPORT_FILE);
    let html = page(runs, shared)?;
    write_atomically(&path, |file| file.write_all(html.as_bytes()))?;
    Ok(path)
}

fn page(runs: &[ReportedRun], shared: &Stages) -> Result<String> {
    let Some(first @ ReportedRun { source, truth, .. }) = runs.first() else { return Ok(String::new()) };
    let trajectories: Vec<&[StampedPose]> = runs.iter().map(|r| r.result.outcome.trajectory.as_slice()).collect();
    let boxes = runs.iter().map(|run| run.result.boxes).find(|boxes| !matches!(boxes, BoxOrigin::None));
    let wall_s = runs.iter().map(|r| r.result.outcome.wall.as_secs_f64()).fold(0.0, f64::max);
    let methods = runs.iter().zip(&trajectories).map(|(run, trajectory)| method(run, trajectory));
    let report = Report {
        sequence: &source.name,
        facts: facts(first, boxes.unwrap_or(&BoxOrigin::None)),
        frames_ns: &source.stamps_ns,
        truth: truth.map(|truth| truth.poses.as_slice()),
        methods: methods.collect::<Result<_>>()?,
        shared_stages: stages(shared),
        wall_s,
        processor_time: processor_time(runs),
        version: env!("CARGO_PKG_VERSION"),
        command: command_line(),
        scene_script: yfslam_view::SCENE_SCRIPT,
    };
    Ok(report.html())
}

fn method<'a>(run: &ReportedRun<'a>, trajectory: &'a [StampedPose]) -> Result<MethodReport<'a>> {
    let ReportedRun { result, images, .. } = *run;
    let RunResult { outcome, config, .. } = result;
    let (name, summary) = describe(config.dynamic.method);
    let tally = &outcome.frames;
    Ok(MethodReport {
        name,
        summary,
        trajectory,
        evaluation: result.evaluation(),
        frames: Frames {
            total: tally.total(),
            tracked: tally.tracked,
            lost: tally.lost,
            skipped: tally.skipped_by_reason.iter().map(|(reason, count)| ((*reason).to_owned(), *count)).collect(),
        },
        times: Times { stages: stages(&outcome.stages), tracking_s: outcome.stages.total("frame").as_secs_f64() },
        snapshots: images.snapshots.clone(),
        dense: images.dense.clone(),
        landmarks: outcome.landmarks.iter().map(|point| (point.position_m, point.color)).collect(),
        keyframes: &outcome.keyframes,
        config: config.to_commented_toml()?,
    })
}

fn stages(stages: &Stages) -> Vec<Stage> {
    let stage = |(name, s): (&str, StageSummary)| Stage {
        name: name.to_owned(),
        count: s.count,
        median_ms: s.median_ms,
        p99_ms: s.p99_ms,
    };
    stages.summaries().map(stage).collect()
}

/// Returns facts about the sequence, as name and value.
fn facts(run: &ReportedRun, boxes: &BoxOrigin) -> Vec<(&'static str, String)> {
    let (camera, stamps) = (&run.source.camera, &run.source.stamps_ns);
    let seconds = match (stamps.first(), stamps.last()) {
        (Some(first), Some(last)) => last.saturating_sub(*first) as f64 / 1e9,
        _ => 0.0,
    };
    let (width, height) = (camera.camera.width, camera.camera.height);
    let faults = match run.faults {
        [] => "none".to_owned(),
        faults => faults.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
    };
    let interrupted = run
        .interrupted
        .map(|interrupted| ("Incomplete", format!("{interrupted} after {} frames", run.result.outcome.frames.total())));
    let facts = vec![
        ("Sequence", run.sequence.to_owned()),
        ("Faults injected", faults),
        ("Frames", format!("{} in {seconds:.1} s", stamps.len())),
        ("Camera", format!("{width} × {height} px, {}", camera.origin)),
        ("Readout of the rows", run.result.outcome.readout.to_string()),
        ("Boxes", boxes.to_string()),
        ("Ground truth", run.truth.map_or("none".to_owned(), |truth| truth.origin.clone())),
    ];
    facts.into_iter().chain(interrupted).collect()
}
