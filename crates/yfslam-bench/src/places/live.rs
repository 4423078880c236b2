//! A live camera: frames at their own rate with mapping on a thread of its own, beside the same frames one after another; the time to
//! the first pose; localisation in the saved map.

use std::time::{Duration, Instant};

use anyhow::Result;
use yfslam::{Config, Execution, MapUse, SavedMap, Slam};

use super::sequence::LoadedSequence;
use crate::row::Row;

/// One row for each sequence.
pub fn measure(config: &Config, sequences: impl Iterator<Item = Result<LoadedSequence>>) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for sequence in sequences {
        let sequence = sequence?;
        let begun = Instant::now();
        let mut inline = sequence.slam(config)?;
        let (_, first) = run(&sequence, &mut inline, None, begun)?;
        let mut live = sequence.builder(config).execution(Execution::Threaded).build()?;
        let period = Duration::from_nanos(sequence.period_ns() as u64);
        let (mut times, _) = run(&sequence, &mut live, Some(period), Instant::now())?;
        times.sort_by(f64::total_cmp);
        let saved = SavedMap::from_bytes(&inline.save_map()?)?;
        let mut localised = sequence.builder(config).map(saved, MapUse::Localise).build()?;
        run(&sequence, &mut localised, None, Instant::now())?;
        rows.push(
            Row::new()
                .case("sequence", &sequence.name)
                .figure("ate_inline_m", sequence.ate_m(&inline.trajectory())?)
                .figure("ate_live_m", sequence.ate_m(&live.trajectory())?)
                .figure("ate_localised_m", sequence.ate_m(&localised.trajectory())?)
                .figure("frame_median_ms", times[times.len() / 2])
                .figure("frame_p99_ms", times[times.len() * 99 / 100])
                .figure("frame_max_ms", times[times.len() - 1])
                .figure("keyframes_skipped", live.statistics().keyframes_skipped)
                .figure("first_pose_ms", first.unwrap_or_default().as_secs_f64() * 1e3),
        );
    }
    Ok(rows)
}

/// Tracks the sequence forward, at a rate if one is given. Returns the time of each frame, ms, and the time from `begun` to the first
/// pose.
fn run(
    sequence: &LoadedSequence,
    slam: &mut Slam,
    period: Option<Duration>,
    begun: Instant,
) -> Result<(Vec<f64>, Option<Duration>)> {
    let (mut times, mut first) = (Vec::new(), None);
    let start = Instant::now();
    for played in 0..sequence.len() {
        let frame = sequence.play(played);
        if let Some(period) = period {
            std::thread::sleep((start + period * played as u32).saturating_duration_since(Instant::now()));
        }
        let asked = Instant::now();
        let tracked = slam.track(&frame)?;
        times.push(asked.elapsed().as_secs_f64() * 1e3);
        if tracked.t_world_cam.is_some() {
            first.get_or_insert(begun.elapsed());
        }
    }
    slam.finish_mapping();
    Ok((times, first))
}
