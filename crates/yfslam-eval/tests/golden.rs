//! Every figure equals that of `evo` on published trajectories; `golden.csv` has the figures and the commands that produced them.

#![allow(clippy::unwrap_used, reason = "a test may")]

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::path::{Path, PathBuf};
use yfslam_eval::{AlignmentKind, Delta, Match, RpeOptions, StampedPose, Statistics, align, associate, ate, rpe};

const GOLDEN: &str = include_str!("golden.csv");
/// Tolerance, m or degrees: the file has twelve digits, and one differently matched pose of two thousand exceeds it.
const TOLERANCE: f64 = 1e-9;

fn data() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("YFSLAM_DATA").map_or(beside, PathBuf::from).join("trajectories");
    folder.is_dir().then_some(folder)
}

fn read(path: &Path) -> Vec<StampedPose> {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty());
    let pose = |line: &str| {
        let (stamp, rest) = line.split_once(' ').unwrap();
        let (whole, decimals) = stamp.split_once('.').unwrap();
        let v: Vec<f64> = rest.split_whitespace().map(|w| w.parse().unwrap()).collect();
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(v[6], v[3], v[4], v[5]));
        let timestamp_ns = format!("{whole}{decimals:0<9}").parse().unwrap();
        StampedPose::new(timestamp_ns, Isometry3::from_parts(Translation3::new(v[0], v[1], v[2]), rotation))
    };
    lines.map(pose).collect()
}

/// Computes the statistics that a row of the file describes.
fn compute(matches: &[Match], metric: &str, unit: &str, delta: &str, pairs: &str) -> Statistics {
    let delta = match unit {
        "" => None,
        "f" => Some(Delta::Frames(delta.parse().unwrap())),
        "s" => Some(Delta::Seconds(delta.parse().unwrap())),
        "m" => Some(Delta::Metres(delta.parse().unwrap())),
        other => panic!("unit {other}"),
    };
    let relative = |matches: &[Match]| {
        let options = RpeOptions::new(delta.unwrap(), pairs == "all_pairs");
        let relative_tolerance = if unit == "s" { 0.05 } else { options.relative_tolerance };
        rpe(matches, &RpeOptions { relative_tolerance, ..options }).unwrap()
    };
    match metric {
        "ate_se3" => ate(matches, AlignmentKind::Se3).unwrap().translation_m,
        "ate_sim3" => ate(matches, AlignmentKind::Sim3).unwrap().translation_m,
        "trans_part" => relative(matches).translation_m,
        "trans_part_sim3" => relative(&align(matches, AlignmentKind::Sim3).unwrap().scaled(matches)).translation_m,
        "angle_deg" => relative(matches).rotation_deg,
        other => panic!("metric {other}"),
    }
}

#[test]
fn all_statistics_equal_those_of_evo() {
    let Some(folder) = data() else {
        println!("skipped: no trajectories, set YFSLAM_DATA to the folder of the test data");
        return;
    };
    let (mut rows, mut worst) = (0, 0.0_f64);
    for line in GOLDEN.lines().skip(1) {
        let f: Vec<&str> = line.split(',').collect();
        let [sequence, metric, max_diff_s, unit, delta, pairs, count] = f[..7] else { panic!("row {line}") };
        let max_diff_ns = (max_diff_s.parse::<f64>().unwrap() * 1e9) as u64;
        let reference = read(&folder.join(format!("{sequence}_groundtruth.txt")));
        let estimate = read(&folder.join(format!("{sequence}_ORB.txt")));
        let matches = associate(&reference, &estimate, max_diff_ns).unwrap();
        let s = compute(&matches, metric, unit, delta, pairs);

        assert_eq!(s.count, count.parse::<usize>().unwrap(), "{line}");
        for (ours, golden) in [s.rmse, s.mean, s.median, s.std, s.min, s.max].iter().zip(&f[7..13]) {
            let difference = (ours - golden.parse::<f64>().unwrap()).abs();
            assert!(difference < TOLERANCE, "{ours} is off by {difference:e}: {line}");
            worst = worst.max(difference);
        }
        rows += 1;
    }
    println!("{rows} rows, largest difference {worst:e}");
    assert_eq!(rows, 86);
}
