//! The summary of a run on the terminal: of one method in sentences, of several as a table.

use std::fmt::Write;

use anyhow::Result;
use yfslam_eval::{AlignmentKind, improvement_percent};
use yfslam_io::time::format_stamp;
use yfslam_report::{Table, TableStyle};

use super::processor_time::{describe_processor_time, processor_time};
use super::report::{ReportedRun, RunReport};
use crate::input::boxes::BoxOrigin;
use crate::input::settings::describe;
use crate::input::source::Truth;
use crate::run::method_run::RunResult;
use crate::stats::recognition::{LoadedMap, Loop, LostPeriod, Recognition, RecognitionTally};

/// Summarises the run of one method in a few lines.
pub fn of_one(report: &RunReport, run: &ReportedRun) -> Result<String> {
    let ReportedRun { source, result: RunResult { outcome, .. }, .. } = run;
    let frames = &outcome.frames;
    let mut text = format!(
        "{}: tracked {} of {} frames ({:.1} %), lost {}, skipped {}; {:.1} frames a second\n",
        source.name,
        frames.tracked,
        frames.total(),
        frames.tracked_percent(),
        frames.lost,
        frames.skipped,
        report.fps
    );
    if let Some(interrupted) = run.interrupted {
        writeln!(text, "{interrupted} after {} of {} frames", frames.total(), source.stamps_ns.len())?;
    }
    if let Some(resumed) = outcome.resumed {
        writeln!(text, "{}", resumed.describe())?;
    }
    if frames.skipped > 0 {
        let reasons: Vec<_> =
            frames.skipped_by_reason.iter().map(|(reason, count)| format!("{count} × {reason}")).collect();
        writeln!(
            text,
            "skipped: {}; the first: {}",
            reasons.join(", "),
            frames.first_skipped.as_deref().unwrap_or("-")
        )?;
    }
    if let Some(a) = &report.association
        && a.duplicate_stamps_skipped + a.backward_stamps_skipped + a.unstamped_skipped > 0
    {
        let (duplicate, backward, unstamped) =
            (a.duplicate_stamps_skipped, a.backward_stamps_skipped, a.unstamped_skipped);
        writeln!(
            text,
            "list entries skipped: {duplicate} × duplicate stamp, {backward} × stamp runs backward, {unstamped} × no stamp"
        )?;
    }
    if frames.detector_failures > 0 {
        writeln!(
            text,
            "the detector failed on {} frames, which count as frames without boxes",
            frames.detector_failures
        )?;
    }
    if outcome.readout.is_noteworthy() {
        writeln!(text, "rolling shutter: {}", outcome.readout)?;
    }
    write_recognition(&mut text, &outcome.recognition)?;
    if let Some(signs) = outcome.health.describe() {
        writeln!(text, "health: {signs}")?;
    }
    if let Some(time) = processor_time(std::slice::from_ref(run)) {
        text += &describe_processor_time(&time);
    }
    write!(text, "map: {} keyframes, {} landmarks", report.map.keyframes, report.map.landmarks)?;
    if let Some(peak) = report.peak_memory_mb {
        write!(text, "; peak memory {peak:.0} MB")?;
    }
    Ok(text + "\n")
}

fn write_recognition(text: &mut String, recognition: &RecognitionTally) -> Result<()> {
    match &recognition.loaded_map {
        Some(LoadedMap { file, recognised: None, .. }) => writeln!(text, "{file} was not recognised")?,
        Some(LoadedMap {
            file,
            recognised: Some(Recognition { timestamp_ns, after_frames, position_m: [x, y, z] }),
            ..
        }) => {
            let time = format_stamp(*timestamp_ns);
            writeln!(
                text,
                "{file} was recognised after {after_frames} frames, at {time} s, position {x:.2} {y:.2} {z:.2} m in its world"
            )?;
        }
        None => {}
    }
    let merges = recognition.loops.iter().filter(|l| l.merged_submaps).count();
    // The scale of a single camera drifts.
    let drift = |l: &Loop| {
        let scale =
            if l.drift_scale == 1.0 { " m".to_owned() } else { format!(" and a scale of {:.2}", l.drift_scale) };
        format!("{:.2}{scale}", l.drift_m)
    };
    let drifts: Vec<_> = recognition.loops.iter().filter(|l| !l.merged_submaps).map(drift).collect();
    if !drifts.is_empty() {
        writeln!(text, "loops closed: {}, after a drift of {}", drifts.len(), drifts.join(", "))?;
    }
    if merges > 0 {
        writeln!(text, "submaps merged: {merges}")?;
    }
    if let Some(longest) = recognition.lost.iter().map(|period| period.frames).max() {
        let count = |ended: fn(&LostPeriod) -> bool| recognition.lost.iter().filter(|period| ended(period)).count();
        let (relocalised, begun_anew) = (count(|period| period.relocalised), count(|period| period.begun_anew));
        write!(text, "lost {} times, relocalised {relocalised} times", recognition.lost.len())?;
        if begun_anew > 0 {
            write!(text, ", begun anew {begun_anew} times")?;
        }
        writeln!(text, "; lost for {longest} frames at most")?;
    }
    Ok(())
}

/// Summarises the errors of several methods as a table, as in Table 2 of the paper.
pub fn of_several(runs: &[ReportedRun], truth: Option<&Truth>) -> String {
    let results: Vec<&RunResult> = runs.iter().map(|run| run.result).collect();
    let source = runs.first().map_or("", |run| run.source.name.as_str());
    let kind =
        results.iter().find_map(|result| result.evaluation()).map_or(AlignmentKind::Se3, |e| e.ate.alignment.kind);
    let ate = format!("ATE, {kind} (m)");
    let headers = [ate.as_str(), "RMSE", "S.D.", "mean", "median", "max", "less RMSE (%)", "less S.D. (%)", "tracked"];
    let mut table = Table::new(headers);
    let errors_of = |result: &RunResult| result.evaluation().map(|e| e.ate.translation_m);
    let original = results.first().and_then(|result| errors_of(result));
    for (index, result) in results.iter().enumerate() {
        let RunResult { config, outcome, .. } = result;
        let (name, _) = describe(config.dynamic.method);
        let errors = errors_of(result);
        let figures = match errors {
            Some(s) => [s.rmse, s.std, s.mean, s.median, s.max].map(|v| format!("{v:.4}")),
            None => std::array::from_fn(|_| "-".to_owned()),
        };
        let improvement = match errors.zip(original) {
            Some((ours, original)) if index > 0 => {
                [(ours.rmse, original.rmse), (ours.std, original.std)].map(|(ours, original)| {
                    improvement_percent(ours, original).map_or("-".to_owned(), |percent| format!("{percent:.2}"))
                })
            }
            _ => Default::default(),
        };
        let tracked = format!("{} of {}", outcome.frames.tracked, outcome.frames.total());
        table.push([name.to_owned()].into_iter().chain(figures).chain(improvement).chain([tracked]));
    }
    let boxes = results.iter().map(|result| result.boxes).find(|boxes| !matches!(boxes, BoxOrigin::None));
    let truth = truth.map_or("none", |truth| truth.origin.as_str());
    format!(
        "{source}; boxes: {}; ground truth: {truth}\n\n{}{}",
        boxes.unwrap_or(&BoxOrigin::None),
        table.render(TableStyle::Plain),
        processor_time(runs).map_or(String::new(), |time| format!("\n{}", describe_processor_time(&time)))
    )
}
