//! Loops: which are closed, how true they are, and what they are worth.

use anyhow::Result;
use nalgebra::Isometry3;
use yfslam::{Config, Slam};

use super::loaded_sequence::Film;

/// A loop with the error of the motion that was measured between its ends.
struct Judged {
    shown: usize,
    drift_m: f64,
    error: Option<(f64, f64)>,
}

/// A loop is false if its ends are that far from where it puts them, m and degrees.
const FALSE_BEYOND: (f64, f64) = (0.3, 10.0);

/// Prints, for each sequence, a line for playing it forward and one for playing it forward and then backward.
pub fn table(config: &Config, films: impl Iterator<Item = Result<Film>>) -> Result<()> {
    println!(
        "| sequence | played | tracked | ATE without, m | ATE, m | ratio | loops | drift closed, m | worst loop, m / deg | false |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut without = config.clone();
    without.loops.enabled = false;
    let mut all_false = 0;
    for film in films {
        let film = film?;
        for (played, count) in [("forward", film.len()), ("and back", 2 * film.len() - 1)] {
            let (slam, loops, tracked) = play(&film, config, count)?;
            let (open, ..) = play(&film, &without, count)?;
            let (with, without) = (film.ate_m(&slam.trajectory())?, film.ate_m(&open.trajectory())?);
            let wrong = |l: &&Judged| l.error.is_some_and(|(m, deg)| m > FALSE_BEYOND.0 || deg > FALSE_BEYOND.1);
            let false_ones = loops.iter().filter(wrong).count();
            all_false += false_ones;
            let drifts: Vec<_> = loops.iter().map(|l| format!("{:.3}", l.drift_m)).collect();
            let worst = loops.iter().filter_map(|l| l.error).max_by(|a, b| a.0.total_cmp(&b.0));
            let worst = worst.map_or("".into(), |(m, deg)| format!("{m:.3} / {deg:.2}"));
            println!(
                "| {} | {played} | {:.1} % | {without:.4} | {with:.4} | {:.2} | {} | {} | {worst} | {false_ones} |",
                film.name,
                100.0 * tracked as f64 / count as f64,
                with / without,
                loops.len(),
                drifts.join(", "),
            );
            for l in loops.iter().filter(wrong) {
                eprintln!("{}: false loop at frame {}: {:?}", film.name, l.shown, l.error);
            }
        }
    }
    println!("\nfalse loops: {all_false}");
    Ok(())
}

fn play(film: &Film, config: &Config, count: usize) -> Result<(Slam, Vec<Judged>, usize)> {
    let mut slam = film.slam(config)?;
    let (mut loops, mut tracked) = (Vec::new(), 0);
    for shown in 0..count {
        let result = slam.track(&film.show(shown))?;
        tracked += usize::from(result.t_world_cam.is_some());
        let Some(closed) = result.loop_closed else { continue };
        let truth_of = |id| film.truth_at(slam.map().keyframe(id)?.timestamp_ns);
        let error = |near: Isometry3<f64>, far: Isometry3<f64>| {
            let error = closed.t_keyframe_to * far.inverse() * near;
            (error.translation.vector.norm(), error.rotation.angle().to_degrees())
        };
        let error = truth_of(closed.keyframe).zip(truth_of(closed.to)).map(|(near, far)| error(near, far));
        loops.push(Judged { shown, drift_m: closed.drift.isometry.translation.vector.norm(), error });
    }
    Ok((slam, loops, tracked))
}
