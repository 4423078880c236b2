//! A sequence in memory, with its boxes and the truth.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use nalgebra::Isometry3;
use rayon::prelude::*;
use yfslam::{Camera, Config, Detector, RgbdFrame, Slam};
use yfslam_detect::{DetectorConfig, YoloFastestV2};
use yfslam_eval::{EvalOptions, StampedPose, evaluate};
use yfslam_io::stream::DEFAULT_LOOK_AHEAD;
use yfslam_io::{FrameStream, Sequence, SequenceOptions, TrajectoryFile, detect_camera};
use yfslam_synth::{CLASS_NAMES, World, parse};

/// How far the truth's stamp may be from a frame's, ns.
const MAX_DIFFERENCE_NS: u64 = 20_000_000;

/// A sequence in memory.
pub struct Film {
    /// Name in tables.
    pub name: String,
    pub camera: Camera,
    frames: Vec<RgbdFrame>,
    /// World from camera, where it is known.
    truth: Vec<Option<Isometry3<f64>>>,
}

impl Film {
    /// Renders or reads a sequence whole.
    pub fn open(spec: &str, detector: Option<&Path>, config: &Config) -> Result<Self> {
        let film =
            if Path::new(spec).is_dir() { Self::read(spec, detector, config) } else { Self::render(spec, config) };
        let film = film.with_context(|| spec.to_owned())?;
        ensure!(film.len() > 1, "{spec} has fewer than two frames");
        Ok(film)
    }

    fn render(spec: &str, config: &Config) -> Result<Self> {
        let mut world = parse(spec)?;
        world.detections = true;
        let world = World::new(&world)?;
        let movable = |class: usize| config.dynamic.movable.iter().any(|name| name == CLASS_NAMES[class]);
        let shoot = |index| {
            let mut frame = world.frame(index).frame;
            frame.detections.iter_mut().for_each(|boxes| boxes.retain(|b| movable(b.class)));
            frame
        };
        Ok(Self {
            name: spec.strip_prefix("synth:").unwrap_or(spec).to_owned(),
            camera: world.config().camera.clone(),
            frames: (0..world.len()).into_par_iter().map(shoot).collect(),
            truth: (0..world.len()).map(|index| Some(world.pose(index))).collect(),
        })
    }

    fn read(spec: &str, detector: Option<&Path>, config: &Config) -> Result<Self> {
        let folder = Path::new(spec);
        let sequence = Sequence::open(folder, &SequenceOptions::default())?;
        let camera = detect_camera(folder)?.camera;
        let mut network = match detector {
            Some(file) => {
                let score_threshold = config.dynamic.keep_score.min(config.dynamic.open_score);
                let settings = DetectorConfig { score_threshold, ..Default::default() };
                Some(YoloFastestV2::from_bytes(&file.display().to_string(), &std::fs::read(file)?, &settings)?)
            }
            None => None,
        };
        let mut frames: Vec<RgbdFrame> =
            FrameStream::open(&sequence, &camera, DEFAULT_LOOK_AHEAD)?.filter_map(Result::ok).collect();
        for frame in &mut frames {
            let mut found = Vec::new();
            if let Some(network) = &mut network {
                network.detect(&frame.color, &mut found)?;
                let names = network.class_names();
                found.retain(|d| names.get(d.class).is_some_and(|name| config.dynamic.movable.contains(name)));
            }
            frame.detections = Some(found);
        }
        let truth = TrajectoryFile::read(&folder.join("groundtruth.txt"))?.poses;
        let at = |frame: &RgbdFrame| {
            let nearest = truth.iter().min_by_key(|pose| pose.timestamp_ns.abs_diff(frame.timestamp_ns))?;
            (nearest.timestamp_ns.abs_diff(frame.timestamp_ns) <= MAX_DIFFERENCE_NS).then_some(nearest.pose)
        };
        let truth = frames.iter().map(at).collect();
        let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy().into_owned();
        Ok(Self { name, camera, frames, truth })
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Time from frame to frame, ns.
    pub fn period_ns(&self) -> i64 {
        (1e9 / self.camera.fps) as i64
    }

    /// The frame that is shown as number `shown` when the film is played forward and backward in turn.
    pub fn frame_at(&self, shown: usize) -> usize {
        let there_and_back = 2 * (self.len() - 1);
        let at = shown % there_and_back;
        at.min(there_and_back - at)
    }

    /// What the camera sees as number `shown`.
    pub fn show(&self, shown: usize) -> RgbdFrame {
        RgbdFrame { timestamp_ns: self.stamp_ns(shown), ..self.frames[self.frame_at(shown)].clone() }
    }

    /// The time of what is shown as number `shown`.
    pub fn stamp_ns(&self, shown: usize) -> i64 {
        shown as i64 * self.period_ns()
    }

    /// Where the camera is as it shows what it shows at a time.
    pub fn truth_at(&self, timestamp_ns: i64) -> Option<Isometry3<f64>> {
        self.truth[self.frame_at((timestamp_ns / self.period_ns()) as usize)]
    }

    /// A system for this camera.
    pub fn slam(&self, config: &Config) -> Result<Slam> {
        Ok(Slam::new(config.clone(), &self.camera, None)?)
    }

    /// A system that has seen the first `share` of the film, and the number of frames that is.
    pub fn mapped(&self, config: &Config, share: f64) -> Result<(Slam, usize)> {
        let (mut slam, known) = (self.slam(config)?, (share * self.len() as f64) as usize);
        for shown in 0..known {
            slam.track(&self.show(shown))?;
        }
        Ok((slam, known))
    }

    /// The error of a trajectory of what was shown, RMSE after alignment by SE(3), m.
    pub fn ate_m(&self, trajectory: &[(i64, Isometry3<f64>)]) -> Result<f64> {
        let estimate: Vec<_> = trajectory.iter().map(|(t, pose)| StampedPose::new(*t, *pose)).collect();
        let truth: Vec<_> = estimate
            .iter()
            .filter_map(|p| Some(StampedPose::new(p.timestamp_ns, self.truth_at(p.timestamp_ns)?)))
            .collect();
        let options = EvalOptions { rpe: Vec::new(), max_diff_ns: 0, ..Default::default() };
        Ok(evaluate(&truth, &estimate, &options)?.ate.translation_m.rmse)
    }
}
