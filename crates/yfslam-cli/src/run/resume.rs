//! Checkpoints: what a killed run leaves, and how a later one goes on from it.
//!
//! A checkpoint is a map, the trajectories until then, and a [`Checkpoint`], which is written last: it says which frame comes next, and
//! with which recording, camera and configuration the run was made.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use yfslam::{Config, Map, Pose, SavedMap};
use yfslam_io::time::format_stamp;
use yfslam_io::{StampedPose, read_file};

use crate::input::settings::describe;
use crate::input::source::Source;
use crate::stats::health::HealthTally;
use crate::stats::tally::FrameTally;

/// With what a run is made; another run cannot go on from its checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunIdentity {
    /// Name of the sequence, the number of its frames, and the time stamps of the first one and the last one, ns.
    sequence: String,
    frames: usize,
    span_ns: [Option<i64>; 2],
    /// Faults put into the frames on purpose.
    faults: Vec<String>,
    camera: serde_json::Value,
    method: String,
    /// The configuration as TOML.
    config: String,
    dense: bool,
    /// The map that the run began with.
    loaded_map: Option<String>,
}

/// The state of a run after some of its frames.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Checkpoint {
    pub run: RunIdentity,
    /// Counts of the frames until then.
    pub tally: FrameTally,
    pub health: HealthTally,
    /// Time stamp of the last tracked frame, ns.
    pub last_ns: i64,
}

/// What a run goes on from.
#[derive(Clone, Debug)]
pub struct Resumed {
    pub checkpoint: Checkpoint,
    /// Poses of the tracked frames, and as they were estimated at the time of each frame.
    pub trajectory: Vec<StampedPose>,
    pub live: Vec<StampedPose>,
    /// Sequence number, time stamp and pose, world from camera, of the keyframes of the map.
    pub keyframes: Vec<(u64, i64, Pose)>,
}

/// Where a run has gone on, for `run.json`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ResumePoint {
    /// Frames of the run that was ended, which were not tracked again.
    pub after_frames: usize,
    /// Time stamp of the last tracked one of them, ns.
    pub last_ns: i64,
}

impl RunIdentity {
    /// Describes a run.
    ///
    /// # Errors
    /// The camera or the configuration has a value without a text form.
    pub fn new(
        source: &Source,
        faults: &[String],
        config: &Config,
        dense: bool,
        loaded_map: Option<&Path>,
    ) -> Result<Self> {
        Ok(Self {
            sequence: source.name.clone(),
            frames: source.stamps_ns.len(),
            span_ns: [source.stamps_ns.first().copied(), source.stamps_ns.last().copied()],
            faults: faults.to_vec(),
            camera: serde_json::to_value(&source.camera.camera)?,
            method: describe(config.dynamic.method).0.to_owned(),
            config: toml::to_string(config)?,
            dense,
            loaded_map: loaded_map.map(|path| path.display().to_string()),
        })
    }

    /// Returns what differs from another run, in words.
    fn differences(&self, other: &Self) -> Vec<String> {
        let mut found = Vec::new();
        let mut differs = |is_different: bool, words: String| {
            if is_different {
                found.push(words);
            }
        };
        let recording = |run: &Self| format!("{} of {} frames", run.sequence, run.frames);
        differs(
            (&self.sequence, self.frames, self.span_ns) != (&other.sequence, other.frames, other.span_ns),
            format!("the sequence ({} instead of {})", recording(self), recording(other)),
        );
        differs(self.faults != other.faults, "the faults".into());
        differs(self.camera != other.camera, "the camera".into());
        differs(self.method != other.method, format!("the method ({} instead of {})", self.method, other.method));
        let keys = different_keys(&self.config, &other.config);
        let keys: Vec<_> = keys.into_iter().filter(|key| key != "dynamic.method").collect();
        differs(!keys.is_empty(), format!("the configuration ({})", keys.join(", ")));
        differs(self.dense != other.dense, "--dense".into());
        differs(self.loaded_map != other.loaded_map, "the map that it began with (--load-map)".into());
        found
    }
}

impl Resumed {
    /// Reads the checkpoint of a run.
    ///
    /// # Errors
    /// There is none, it cannot be read, or it is that of another run.
    pub fn read(folder: &Path, run: &RunIdentity, [state, map, trajectory, live]: [&str; 4]) -> Result<Self> {
        let path = folder.join(state);
        let shown = folder.display();
        ensure!(
            path.is_file(),
            "{shown} has no checkpoint to go on from: the run there has ended, or was made without --checkpoint; leave out --resume to begin anew"
        );
        let read = |name: &str| read_file(&folder.join(name)).with_context(|| format!("the checkpoint in {shown}"));
        let checkpoint: Checkpoint = serde_json::from_slice(&read(state)?).with_context(|| {
            format!("{} is not a checkpoint of this version; leave out --resume to begin anew", path.display())
        })?;
        let differences = run.differences(&checkpoint.run);
        ensure!(
            differences.is_empty(),
            "the checkpoint in {shown} is that of another run; different: {}; give the same arguments, or leave out --resume to begin anew",
            differences.join("; ")
        );
        let saved =
            SavedMap::from_bytes(&read(map)?).with_context(|| format!("the map {}", folder.join(map).display()))?;
        // What was written after the state of a checkpoint that was not finished is tracked again.
        let last_ns = checkpoint.last_ns;
        let poses = |name: &str| -> Result<Vec<StampedPose>> {
            let file = yfslam_io::TrajectoryFile::read(&folder.join(name))?;
            Ok(file.poses.into_iter().filter(|pose| pose.timestamp_ns <= last_ns).collect())
        };
        let (trajectory, live) = (poses(trajectory)?, poses(live)?);
        ensure!(!trajectory.is_empty(), "the checkpoint in {shown} has no poses; leave out --resume to begin anew");
        Ok(Self { trajectory, live, keyframes: keyframes(saved.map()), checkpoint })
    }

    /// Returns where the run goes on.
    pub fn point(&self) -> ResumePoint {
        ResumePoint { after_frames: self.checkpoint.tally.total(), last_ns: self.checkpoint.last_ns }
    }

    /// Returns the poses of the checkpoint as `map` has them now: each moves with the keyframe nearest in time that is left.
    pub fn corrected(&self, map: &Map) -> Vec<StampedPose> {
        let now = keyframes(map);
        // Sequence numbers ascend in both lists.
        let mut moves: Vec<(i64, Pose)> = Vec::with_capacity(self.keyframes.len());
        for (sequence, timestamp_ns, before) in &self.keyframes {
            if let Ok(index) = now.binary_search_by_key(sequence, |keyframe| keyframe.0) {
                moves.push((*timestamp_ns, now[index].2 * before.inverse()));
            }
        }
        moves.sort_by_key(|(timestamp_ns, _)| *timestamp_ns);
        let correct = |pose: &StampedPose| {
            let after = moves.partition_point(|(timestamp_ns, _)| *timestamp_ns < pose.timestamp_ns);
            let near = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|at| moves.get(at));
            let nearest = near.min_by_key(|(timestamp_ns, _)| timestamp_ns.abs_diff(pose.timestamp_ns));
            StampedPose::new(
                pose.timestamp_ns,
                nearest.map_or(pose.t_world_cam, |(_, motion)| motion * pose.t_world_cam),
            )
        };
        self.trajectory.iter().map(correct).collect()
    }
}

impl ResumePoint {
    /// Describes the point in a few words.
    pub fn describe(&self) -> String {
        format!("resumed after {} frames, at {} s", self.after_frames, format_stamp(self.last_ns))
    }
}

fn keyframes(map: &Map) -> Vec<(u64, i64, Pose)> {
    let mut keyframes: Vec<_> =
        map.keyframes().map(|(_, k)| (k.sequence, k.timestamp_ns, k.t_cam_world.inverse())).collect();
    keyframes.sort_by_key(|keyframe| keyframe.0);
    keyframes
}

/// Returns the full names of the keys that differ in two configurations.
fn different_keys(a: &str, b: &str) -> Vec<String> {
    fn walk(prefix: &str, a: &toml::Table, b: &toml::Table, keys: &mut Vec<String>) {
        let names: std::collections::BTreeSet<_> = a.keys().chain(b.keys()).collect();
        for name in names {
            let path = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
            match (a.get(name), b.get(name)) {
                (Some(toml::Value::Table(a)), Some(toml::Value::Table(b))) => walk(&path, a, b, keys),
                (a, b) if a == b => {}
                _ => keys.push(path),
            }
        }
    }
    let mut keys = Vec::new();
    match (a.parse::<toml::Table>(), b.parse::<toml::Table>()) {
        (Ok(a), Ok(b)) => walk("", &a, &b, &mut keys),
        _ if a == b => {}
        _ => keys.push("unreadable".into()),
    }
    keys
}

#[cfg(test)]
mod tests {
    use yfslam::Method;

    use super::*;

    #[test]
    fn the_keys_that_differ_are_named() {
        let mut other = Config::default();
        other.features.count += 1;
        other.dynamic.method = Method::None;
        let [a, b] = [&Config::default(), &other].map(|config| toml::to_string(config).unwrap());
        assert_eq!(different_keys(&a, &b), ["dynamic.method", "features.count"]);
        assert!(different_keys(&a, &a).is_empty());
    }
}
