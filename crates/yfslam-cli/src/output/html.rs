//! Gathers what `report.html` shows.
//!
//! In: the runs of one or more methods on one sequence. Out: the page beside their files.

use std::path::PathBuf;

use anyhow::Result;
use yfslam_eval::StampedPose;
use yfslam_eval::report::{Frames, MethodReport, Report, Stage, Times};
use yfslam_io::write_atomically;

use crate::input::boxes::BoxOrigin;
use crate::input::settings::describe;
use crate::output::folder::OutputFolder;
use crate::output::report::Run;
use crate::run::evaluation::to_eval;
use crate::run::method_run::Judged;
use crate::stats::stages::Stages;

/// Writes `report.html` into the folder and returns its path; `shared` are stages that all runs have in common. Runs must be of the
/// same sequence; the first is what the others are compared with.
///
/// # Errors
/// The file cannot be written, or a configuration cannot be.
pub fn write(out: &OutputFolder, runs: &[Run], shared: &Stages) -> Result<PathBuf> {
    let path = out.path().join("report.html");
    let html = page(runs, shared)?;
    write_atomically(&path, |file| file.write_all(html.as_bytes()))?;
    Ok(path)
}

fn page(runs: &[Run], shared: &Stages) -> Result<String> {
    let Some(first @ Run { source, truth, .. }) = runs.first() else { return Ok(String::new()) };
    let trajectories: Vec<Vec<StampedPose>> = runs.iter().map(|r| to_eval(&r.judged.outcome.trajectory)).collect();
    let boxes = runs.iter().map(|run| run.judged.boxes).find(|boxes| !matches!(boxes, BoxOrigin::None));
    let wall_s = runs.iter().map(|r| r.judged.outcome.wall.as_secs_f64()).fold(0.0, f64::max);
    let methods = runs.iter().zip(&trajectories).map(|(run, trajectory)| method(run.judged, trajectory));
    let report = Report {
        sequence: &source.name,
        facts: facts(first, boxes.unwrap_or(&BoxOrigin::None)),
        frames_ns: &source.stamps_ns,
        truth: truth.map(|truth| truth.poses.as_slice()),
        methods: methods.collect::<Result<_>>()?,
        shared_stages: stages(shared),
        wall_s,
        version: env!("CARGO_PKG_VERSION"),
        command: command_line(),
    };
    Ok(report.html())
}

fn method<'a>(judged: &'a Judged, trajectory: &'a [StampedPose]) -> Result<MethodReport<'a>> {
    let Judged { outcome, config, pictures, dense, .. } = judged;
    let (name, summary) = describe(config.dynamic.method);
    let tally = &outcome.frames;
    Ok(MethodReport {
        name,
        summary,
        trajectory,
        evaluation: judged.evaluation(),
        frames: Frames {
            total: tally.total(),
            tracked: tally.tracked,
            lost: tally.lost,
            skipped: tally.skipped_by_reason.iter().map(|(reason, count)| ((*reason).to_owned(), *count)).collect(),
        },
        times: Times {
            stages: stages(&outcome.stages),
            tracking_s: outcome.stages.total("frame").as_secs_f64(),
            cpu_s: outcome.cpu.map(|cpu| cpu.as_secs_f64()),
        },
        pictures: pictures.clone(),
        dense: dense.clone(),
        config: config.to_commented_toml()?,
    })
}

fn stages(stages: &Stages) -> Vec<Stage> {
    let stage = |(name, s): (&str, crate::stats::stages::StageSummary)| Stage {
        name: name.to_owned(),
        count: s.count,
        median_ms: s.median_ms,
        p99_ms: s.p99_ms,
    };
    stages.summaries().map(stage).collect()
}

/// What there is to know about the sequence, as name and value.
fn facts(run: &Run, boxes: &BoxOrigin) -> Vec<(&'static str, String)> {
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
    vec![
        ("Sequence", run.sequence.to_owned()),
        ("Faults injected", faults),
        ("Frames", format!("{} in {seconds:.1} s", stamps.len())),
        ("Camera", format!("{width} × {height} px, {}", camera.origin)),
        ("Boxes", boxes.to_string()),
        ("Ground truth", run.truth.map_or("none".to_owned(), |truth| truth.origin.clone())),
    ]
}

/// The command that was given, ready to be given again.
pub fn command_line() -> String {
    let arguments = std::env::args_os().skip(1).map(|argument| quote(&argument.to_string_lossy()));
    ["yfslam".to_owned()].into_iter().chain(arguments).collect::<Vec<_>>().join(" ")
}

/// A word as a shell takes it.
pub fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_that_a_shell_would_change_is_quoted() {
        assert_eq!(quote("a/b-c.onnx"), "a/b-c.onnx");
        assert_eq!(quote("synth:x?a=1&b"), "'synth:x?a=1&b'");
        assert_eq!(quote("it's"), "'it'\\''s'");
        assert_eq!(quote(""), "''");
    }
}
