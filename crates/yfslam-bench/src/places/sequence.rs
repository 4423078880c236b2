//! A sequence in memory, with its boxes and the ground truth.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use nalgebra::Isometry3;
use rayon::prelude::*;
use yfslam::{Camera, Config, Detector, Frame, Slam, SlamBuilder};
use yfslam_detect::{DetectorConfig, YoloFastestV2};
use yfslam_eval::{EvalOptions, StampedPose, evaluate};
use yfslam_io::stream::DEFAULT_LOOK_AHEAD;
use yfslam_io::{FrameStream, Sequence, SequenceOptions, TrajectoryFile, detect_camera};
use yfslam_synth::{CLASS_NAMES, World, parse};

/// Largest difference between the time stamps of a frame and of a true pose, ns.
const MAX_DIFFERENCE_NS: u64 = 20_000_000;

/// A sequence in memory.
pub struct LoadedSequence {
    /// Name in tables.
    pub name: String,
    pub camera: Camera,
    frames: Vec<Frame>,
    /// True poses, where they are known.
    t_world_cam: Vec<Option<Isometry3<f64>>>,
}

impl LoadedSequence {
    /// Renders or reads a sequence whole.
    pub fn open(spec: &str, detector: Option<&Path>, config: &Config) -> Result<Self> {
        let is_folder = Path::new(spec).is_dir();
        let sequence = if is_folder { Self::read(spec, detector, config) } else { Self::render(spec, config) };
        let sequence = sequence.with_context(|| spec.to_owned())?;
        ensure!(sequence.len() > 1, "{spec} has fewer than two frames");
        Ok(sequence)
    }

    fn render(spec: &str, config: &Config) -> Result<Self> {
        let mut world = parse(spec)?;
        world.detections = true;
        let world = World::new(&world)?;
        let movable = |class: usize| config.dynamic.movable.iter().any(|name| name == CLASS_NAMES[class]);
        let render = |index| {
            let mut frame = world.frame(index).frame;
            frame.detections.iter_mut().for_each(|boxes| boxes.retain(|b| movable(b.class)));
            frame
        };
        Ok(Self {
            name: spec.strip_prefix("synth:").unwrap_or(spec).to_owned(),
            camera: world.config().camera.clone(),
            frames: (0..world.len()).into_par_iter().map(render).collect(),
            t_world_cam: (0..world.len()).map(|index| Some(world.pose(index))).collect(),
        })
    }

    fn read(spec: &str, detector: Option<&Path>, config: &Config) -> Result<Self> {
        let folder = Path::new(spec);
        let sequence = Sequence::open(folder, &SequenceOptions::default())?;
        let source = detect_camera(folder)?;
        let score_threshold = config.dynamic.keep_score.min(config.dynamic.open_score);
        let settings = DetectorConfig { score_threshold, ..Default::default() };
        let mut network = match detector {
            Some(file) => YoloFastestV2::from_bytes(&file.display().to_string(), &std::fs::read(file)?, &settings)?,
            None => YoloFastestV2::embedded(&settings)?,
        };
        let mut frames: Vec<Frame> =
            FrameStream::open(&sequence, &source, DEFAULT_LOOK_AHEAD)?.filter_map(Result::ok).collect();
        for frame in &mut frames {
            let mut detections = Vec::new();
            network.detect(&frame.color, &mut detections)?;
            let names = network.class_names();
            detections.retain(|d| names.get(d.class).is_some_and(|name| config.dynamic.movable.contains(name)));
            frame.detections = Some(detections);
        }
        let truth = TrajectoryFile::read(&folder.join("groundtruth.txt"))?.poses;
        let true_pose = |frame: &Frame| {
            let nearest = truth.iter().min_by_key(|pose| pose.timestamp_ns.abs_diff(frame.timestamp_ns))?;
            (nearest.timestamp_ns.abs_diff(frame.timestamp_ns) <= MAX_DIFFERENCE_NS).then_some(nearest.t_world_cam)
        };
        let t_world_cam = frames.iter().map(true_pose).collect();
        let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy().into_owned();
        Ok(Self { name, camera: source.camera, frames, t_world_cam })
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Time from frame to frame, ns.
    pub fn period_ns(&self) -> i64 {
        (1e9 / self.camera.fps) as i64
    }

    /// The frame that is played as number `played` when the sequence is played forward and backward in turn.
    pub fn frame_at(&self, played: usize) -> usize {
        let period = 2 * (self.len() - 1);
        let position = played % period;
        position.min(period - position)
    }

    /// The frame with number `played`.
    pub fn play(&self, played: usize) -> Frame {
        let mut frame = self.frames[self.frame_at(played)].clone();
        frame.timestamp_ns = self.stamp_ns(played);
        frame
    }

    /// The time stamp of the frame with number `played`.
    pub fn stamp_ns(&self, played: usize) -> i64 {
        played as i64 * self.period_ns()
    }

    /// The true pose at a time stamp.
    pub fn true_pose_at(&self, timestamp_ns: i64) -> Option<Isometry3<f64>> {
        self.t_world_cam[self.frame_at((timestamp_ns / self.period_ns()) as usize)]
    }

    /// A builder of systems for this camera.
    pub fn builder(&self, config: &Config) -> SlamBuilder {
        Slam::builder(self.camera.clone()).config(config.clone())
    }

    /// A system for this camera.
    pub fn slam(&self, config: &Config) -> Result<Slam> {
        Ok(self.builder(config).build()?)
    }

    /// A system that has mapped the first `share` of the sequence, and the number of these frames.
    pub fn mapped(&self, config: &Config, share: f64) -> Result<(Slam, usize)> {
        let (mut slam, mapped) = (self.slam(config)?, (share * self.len() as f64) as usize);
        for played in 0..mapped {
            slam.track(&self.play(played))?;
        }
        Ok((slam, mapped))
    }

    /// The absolute trajectory error of what was played, RMSE after alignment by SE(3), m.
    pub fn ate_m(&self, trajectory: &[(i64, Isometry3<f64>)]) -> Result<f64> {
        let estimate: Vec<_> = trajectory.iter().map(|(t, pose)| StampedPose::new(*t, *pose)).collect();
        let truth: Vec<_> = estimate
            .iter()
            .filter_map(|p| Some(StampedPose::new(p.timestamp_ns, self.true_pose_at(p.timestamp_ns)?)))
            .collect();
        let options = EvalOptions { rpe: Vec::new(), max_diff_ns: 0, ..Default::default() };
        Ok(evaluate(&truth, &estimate, &options)?.ate.translation_m.rmse)
    }
}
