//! The processor time of a frame as text, and for the report.

use yfslam_report::ProcessorTime;

use super::report::ReportedRun;
use crate::input::settings::describe;

/// Returns the processor time of a frame with its parts, for all methods together; `None` where the system does not measure it.
pub fn processor_time(runs: &[ReportedRun]) -> Option<ProcessorTime> {
    let [ReportedRun { cost: Some(first), .. }, ..] = runs else { return None };
    if runs.len() == 1 {
        let parts = first.parts().into_iter().map(|(name, ms)| (name.to_owned(), ms)).collect();
        return Some(ProcessorTime { total_ms: first.total, parts });
    }
    let costs = || runs.iter().filter_map(|run| Some((describe(run.result.config.dynamic.method).0, run.cost?)));
    let detector_ms = costs().map(|(_, cost)| cost.detector).fold(0.0, f64::max);
    let mut parts = vec![("reading".to_owned(), first.reading), ("detector".to_owned(), detector_ms)];
    for (method, cost) in costs() {
        parts.push((format!("tracking with {method}"), cost.tracking));
        parts.push((format!("mapping and loops with {method}"), cost.mapping_and_loops));
        if cost.dense_map > 0.0 {
            parts.push((format!("dense map with {method}"), cost.dense_map));
        }
    }
    parts.push(("other".to_owned(), first.other));
    Some(ProcessorTime { total_ms: first.total, parts })
}

/// Describes the processor time in a line for the terminal.
pub fn describe_processor_time(time: &ProcessorTime) -> String {
    let parts: Vec<String> = time.parts.iter().map(|(name, ms)| format!("{name} {ms:.1}")).collect();
    format!("processor time per frame: {:.1} ms, of which {}\n", time.total_ms, parts.join(", "))
}
