//! A room that is visited for long: whether keyframes, memory and time stay flat.

use anyhow::Result;
use rustix::time::{ClockId, clock_gettime};
use yfslam::Config;

use super::loaded_sequence::Film;

/// Prints a line for every round through each sequence.
pub fn table(config: &Config, rounds: usize, films: impl Iterator<Item = Result<Film>>) -> Result<()> {
    for film in films {
        let film = film?;
        println!("{}, {} frames a round", film.name, film.len() - 1);
        println!(
            "| round | keyframes | landmarks | process, MB | CPU per frame, median ms | 99 % ms | lost | ATE of the round, m |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        let mut slam = film.slam(config)?;
        for round in 0..rounds {
            let shown = round * (film.len() - 1)..(round + 1) * (film.len() - 1);
            let (mut times, mut lost, mut live) = (Vec::new(), 0, Vec::new());
            for shown in shown {
                let frame = film.show(shown);
                let started = processor_ms();
                let tracked = slam.track(&frame)?;
                times.push(processor_ms() - started);
                lost += usize::from(tracked.t_world_cam.is_none());
                live.extend(tracked.t_world_cam.map(|pose| (tracked.timestamp_ns, pose)));
            }
            times.sort_by(f64::total_cmp);
            println!(
                "| {} | {} | {} | {:.1} | {:.2} | {:.1} | {lost} | {:.4} |",
                round + 1,
                slam.map().keyframe_count(),
                slam.map().landmark_count(),
                resident_mb(),
                times[times.len() / 2],
                times[times.len() * 99 / 100],
                film.ate_m(&live)?,
            );
        }
        slam.map().validate().map_err(anyhow::Error::msg)?;
    }
    Ok(())
}

/// Processor time of this thread, which other work on the machine does not spoil.
fn processor_ms() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

/// Memory that this process holds, the film included; 0 where the system does not tell.
fn resident_mb() -> f64 {
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages: f64 = pages.split(' ').nth(1).and_then(|pages| pages.parse().ok()).unwrap_or_default();
    pages * 4096e-6
}
