//! What a run tells at its end, on the terminal: one method in words, several as a table.

use std::fmt::Write;

use anyhow::Result;
use yfslam_eval::{AlignmentKind, Table, TableStyle, improvement_percent};

use crate::input::boxes::BoxOrigin;
use crate::input::settings::describe;
use crate::input::source::{Source, Truth};
use crate::output::report::{Report, Run};
use crate::run::method_run::Judged;
use crate::stats::recognition::{Loop, PlaceTally};

/// What became of the frames of one method, in a few lines.
pub fn of_one(report: &Report, run: &Run) -> Result<String> {
    let Run { source, judged: Judged { outcome, .. }, .. } = run;
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
    places_summary(&mut text, &outcome.places)?;
    write!(text, "map: {} keyframes, {} landmarks", report.map.keyframes, report.map.landmarks)?;
    if let Some(peak) = report.peak_memory_mb {
        write!(text, "; peak memory {peak:.0} MB")?;
    }
    Ok(text + "\n")
}

fn places_summary(text: &mut String, places: &PlaceTally) -> Result<()> {
    let joins = places.loops.iter().filter(|l| l.merged_submaps).count();
    // A single camera has a unit of its own, which drifts.
    let drift = |l: &Loop| {
        let scale =
            if l.drift_scale == 1.0 { " m".to_owned() } else { format!(" and a scale of {:.2}", l.drift_scale) };
        format!("{:.2}{scale}", l.drift_m)
    };
    let drifts: Vec<_> = places.loops.iter().filter(|l| !l.merged_submaps).map(drift).collect();
    if !drifts.is_empty() {
        writeln!(text, "loops closed: {}, after a drift of {}", drifts.len(), drifts.join(", "))?;
    }
    if joins > 0 {
        writeln!(text, "submaps joined: {joins}")?;
    }
    if let Some(longest) = places.lost.iter().map(|stretch| stretch.frames).max() {
        let found = places.lost.iter().filter(|stretch| stretch.found_again).count();
        writeln!(text, "lost {} times, found again {found} times; for {longest} frames at most", places.lost.len())?;
    }
    Ok(())
}

/// The errors side by side, as in Table 2 of the paper.
pub fn of_several(judged: &[Judged], source: &Source, truth: Option<&Truth>) -> String {
    let kind = judged.iter().find_map(Judged::evaluation).map_or(AlignmentKind::Se3, |e| e.ate.alignment.kind);
    let ate = format!("ATE, {kind} (m)");
    let headers =
        [ate.as_str(), "RMSE", "S.D.", "mean", "median", "max", "improve RMSE (%)", "S.D. (%)", "frames tracked"];
    let mut table = Table::new(headers);
    let errors_of = |judged: &Judged| judged.evaluation().map(|e| e.ate.translation_m);
    let original = judged.first().and_then(errors_of);
    for (place, one) in judged.iter().enumerate() {
        let Judged { config, outcome, .. } = one;
        let (name, summary) = describe(config.dynamic.method);
        let errors = errors_of(one);
        let figures = match errors {
            Some(s) => [s.rmse, s.std, s.mean, s.median, s.max].map(|v| format!("{v:.4}")),
            None => std::array::from_fn(|_| "-".to_owned()),
        };
        let improvement = match errors.zip(original) {
            Some((ours, original)) if place > 0 => {
                [(ours.rmse, original.rmse), (ours.std, original.std)].map(|(ours, original)| {
                    improvement_percent(ours, original).map_or("-".to_owned(), |percent| format!("{percent:.2}"))
                })
            }
            _ => Default::default(),
        };
        let tracked = format!("{} of {}", outcome.frames.tracked, outcome.frames.total());
        table.push([format!("{name}: {summary}")].into_iter().chain(figures).chain(improvement).chain([tracked]));
    }
    let boxes = judged.iter().map(|one| one.boxes).find(|boxes| !matches!(boxes, BoxOrigin::None));
    let truth = truth.map_or("none", |truth| truth.origin.as_str());
    format!(
        "{}; boxes: {}; ground truth: {truth}\n\n{}",
        source.name,
        boxes.unwrap_or(&BoxOrigin::None),
        table.render(TableStyle::Plain)
    )
}
