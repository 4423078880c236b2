//! The processor time of a frame for each of the methods that ran in one process.

use super::method_run::RunResult;
use super::shared_detector::DetectionTally;
use crate::stats::process::{FrameCost, Parts, ProcessTime};

/// Returns the cost of a frame for each result; `None` where the system does not measure processor time.
pub fn frame_costs(
    process: &ProcessTime,
    detection: &DetectionTally,
    results: &[&RunResult],
) -> Vec<Option<FrameCost>> {
    let cost = |(index, result): (usize, &&RunResult)| {
        let others = results.iter().enumerate().filter(|(other, _)| *other != index);
        let mut others = others.fold(Parts::default(), |sum, (_, other)| sum.and(&other.outcome.parts));
        let mut own = result.outcome.parts;
        if result.config.dynamic.method.needs_boxes() {
            own = own.and(&detection.parts);
        } else {
            others = others.and(&detection.parts);
        }
        FrameCost::new(process, &own, (results.len() > 1).then_some(&others))
    };
    results.iter().enumerate().map(cost).collect()
}
