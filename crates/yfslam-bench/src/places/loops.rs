//! Loops that are closed, their errors, and the trajectory error with and without them.

use anyhow::Result;
use nalgebra::Isometry3;
use yfslam::{Config, Slam};

use super::sequence::LoadedSequence;
use super::{is_wrong, size};
use crate::row::Row;

/// A closed loop.
struct Loop {
    /// Number of the played frame at which it was closed.
    played: usize,
    /// Drift that it took away, m.
    drift_m: f64,
    /// Error of the motion measured between its ends, m and degrees.
    error: Option<(f64, f64)>,
}

/// Two rows for each sequence: played forward, and forward then backward.
pub fn measure(config: &Config, sequences: impl Iterator<Item = Result<LoadedSequence>>) -> Result<Vec<Row>> {
    let mut without = config.clone();
    without.loops.enabled = false;
    let mut rows = Vec::new();
    for sequence in sequences {
        let sequence = sequence?;
        for (direction, count) in [("forward", sequence.len()), ("forward and backward", 2 * sequence.len() - 1)] {
            let (slam, loops, tracked) = run(&sequence, config, count)?;
            let (open, ..) = run(&sequence, &without, count)?;
            let (with, without) = (sequence.ate_m(&slam.trajectory())?, sequence.ate_m(&open.trajectory())?);
            let wrong: Vec<_> = loops.iter().filter(|l| l.error.is_some_and(is_wrong)).collect();
            for l in &wrong {
                eprintln!("{}: false loop at frame {}: {:?}", sequence.name, l.played, l.error);
            }
            let worst = loops.iter().filter_map(|l| l.error).max_by(|a, b| a.0.total_cmp(&b.0));
            let drifts: Vec<_> = loops.iter().map(|l| format!("{:.3}", l.drift_m)).collect();
            rows.push(
                Row::new()
                    .case("sequence", &sequence.name)
                    .case("played", direction)
                    .figure("tracked", tracked as f64 / count as f64)
                    .figure("ate_without_m", without)
                    .figure("ate_m", with)
                    .figure("loops", loops.len())
                    .figure("drift_m", drifts.join(", "))
                    .figure("worst_loop_m", worst.map(|(m, _)| m))
                    .figure("worst_loop_deg", worst.map(|(_, deg)| deg))
                    .figure("false_loops", wrong.len()),
            );
        }
    }
    Ok(rows)
}

fn run(sequence: &LoadedSequence, config: &Config, count: usize) -> Result<(Slam, Vec<Loop>, usize)> {
    let mut slam = sequence.slam(config)?;
    let (mut loops, mut tracked) = (Vec::new(), 0);
    for played in 0..count {
        let result = slam.track(&sequence.play(played))?;
        tracked += usize::from(result.t_world_cam.is_some());
        let Some(closed) = result.loop_closure else { continue };
        let true_pose = |id| sequence.true_pose_at(slam.map().keyframe(id)?.timestamp_ns);
        let error = |near: Isometry3<f64>, far: Isometry3<f64>| size(&(closed.t_keyframe_to * far.inverse() * near));
        let error = true_pose(closed.keyframe).zip(true_pose(closed.to)).map(|(near, far)| error(near, far));
        loops.push(Loop { played, drift_m: closed.drift.isometry.translation.vector.norm(), error });
    }
    Ok((slam, loops, tracked))
}
