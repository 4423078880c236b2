//! A live camera: frames at 30 Hz with mapping on its own thread, beside the same frames one after another; the start; the saved map.

use std::time::{Duration, Instant};

use anyhow::Result;
use yfslam::map::persist::decode;
use yfslam::{Config, Execution, MapUse, Slam};

use super::loaded_sequence::Film;

/// Prints a line for each sequence.
pub fn table(config: &Config, films: impl Iterator<Item = Result<Film>>) -> Result<()> {
    println!(
        "| sequence | ATE inline, m | ATE at 30 Hz, m | frame, median / 99 % / worst, ms | passed over | first pose, ms | ATE in the saved map, m | of inline |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for film in films {
        let film = film?;
        let begun = Instant::now();
        let mut inline = film.slam(config)?;
        let (_, first) = play(&film, &mut inline, None, begun)?;
        let ate = film.ate_m(&inline.trajectory())?;
        let mut live = film.slam(config)?.with_execution(Execution::Threaded)?;
        let (mut times, _) =
            play(&film, &mut live, Some(Duration::from_nanos(film.period_ns() as u64)), Instant::now())?;
        times.sort_by(f64::total_cmp);
        let mut localised = film.slam(config)?.with_map(decode(&inline.save_map()?)?, MapUse::Localise)?;
        play(&film, &mut localised, None, Instant::now())?;
        let again = film.ate_m(&localised.trajectory())?;
        println!(
            "| {} | {ate:.4} | {:.4} | {:.1} / {:.1} / {:.1} | {} | {:.1} | {again:.4} | {:.2} |",
            film.name,
            film.ate_m(&live.trajectory())?,
            times[times.len() / 2],
            times[times.len() * 99 / 100],
            times[times.len() - 1],
            live.passed_over(),
            first.unwrap_or_default().as_secs_f64() * 1e3,
            again / ate,
        );
    }
    Ok(())
}

/// Tracks the film forward, at a pace if one is given. Returns the time each frame took, ms, and the time from `begun` to the first pose.
fn play(film: &Film, slam: &mut Slam, pace: Option<Duration>, begun: Instant) -> Result<(Vec<f64>, Option<Duration>)> {
    let (mut times, mut first) = (Vec::new(), None);
    let start = Instant::now();
    for shown in 0..film.len() {
        let frame = film.show(shown);
        if let Some(pace) = pace {
            std::thread::sleep((start + pace * shown as u32).saturating_duration_since(Instant::now()));
        }
        let asked = Instant::now();
        let tracked = slam.track(&frame)?;
        times.push(asked.elapsed().as_secs_f64() * 1e3);
        if tracked.t_world_cam.is_some() {
            first.get_or_insert(begun.elapsed());
        }
    }
    slam.settle();
    Ok((times, first))
}
