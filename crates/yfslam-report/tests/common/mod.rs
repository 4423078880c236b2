//! Trajectories with known errors, and reports of them.
#![allow(dead_code, reason = "each test file uses a part")]

use nalgebra::{Isometry3, Vector3};
use yfslam_eval::{Evaluation, StampedPose};
use yfslam_report::{Frames, MethodReport, Report, Snapshot, Stage, Times};

pub const FRAME_NS: i64 = 33_333_333;

/// Returns the trajectory of a camera that moves in circles, z up, looking forward; `off_m` and `off_deg` are errors at a time in s.
pub fn circles(frames: i64, off_m: impl Fn(f64) -> f64, off_deg: impl Fn(f64) -> f64) -> Vec<StampedPose> {
    let pose = |i: i64| {
        let t = i as f64 * FRAME_NS as f64 / 1e9;
        let position = Vector3::new(3.0 * (0.3 * t).cos(), 2.0 * (0.3 * t).sin(), 1.2 + 0.3 * (0.7 * t).sin());
        let level = Vector3::new(-std::f64::consts::FRAC_PI_2, 0.0, 0.0);
        let error = Isometry3::rotation(Vector3::new(0.3, 1.0, 0.2) * off_deg(t).to_radians());
        let look = Isometry3::new(position + Vector3::new(0.6, 0.3, 0.5) * off_m(t), level);
        StampedPose::new(i * FRAME_NS, look * Isometry3::rotation(Vector3::y() * -0.3 * t) * error)
    };
    (0..frames).map(pose).collect()
}

pub fn wobble(size: f64) -> impl Fn(f64) -> f64 {
    move |t| size * ((3.1 * t).sin() + (171.7 * t).sin() + (1.3 * t).cos())
}

pub fn method<'a>(
    name: &'a str,
    trajectory: &'a [StampedPose],
    evaluation: Option<&'a Evaluation>,
) -> MethodReport<'a> {
    let stage = |name: &str, ms: f64| Stage { name: name.into(), count: 9, median_ms: ms, p99_ms: 3.0 * ms };
    let times = Times { stages: vec![stage("features", 1.5), stage("mapping", 12.0)], tracking_s: 2.5 };
    let frames = Frames { total: trajectory.len() + 90, tracked: trajectory.len(), lost: 90, skipped: Vec::new() };
    let snapshot = Snapshot { frame: 3, note: "", jpeg: vec![0; 9], size: [4, 3], features: [8, 1] };
    let config = "seed = 0 # <&>\n".into();
    MethodReport {
        name,
        summary: "",
        trajectory,
        evaluation,
        frames,
        times,
        snapshots: vec![snapshot],
        dense: None,
        landmarks: vec![([0.5, -1.0, 2.0], [9, 8, 7])],
        keyframes: trajectory.get(..2).unwrap_or(&[]),
        config,
    }
}

pub fn report<'a>(
    frames_ns: &'a [i64],
    truth: Option<&'a [StampedPose]>,
    methods: Vec<MethodReport<'a>>,
) -> Report<'a> {
    Report {
        sequence: "circles",
        facts: Vec::new(),
        frames_ns,
        truth,
        methods,
        shared_stages: Vec::new(),
        wall_s: 3.0,
        processor_time: None,
        version: "0",
        command: String::new(),
        scene_script: "function yfScene() {}",
    }
}
