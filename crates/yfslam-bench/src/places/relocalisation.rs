//! A camera that is covered for a while: the number of frames until it is relocalised, and whether the pose is right.

use std::time::{Duration, Instant};

use anyhow::Result;
use nalgebra::Isometry3;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use yfslam::{Config, MapUse, SavedMap, Slam, Tracked};
use yfslam_io::{Fault, FaultInjector, FaultKind};

use super::sequence::LoadedSequence;
use super::{is_wrong, size};
use crate::row::Row;

/// Times for which the camera is covered, s.
const COVERED_S: [i64; 3] = [1, 5, 20];
/// Frames tracked before the camera is covered.
const BEFORE: usize = 10;
/// Frames of a known view within which the camera should be relocalised.
const WITHIN: usize = 10;
/// Frames after which a trial ends.
const AT_MOST: usize = 90;

/// The outcome of a trial.
struct Trial {
    covered_s: i64,
    /// Frames of a known view until one was tracked.
    frames: Option<usize>,
    /// Whether a pose was wrong, or given while the camera was covered.
    wrong: bool,
    /// The longest time for a frame while lost.
    slowest: Duration,
}

/// A row for each sequence and each time covered, over its share of `count` trials; the last row is over all of them.
pub fn measure(
    config: &Config,
    count: usize,
    seed: u64,
    sequence_count: usize,
    sequences: impl Iterator<Item = Result<LoadedSequence>>,
) -> Result<Vec<Row>> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let (mut rows, mut all) = (Vec::new(), Vec::new());
    for (number, sequence) in sequences.enumerate() {
        let sequence = sequence?;
        let share = (number + 1) * count / sequence_count - number * count / sequence_count;
        let known = KnownSequence::map(&sequence, config)?;
        let trials: Vec<Trial> =
            (0..share).map(|k| known.trial(COVERED_S[k % COVERED_S.len()], &mut rng)).collect::<Result<_>>()?;
        for covered_s in COVERED_S {
            let of_length: Vec<&Trial> = trials.iter().filter(|t| t.covered_s == covered_s).collect();
            rows.push(row(&sequence.name, &covered_s.to_string(), Some(known.ate_m), &of_length));
        }
        all.extend(trials);
    }
    rows.push(row("all", "any", None, &all.iter().collect::<Vec<_>>()));
    Ok(rows)
}

fn row(sequence: &str, covered_s: &str, map_ate_m: Option<f64>, trials: &[&Trial]) -> Row {
    let mut frames: Vec<usize> = trials.iter().filter_map(|t| t.frames).collect();
    frames.sort_unstable();
    let slowest = trials.iter().map(|t| t.slowest).max().unwrap_or_default();
    Row::new()
        .case("sequence", sequence)
        .case("covered_s", covered_s)
        .figure("map_ate_m", map_ate_m)
        .figure("trials", trials.len())
        .figure("within_10_frames", frames.iter().filter(|f| **f <= WITHIN).count())
        .figure("frames_median", frames.get(frames.len() / 2).copied())
        .figure("frames_worst", frames.last().copied())
        .figure("never", trials.len() - frames.len())
        .figure("wrong_poses", trials.iter().filter(|t| t.wrong).count())
        .figure("slowest_frame_ms", slowest.as_secs_f64() * 1e3)
}

/// A sequence and the map that was made of it.
struct KnownSequence<'a> {
    sequence: &'a LoadedSequence,
    config: &'a Config,
    map: Vec<u8>,
    /// Pose of each frame in the map. These and not the ground truth, which in a recording may be of a marker beside the camera.
    poses: Vec<Option<Isometry3<f64>>>,
    ate_m: f64,
}

impl<'a> KnownSequence<'a> {
    fn map(sequence: &'a LoadedSequence, config: &'a Config) -> Result<Self> {
        let mut slam = sequence.slam(config)?;
        for played in 0..sequence.len() {
            slam.track(&sequence.play(played))?;
        }
        let trajectory = slam.trajectory();
        let mut poses = vec![None; sequence.len()];
        for (timestamp_ns, pose) in &trajectory {
            poses[(timestamp_ns / sequence.period_ns()) as usize] = Some(*pose);
        }
        Ok(Self { sequence, config, map: slam.save_map()?, poses, ate_m: sequence.ate_m(&trajectory)? })
    }

    /// The camera begins in the map at a random moment of playing to and fro, is tracked for a few frames, covered, and moves on.
    fn trial(&self, covered_s: i64, rng: &mut Pcg64Mcg) -> Result<Trial> {
        let sequence = self.sequence;
        let start = rng.next_u64() as usize % (2 * (sequence.len() - 1));
        let mut slam = self.slam_in_map()?;
        let first_ns = sequence.play(start).timestamp_ns;
        let cover_ns = (BEFORE as i64) * sequence.period_ns();
        let fault = Fault { kind: FaultKind::Covered, start_ns: cover_ns, duration_ns: covered_s * 1_000_000_000 };
        let mut faults = FaultInjector::new(vec![fault], first_ns);
        let mut trial = Trial { covered_s, frames: None, wrong: false, slowest: Duration::ZERO };
        let (mut known_views, mut tracked_since) = (0, 0);
        for played in start.. {
            faults.push(sequence.play(played));
            let Some(delivery) = faults.pop() else { continue };
            let begun = Instant::now();
            let tracked = slam.track(&delivery.frame)?;
            let elapsed_ns = delivery.frame.timestamp_ns - first_ns;
            let covered = fault.affects(elapsed_ns);
            let reference = self.poses[sequence.frame_at(played)];
            if tracked.t_world_cam.is_some_and(|pose| covered || self.is_wrong(played, &tracked, &pose)) {
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
            let frames = trial.frames;
            eprintln!("{}: covered for {covered_s} s from frame {start}: relocalised after {frames:?}", sequence.name);
        }
        Ok(trial)
    }

    fn is_wrong(&self, played: usize, tracked: &Tracked, pose: &Isometry3<f64>) -> bool {
        let Some(reference) = self.poses[self.sequence.frame_at(played)] else { return false };
        let error = size(&(reference.inverse() * pose));
        if is_wrong(error) {
            let name = &self.sequence.name;
            eprintln!("{name}: frame {played}: {error:?} (m, °) off, {} inliers", tracked.inliers);
        }
        is_wrong(error)
    }

    fn slam_in_map(&self) -> Result<Slam> {
        let saved = SavedMap::from_bytes(&self.map)?;
        Ok(self.sequence.builder(self.config).map(saved, MapUse::Extend).build()?)
    }
}
