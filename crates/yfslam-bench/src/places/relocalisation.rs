//! A camera that is covered for a while: whether it is found again at once, and where.

use std::time::Duration;

use anyhow::Result;
use nalgebra::Isometry3;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use yfslam::map::persist::decode;
use yfslam::{Config, MapUse, Slam, Tracked};
use yfslam_io::{Fault, FaultInjector, FaultKind};

use super::loaded_sequence::Film;

/// How long the camera is covered, s.
const COVERED_S: [i64; 3] = [1, 5, 20];
/// Frames tracked before the camera is covered.
const BEFORE: usize = 10;
/// Frames of a known view within which it should be found.
const WITHIN: usize = 10;
/// Frames after which a trial is given up.
const AT_MOST: usize = 90;
/// A pose is wrong if it is that far from the truth, m and degrees.
const WRONG_BEYOND: (f64, f64) = (0.3, 10.0);

/// What came of a trial.
struct Trial {
    covered_s: i64,
    /// Frames of a known view until one was tracked.
    frames: Option<usize>,
    /// Whether a pose was wrong, or given while the camera was covered.
    wrong: bool,
    /// The longest that a frame took while lost.
    slowest: Duration,
}

/// Prints, for each sequence and each length of cover, a line over its share of `count` trials.
pub fn table(
    config: &Config,
    count: usize,
    seed: u64,
    sequences: usize,
    films: impl Iterator<Item = Result<Film>>,
) -> Result<()> {
    println!(
        "| sequence | ATE of the map, m | covered, s | trials | within {WITHIN} frames | frames, median / worst | never | wrong poses | slowest frame, ms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut all = Vec::new();
    for (number, film) in films.enumerate() {
        let film = film?;
        let share = (number + 1) * count / sequences - number * count / sequences;
        let known = Known::map(&film, config)?;
        let trials: Vec<Trial> =
            (0..share).map(|k| known.trial(COVERED_S[k % COVERED_S.len()], &mut rng)).collect::<Result<_>>()?;
        for covered_s in COVERED_S {
            let of_length: Vec<&Trial> = trials.iter().filter(|t| t.covered_s == covered_s).collect();
            line(&format!("{} | {:.4} | {covered_s}", film.name, known.ate_m), &of_length);
        }
        all.extend(trials);
    }
    line("all | | ", &all.iter().collect::<Vec<_>>());
    Ok(())
}

fn line(head: &str, trials: &[&Trial]) {
    let mut frames: Vec<usize> = trials.iter().filter_map(|t| t.frames).collect();
    frames.sort_unstable();
    let (soon, never) = (frames.iter().filter(|f| **f <= WITHIN).count(), trials.len() - frames.len());
    let middle = frames.get(frames.len() / 2).map_or("-".into(), ToString::to_string);
    let worst = frames.last().map_or("-".into(), ToString::to_string);
    let wrong = trials.iter().filter(|t| t.wrong).count();
    let slowest = trials.iter().map(|t| t.slowest).max().unwrap_or_default().as_secs_f64() * 1e3;
    println!(
        "| {head} | {} | {soon} ({:.1} %) | {middle} / {worst} | {never} | {wrong} | {slowest:.1} |",
        trials.len(),
        100.0 * soon as f64 / trials.len().max(1) as f64
    );
}

/// A film that was mapped: what a camera that comes back knows.
struct Known<'a> {
    film: &'a Film,
    config: &'a Config,
    map: Vec<u8>,
    /// The pose of each frame in the map; the map's own, for the truth of a recording may be that of a marker beside the camera.
    poses: Vec<Option<Isometry3<f64>>>,
    ate_m: f64,
}

impl<'a> Known<'a> {
    fn map(film: &'a Film, config: &'a Config) -> Result<Self> {
        let mut slam = film.slam(config)?;
        for shown in 0..film.len() {
            slam.track(&film.show(shown))?;
        }
        let trajectory = slam.trajectory();
        let mut poses = vec![None; film.len()];
        for (timestamp_ns, pose) in &trajectory {
            poses[(timestamp_ns / film.period_ns()) as usize] = Some(*pose);
        }
        Ok(Self { film, config, map: slam.save_map()?, poses, ate_m: film.ate_m(&trajectory)? })
    }

    /// The camera comes into the map at a random moment of the way to and fro, is tracked for a little, and covered, and moves on.
    fn trial(&self, covered_s: i64, rng: &mut Pcg64Mcg) -> Result<Trial> {
        let film = self.film;
        let start = rng.next_u64() as usize % (2 * (film.len() - 1));
        let mut slam = self.camera_in_map()?;
        let first_ns = film.show(start).timestamp_ns;
        let cover_ns = (BEFORE as i64) * film.period_ns();
        let fault = Fault { kind: FaultKind::Covered, start_ns: cover_ns, duration_ns: covered_s * 1_000_000_000 };
        let mut faults = FaultInjector::new(vec![fault], first_ns);
        let mut trial = Trial { covered_s, frames: None, wrong: false, slowest: Duration::ZERO };
        let (mut known_views, mut tracked_since) = (0, 0);
        for shown in start.. {
            faults.push(film.show(shown));
            let Some(delivery) = faults.pop() else { continue };
            let begun = std::time::Instant::now();
            let tracked = slam.track(&delivery.frame)?;
            let elapsed_ns = delivery.frame.timestamp_ns - first_ns;
            let covered = fault.strikes(elapsed_ns);
            let reference = self.poses[film.frame_at(shown)];
            if tracked.t_world_cam.is_some_and(|pose| covered || self.is_wrong(shown, &tracked, &pose)) {
                trial.wrong = true;
            }
            if elapsed_ns < cover_ns {
                continue;
            }
            if trial.frames.is_none() {
                trial.slowest = trial.slowest.max(begun.elapsed());
            }
            known_views += usize::from(!covered && reference.is_some());
            if tracked.t_world_cam.is_some() {
                trial.frames.get_or_insert(known_views);
                tracked_since += 1;
            }
            if known_views >= AT_MOST || tracked_since >= WITHIN {
                break;
            }
        }
        if trial.frames.is_none_or(|frames| frames > WITHIN) {
            eprintln!("{}: covered {covered_s} s from frame {start}: found after {:?}", film.name, trial.frames);
        }
        Ok(trial)
    }

    fn is_wrong(&self, shown: usize, tracked: &Tracked, pose: &Isometry3<f64>) -> bool {
        let Some(reference) = self.poses[self.film.frame_at(shown)] else { return false };
        let error = reference.inverse() * pose;
        let (m, deg) = (error.translation.vector.norm(), error.rotation.angle().to_degrees());
        let wrong = m > WRONG_BEYOND.0 || deg > WRONG_BEYOND.1;
        if wrong {
            eprintln!(
                "{}: {m:.2} m and {deg:.1} deg off in frame {shown}, {} inliers",
                self.film.name, tracked.inliers
            );
        }
        wrong
    }

    fn camera_in_map(&self) -> Result<Slam> {
        Ok(self.film.slam(self.config)?.with_map(decode(&self.map)?, MapUse::Extend)?)
    }
}
