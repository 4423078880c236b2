//! The page of any input: long, lost, far off, without truth.

#![allow(clippy::unwrap_used)]

use nalgebra::{Isometry3, Vector3};
use yfslam_eval::report::{Frames, MethodReport, Picture, Report, Stage, Times};
use yfslam_eval::{EvalOptions, Evaluation, StampedPose, evaluate};

const FRAME_NS: i64 = 33_333_333;

/// A camera that goes in circles, z up, looking ahead; `off_m` and `off_deg` are what is wrong at a time in s.
fn circles(frames: i64, off_m: impl Fn(f64) -> f64, off_deg: impl Fn(f64) -> f64) -> Vec<StampedPose> {
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

fn wobble(size: f64) -> impl Fn(f64) -> f64 {
    move |t| size * ((3.1 * t).sin() + (171.7 * t).sin() + (1.3 * t).cos())
}

fn method<'a>(name: &'a str, trajectory: &'a [StampedPose], evaluation: Option<&'a Evaluation>) -> MethodReport<'a> {
    let stage = |name: &str, ms: f64| Stage { name: name.into(), count: 9, median_ms: ms, p99_ms: 3.0 * ms };
    let times =
        Times { stages: vec![stage("features", 1.5), stage("mapping", 12.0)], tracking_s: 2.5, cpu_s: Some(2.0) };
    let frames = Frames { total: trajectory.len() + 90, tracked: trajectory.len(), lost: 90, skipped: Vec::new() };
    let picture = Picture { frame: 3, note: "", png: vec![0; 9], size: [4, 3], features: [8, 1] };
    let config = "seed = 0 # <&>\n".into();
    MethodReport {
        name,
        summary: "",
        trajectory,
        evaluation,
        frames,
        times,
        pictures: vec![picture],
        dense: None,
        config,
    }
}

fn report<'a>(frames_ns: &'a [i64], truth: Option<&'a [StampedPose]>, methods: Vec<MethodReport<'a>>) -> Report<'a> {
    Report {
        sequence: "circles",
        facts: Vec::new(),
        frames_ns,
        truth,
        methods,
        shared_stages: Vec::new(),
        wall_s: 3.0,
        version: "0",
        command: String::new(),
    }
}

/// Points of all lines of the page.
fn points(html: &str) -> usize {
    html.split("points=\"").skip(1).map(|part| part.split('"').next().unwrap().split_whitespace().count()).sum()
}

#[test]
fn half_an_hour_with_a_method_a_thousand_times_worse_stays_small_and_readable() {
    let frames = 54_000;
    let frames_ns: Vec<i64> = (0..frames).map(|i| i * FRAME_NS).collect();
    let truth = circles(frames, |_| 0.0, |_| 0.0);
    let good = circles(frames, wobble(0.002), wobble(0.1));
    let mut bad = circles(frames, |t| 0.01 * t, |t| 0.05 * t);
    bad.drain(20_000..30_000);
    let [of_bad, of_good] = [&bad, &good].map(|e| evaluate(&truth, e, &EvalOptions::default()).unwrap());
    let methods = vec![method("none", &bad, Some(&of_bad)), method("yf", &good, Some(&of_good))];
    let html = report(&frames_ns, Some(&truth), methods).html();
    std::fs::write(std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("long.html"), &html).unwrap();
    assert!(html.len() < 1_500_000, "{}", html.len());
    assert!(points(&html) < 60_000 && points(&html) > 5_000, "{}", points(&html));
    assert!(html.contains("Cut off where an estimate goes far beyond the truth"));
    assert!(
        html.contains("error, logarithmic")
            && html.contains("ATE, logarithmic")
            && html.contains("error (°), logarithmic")
    );
    assert!(html.contains("A cross is where tracking was lost"));
    // What the figure of the errors calls the largest is what the table calls so.
    let largest = of_good.ate.translation_m.max * 1e3;
    assert!(html.contains(&format!("yf {largest:.2} mm")), "{largest}");
}

#[test]
fn a_page_without_truth_without_poses_or_without_anything_is_still_a_page() {
    let frames_ns: Vec<i64> = (0..100).map(|i| i * FRAME_NS).collect();
    let poses = circles(100, |_| 0.0, |_| 0.0);
    let without_truth = report(&frames_ns, None, vec![method("yf", &poses, None)]).html();
    assert!(without_truth.contains("no ground truth") && without_truth.contains("From above"));
    assert!(!without_truth.contains("Error over time"));
    let not_comparable = report(&frames_ns, Some(&poses), vec![method("yf", &poses[..1], None)]).html();
    assert!(not_comparable.contains("The trajectory of yf cannot be compared"));
    let one_pose = report(&frames_ns[..1], None, vec![method("yf", &poses[..1], None)]).html();
    assert!(one_pose.contains("From above"));
    let nothing = report(&[], None, Vec::new()).html();
    assert!(nothing.ends_with("</html>"));
    for html in [without_truth, not_comparable, one_pose, nothing] {
        assert!(!html.contains("NaN") && !html.contains("inf"), "{html}");
    }
}
