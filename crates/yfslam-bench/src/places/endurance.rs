//! A room that is visited for long: keyframes, memory and time, round by round.

use anyhow::Result;
use yfslam::Config;

use super::sequence::LoadedSequence;
use crate::row::Row;

/// One row for each round through each sequence.
pub fn measure(
    config: &Config,
    rounds: usize,
    sequences: impl Iterator<Item = Result<LoadedSequence>>,
) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for sequence in sequences {
        let sequence = sequence?;
        let length = sequence.len() - 1;
        let mut slam = sequence.slam(config)?;
        for round in 0..rounds {
            let (mut times, mut lost, mut live) = (Vec::new(), 0usize, Vec::new());
            for played in round * length..(round + 1) * length {
                let frame = sequence.play(played);
                let started = thread_ms();
                let tracked = slam.track(&frame)?;
                times.push(thread_ms() - started);
                lost += usize::from(tracked.t_world_cam.is_none());
                live.extend(tracked.t_world_cam.map(|pose| (tracked.timestamp_ns, pose)));
            }
            times.sort_by(f64::total_cmp);
            rows.push(
                Row::new()
                    .case("sequence", &sequence.name)
                    .case("round", round + 1)
                    .figure("frames", length)
                    .figure("lost", lost)
                    .figure("keyframes", slam.map().keyframe_count())
                    .figure("landmarks", slam.map().landmarks().count())
                    .figure("process_mb", resident_mb())
                    .figure("frame_median_ms", times[times.len() / 2])
                    .figure("frame_p99_ms", times[times.len() * 99 / 100])
                    .figure("ate_live_m", sequence.ate_m(&live)?),
            );
        }
        yfslam::unstable::check_map(slam.map()).map_err(anyhow::Error::msg)?;
    }
    Ok(rows)
}

/// Processor time of this thread, ms: other work on the machine does not count.
#[cfg(unix)]
fn thread_ms() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

#[cfg(not(unix))]
fn thread_ms() -> f64 {
    f64::NAN
}

/// Resident memory of this process, with the sequence that it holds, MB; 0 where the system does not tell.
fn resident_mb() -> f64 {
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages: f64 = pages.split(' ').nth(1).and_then(|pages| pages.parse().ok()).unwrap_or_default();
    pages * 4096e-6
}
