//! Runs SLAM on frames and records the results.
//!
//! In: a SLAM system, frames. Out: an [`Outcome`]. Ground truth is not used here.

use std::path::Path;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use yfslam::config::DepthSource;
use yfslam::{Config, Frame, MapFrame, Pose, Slam, Tracked, TrackingState};
use yfslam_io::StampedPose;
use yfslam_io::time::format_stamp;
use yfslam_io::write::PlyPoint;

use super::dense::{DenseCost, DenseResult};
use super::resume::{Checkpoint, ResumePoint, Resumed, RunIdentity};
use crate::input::detector::DetectorTime;
use crate::stats::cpu;
use crate::stats::health::HealthTally;
use crate::stats::process::{Part, Parts};
use crate::stats::readout::ReadoutReport;
use crate::stats::recognition::{LoadedMap, RecognitionTally};
use crate::stats::skip::Skip;
use crate::stats::stages::Stages;
use crate::stats::tally::{DynamicTally, FrameTally};

/// SLAM with a record of its results.
pub struct Pipeline {
    slam: Slam,
    /// Durations of all stages of all frames.
    pub stages: Stages,
    frames: FrameTally,
    dynamic: DynamicTally,
    recognition: RecognitionTally,
    health: HealthTally,
    /// The checkpoint from which the run goes on.
    resumed: Option<Resumed>,
    live: Vec<StampedPose>,
    resets: usize,
    /// Patches of the dense map.
    dense_patches: usize,
    detector_times: Option<Receiver<DetectorTime>>,
    parts: Parts,
    maps_inline: bool,
    /// The map frame of the dense map, once that is taken.
    map_frame: Option<MapFrame>,
    started: Instant,
    state: TrackingState,
    /// Largest number of features, and of static features with depth, in a frame before initialisation.
    best_start: (usize, usize),
    /// The result of the last frame; `None` if it was refused.
    last: Option<Tracked>,
}

/// The results of a run.
pub struct Outcome {
    /// Final poses of all tracked frames.
    pub trajectory: Vec<StampedPose>,
    /// Poses of all tracked frames as estimated at their time.
    pub live: Vec<StampedPose>,
    /// Keyframes of this run in the final map.
    pub keyframes: Vec<StampedPose>,
    /// The frame of maps made of this run.
    pub map_frame: MapFrame,
    /// Landmarks of the final map.
    pub landmarks: Vec<PlyPoint>,
    pub frames: FrameTally,
    pub dynamic: DynamicTally,
    pub recognition: RecognitionTally,
    /// Signs that the result may be wrong.
    pub health: HealthTally,
    /// Where the run has gone on from a checkpoint.
    pub resumed: Option<ResumePoint>,
    /// How the readout time of the rows was known at the end.
    pub readout: ReadoutReport,
    pub stages: Stages,
    /// From the first frame to the last.
    pub wall: Duration,
    /// Processor time of tracking, mapping on the same thread, and a detector of its own.
    pub parts: Parts,
}

impl Pipeline {
    /// Records what `slam` does, which maps on the calling thread or not; `detector_times` are those of its own detector.
    pub fn new(slam: Slam, maps_inline: bool, detector_times: Option<Receiver<DetectorTime>>) -> Self {
        Self {
            slam,
            stages: Stages::default(),
            frames: FrameTally::default(),
            dynamic: DynamicTally::default(),
            recognition: RecognitionTally::default(),
            health: HealthTally::default(),
            resumed: None,
            live: Vec::new(),
            resets: 0,
            dense_patches: 0,
            detector_times,
            parts: Parts::default(),
            maps_inline,
            map_frame: None,
            started: Instant::now(),
            state: TrackingState::default(),
            best_start: (0, 0),
            last: None,
        }
    }

    /// Notes that the system has begun with the map in `file`, which it extends or only localises in.
    #[must_use]
    pub fn with_loaded_map(mut self, file: &Path, is_extended: bool) -> Self {
        let file = file.display().to_string();
        self.recognition.loaded_map = Some(LoadedMap { file, is_extended, recognised: None });
        self
    }

    /// Goes on from a checkpoint, with whose map the system has begun.
    pub fn resume(&mut self, resumed: Resumed) {
        self.frames = resumed.checkpoint.tally.clone();
        self.health = resumed.checkpoint.health.clone();
        self.live = resumed.live.clone();
        self.resumed = Some(resumed);
    }

    /// Returns the state of the run `run` for a checkpoint; `None` if no frame is tracked yet.
    pub fn checkpoint(&self, run: &RunIdentity) -> Option<Checkpoint> {
        let last_ns = self.live.last()?.timestamp_ns;
        let (run, tally, health) = (run.clone(), self.frames.clone(), self.health.clone());
        Some(Checkpoint { run, tally, health, last_ns })
    }

    /// Tracks one frame and returns the state after it; a frame that SLAM refuses is counted as skipped.
    pub fn track(&mut self, frame: &Frame) -> TrackingState {
        self.last = None;
        let started = Instant::now();
        let (result, cpu) = cpu::timed(|| self.slam.track(frame));
        let tracked = match result {
            Ok(tracked) => tracked,
            Err(rejected) => {
                self.skip(Skip { reason: "refused by the tracker", message: rejected.to_string() });
                return self.state;
            }
        };
        self.log(&tracked);
        let wall = started.elapsed();
        self.stages.push("frame", wall);
        self.count_processor_time(cpu.unwrap_or_default(), wall, &tracked);
        self.add_stages(&tracked);
        self.frames.count(tracked.state);
        self.dynamic.count(&self.slam);
        let before = self.resumed.as_ref().map_or(0, |resumed| resumed.checkpoint.tally.total());
        self.recognition.count(&tracked, self.frames.total().saturating_sub(before + 1));
        self.health.count(&tracked, &self.recognition);
        if self.slam.statistics().resets > self.resets {
            // A new map has another world frame: earlier poses do not belong to this trajectory.
            self.resets = self.slam.statistics().resets;
            self.live.clear();
            self.frames.restart();
        }
        if let Some(pose) = tracked.t_world_cam {
            self.live.push(StampedPose::new(tracked.timestamp_ns, pose));
        } else if self.frames.tracked == 0 {
            self.update_best_start();
        }
        let state = tracked.state;
        self.last = Some(tracked);
        state
    }

    /// Returns the result of the last frame; `None` if it was refused.
    pub fn last(&self) -> Option<&Tracked> {
        self.last.as_ref()
    }

    /// Counts a frame that cannot be used.
    pub fn skip(&mut self, skip: Skip) {
        tracing::info!("skipped {}", skip.message);
        self.frames.skip(skip);
    }

    /// Returns the system after the last frame.
    pub fn slam(&self) -> &Slam {
        &self.slam
    }

    /// Returns the cost of the dense map so far.
    pub fn dense_cost(&self) -> DenseCost {
        DenseCost::new(&self.slam.statistics(), self.dense_patches, self.parts.get(Part::Dense))
    }

    /// Waits until mapping is finished, and returns the dense map.
    ///
    /// # Errors
    /// The system makes none, or it cannot be encoded.
    pub fn dense_map(&mut self) -> Result<DenseResult> {
        self.finish_mapping();
        let dense_map = self.slam.dense()?.snapshot();
        self.map_frame = dense_map.frame;
        DenseResult::new(dense_map)
    }

    /// Returns the counts of frames so far.
    pub fn frames(&self) -> &FrameTally {
        &self.frames
    }

    /// Returns the poses of all tracked frames as the map has them now.
    pub fn trajectory(&self) -> Vec<StampedPose> {
        let new = self.slam.trajectory().into_iter().map(stamped);
        let Some(resumed) = &self.resumed else { return new.collect() };
        let earlier = resumed.corrected(self.slam.map());
        // Where the map of the checkpoint was not recognised, the new poses belong to another world.
        let is_recognised = self.recognition.loaded_map.as_ref().is_none_or(|map| map.recognised.is_some());
        earlier.into_iter().chain(new.filter(|_| is_recognised)).collect()
    }

    /// Returns the poses of all tracked frames as estimated at their time.
    pub fn live(&self) -> &[StampedPose] {
        &self.live
    }

    fn log(&mut self, tracked: &Tracked) {
        let (frame, time) = (self.frames.total(), format_stamp(tracked.timestamp_ns));
        if tracked.state != self.state {
            tracing::info!(frame, %time, before = ?self.state, now = ?tracked.state, "state");
            self.state = tracked.state;
        }
        tracing::debug!(frame, %time, inliers = tracked.inliers, keyframe = tracked.is_keyframe, "frame");
    }

    fn add_stages(&mut self, tracked: &Tracked) {
        let times = &tracked.times;
        self.stages.push("features", times.features);
        let detections: Vec<_> = self.detector_times.iter().flat_map(Receiver::try_iter).collect();
        for took in detections {
            self.stages.push("detector", took.wall);
            self.parts.add(Part::Detector, took.cpu.unwrap_or_default());
        }
        if self.detector_times.is_some() {
            self.stages.push("detector idle", times.detector_wait);
        }
        self.stages.push("dynamic filter", times.dynamic);
        self.stages.push("tracking", times.tracking);
        if !times.loops.is_zero() {
            self.stages.push("relocalisation and loops", times.loops);
        }
        if !times.mapping.is_zero() {
            self.stages.push("mapping", times.mapping);
        }
        if !times.dense_map.is_zero() {
            self.stages.push("dense patch", times.dense_patch);
            self.stages.push("dense map", times.dense_map);
            self.dense_patches += 1;
        }
    }

    /// Divides the processor time of a frame between tracking, mapping and the dense map in the ratio of their wall times.
    fn count_processor_time(&mut self, cpu: Duration, wall: Duration, tracked: &Tracked) {
        let times = &tracked.times;
        let busy_s = wall.saturating_sub(times.detector_wait).as_secs_f64();
        let mapping_s = if self.maps_inline { (times.mapping + times.loops).as_secs_f64() } else { 0.0 };
        let dense_s = (times.dense_patch + times.dense_map).as_secs_f64();
        let [mapping, dense] = [mapping_s, dense_s].map(|s| cpu.mul_f64((s / busy_s.max(1e-9)).clamp(0.0, 1.0)));
        self.parts.add(Part::Mapping, mapping);
        self.parts.add(Part::Dense, dense);
        self.parts.add(Part::Tracking, cpu.saturating_sub(mapping + dense));
    }

    fn update_best_start(&mut self) {
        let features = self.slam.features();
        let with_depth = features.iter().filter(|f| f.trust > 0.0 && f.depth_m.is_some()).count();
        self.best_start = self.best_start.max((features.len(), with_depth));
    }

    /// Encodes the map for a later run.
    ///
    /// # Errors
    /// It cannot be encoded, which would be a fault of this program.
    pub fn save_map(&mut self) -> Result<Vec<u8>> {
        self.finish_mapping();
        Ok(self.slam.save_map()?)
    }

    /// Waits until mapping is finished.
    pub fn finish_mapping(&mut self) {
        if let (Some(closed), Some(last)) = (self.slam.finish_mapping(), self.live.last()) {
            self.recognition.close(last.timestamp_ns, &closed);
        }
    }

    /// Ends the run.
    ///
    /// # Errors
    /// No frame was tracked; the message says why.
    pub fn finish(mut self, config: &Config) -> Result<Outcome> {
        self.finish_mapping();
        self.recognition.keyframes_dropped = self.slam.statistics().keyframes_skipped;
        let submap_sizes: Vec<usize> = self.slam.trajectories().iter().map(Vec::len).collect();
        self.recognition.frames_in_other_submaps =
            submap_sizes.iter().sum::<usize>() - submap_sizes.iter().max().copied().unwrap_or(0);
        let wall = self.started.elapsed();
        self.frames.detector_failures += self.slam.statistics().detector_failures;
        if self.frames.tracked == 0 {
            self.fail(config)?;
        }
        let map_frame = self.map_frame.or(self.slam.statistics().saved_frame).unwrap_or_default();
        let map = self.slam.map();
        let first_keyframe = if self.resumed.is_some() { 0 } else { self.slam.statistics().first_keyframe };
        let new_keyframes = map.keyframes().filter(|(_, k)| k.sequence >= first_keyframe);
        let mut keyframes: Vec<_> = new_keyframes.map(|(_, k)| (k.sequence, k.timestamp_ns, k.t_cam_world)).collect();
        keyframes.sort_by_key(|&(sequence, ..)| sequence);
        let landmark = |l: &yfslam::Landmark| PlyPoint { position_m: l.position.coords.cast().into(), color: l.color };
        Ok(Outcome {
            trajectory: self.trajectory(),
            live: self.live,
            keyframes: keyframes.into_iter().map(|(_, t, t_cam_world)| stamped((t, t_cam_world.inverse()))).collect(),
            map_frame,
            landmarks: map.landmarks().map(|(_, l)| landmark(l)).collect(),
            frames: self.frames,
            dynamic: self.dynamic,
            recognition: self.recognition,
            health: self.health,
            resumed: self.resumed.as_ref().map(Resumed::point),
            readout: self.slam.statistics().readout.into(),
            stages: self.stages,
            wall,
            parts: self.parts,
        })
    }

    /// Returns an error that says why there is no trajectory.
    fn fail(&self, config: &Config) -> Result<()> {
        let FrameTally { read, skipped, first_skipped, .. } = &self.frames;
        if *read == 0 {
            let Some(first) = first_skipped else { bail!("no trajectory: no frame was read") };
            bail!("no trajectory: none of the {skipped} frames can be used; the first: {first}");
        }
        if let Some(LoadedMap { file, is_extended, .. }) = &self.recognition.loaded_map {
            let begins = if *is_extended {
                format!(
                    ", and a new map is begun only after {} s (tracking.reset_after_s)",
                    config.tracking.reset_after_s
                )
            } else {
                String::new()
            };
            bail!(
                "no trajectory: {file} was not recognised in any of {read} frames ({skipped} skipped){begins}; the recording has to show places of \
                 the map from similar directions and in similar light"
            );
        }
        let (features, with_depth) = self.best_start;
        if config.depth.source == DepthSource::Motion {
            bail!(
                "no trajectory: no map could be initialised in {read} frames ({skipped} skipped); the best had {features} features. Without depth \
                 initialisation needs two frames with {} matches and sideways motion of the camera between them; move it sideways, or \
                 lower the keys start_* of section monocular in --config",
                config.monocular.init_min_matches
            );
        }
        bail!(
            "no trajectory: no map could be initialised in {read} frames ({skipped} skipped); the best had {features} features, \
             {with_depth} of them static and with depth, but tracking.init_min_features asks for {} and \
             tracking.init_min_landmarks for {}; check camera and depth factor with `yfslam info`, or lower these in --config",
            config.tracking.init_min_features,
            config.tracking.init_min_landmarks
        );
    }
}

fn stamped((timestamp_ns, pose): (i64, Pose)) -> StampedPose {
    StampedPose::new(timestamp_ns, pose)
}

impl Outcome {
    /// Returns the frames per second of the whole run.
    pub fn fps(&self) -> f64 {
        self.frames.total() as f64 / self.wall.as_secs_f64().max(1e-9)
    }
}
