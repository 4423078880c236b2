//! Bars and lines of the report have the height of the errors that they show, measured with the labels of the axes.
#![allow(clippy::unwrap_used, reason = "a test may")]

#[path = "common/drawing.rs"]
mod drawing;

mod common;

use common::{FRAME_NS, circles, method, report, wobble};
use drawing::{Drawing, Scale, color, drawings};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use yfslam_eval::{EvalOptions, Evaluation, StampedPose, evaluate};

/// Largest rounding error of a bar or a label in units of the figure, ten of which are a pixel.
const ROUNDING: f64 = 3.0;
/// Lines are thinned by up to a third of a pixel.
const THINNED: f64 = 7.0;
const FRAMES: i64 = 300;

fn time_s(pose: &StampedPose) -> f64 {
    pose.timestamp_ns as f64 / 1e9
}

/// Returns the page of `none` and `yf` with their evaluations.
fn page(truth: &[StampedPose], estimates: [&[StampedPose]; 2]) -> (String, [Evaluation; 2]) {
    let frames_ns: Vec<i64> = (0..FRAMES).map(|i| i * FRAME_NS).collect();
    let evaluations = estimates.map(|e| evaluate(truth, e, &EvalOptions::default()).unwrap());
    let methods =
        vec![method("none", estimates[0], Some(&evaluations[0])), method("yf", estimates[1], Some(&evaluations[1]))];
    (report(&frames_ns, Some(truth), methods).html(), evaluations)
}

/// Returns the height of a line at a horizontal position, between its points.
fn height_at(line: &[[f64; 2]], x: f64) -> f64 {
    let k = line.partition_point(|p| p[0] < x).clamp(1, line.len() - 1);
    let ([x0, y0], [x1, y1]) = (line[k - 1], line[k]);
    y0 + (y1 - y0) * ((x - x0) / (x1 - x0)).clamp(0.0, 1.0)
}

#[test]
fn bars_are_as_high_as_the_figures_of_the_table_on_linear_and_on_logarithmic_axes() {
    let truth = circles(FRAMES, |_| 0.0, |_| 0.0);
    let good = circles(FRAMES, wobble(0.004), |_| 0.0);
    for (worse_m, is_log) in [(0.015, false), (0.4, true)] {
        let bad = circles(FRAMES, wobble(worse_m), |_| 0.0);
        let (html, evaluations) = page(&truth, [&bad, &good]);
        let figure = &drawings(&html)["RMSE and standard deviation of the ATE"];
        assert_eq!(figure.labels[0].text.contains("logarithmic"), is_log);
        let y = figure.y();
        let base = figure.bars[0].y[1];
        assert_eq!(figure.bars.len(), 4);
        for (name, evaluation) in ["none", "yf"].into_iter().zip(&evaluations) {
            let statistics = evaluation.ate.translation_m;
            for (group, key, value) in [("RMSE", "rmse", statistics.rmse), ("S.D.", "std", statistics.std)] {
                let printed = format!("{value:.4}");
                let cell = format!("data-key=\"{name}.ate.translation_m.{key}\">{printed}</td>");
                assert!(html.contains(&cell), "no {cell}");
                let group_x = figure.labels.iter().find(|l| l.text == group).unwrap().x;
                let nearest = |bar: &&drawing::Bar| (bar.x[0] + bar.x[1] - 2.0 * group_x).abs() as i64;
                let ink = color(&html, name);
                let bar = figure.bars.iter().filter(|bar| bar.fill == ink).min_by_key(nearest).unwrap();
                let off = bar.y[0] - y.place(value);
                assert!(off.abs() < ROUNDING, "{name} {group} {value}: the bar shows {}", y.value(bar.y[0]));
                assert_eq!(bar.y[1], base, "{name} {group}: all bars start at the same height");
                assert!(is_log || (base - y.place(0.0)).abs() < ROUNDING, "a linear axis begins at 0");
                // Each bar has its value on top.
                let on_top = figure.labels.iter().any(|l| {
                    l.text == printed && bar.x[0] < l.x && l.x < bar.x[1] && (20.0..60.0).contains(&(bar.y[0] - l.y))
                });
                assert!(on_top, "{name} {group}: no {printed} above the bar");
            }
        }
    }
}

/// Checks a curve against the expected values at every pose, and returns the values of the curve.
fn read_curve(html: &str, figure: &Drawing, name: &str, expected: &[(f64, f64)], slack: f64) -> Vec<f64> {
    let (x, y): (Scale, Scale) = (figure.x(), figure.y());
    let line = figure.line(&color(html, name));
    let read = |&(time_s, value): &(f64, f64)| {
        let at = height_at(line, x.place(time_s));
        let off = (at - y.place(value)).abs();
        assert!(
            off < THINNED + slack * (y.place(1.0) - y.place(0.0)).abs(),
            "{name}: {} at {time_s} s instead of {value}",
            y.value(at)
        );
        y.value(at)
    };
    expected.iter().map(read).collect()
}

#[test]
fn the_curve_of_translation_shows_the_error_of_every_pose_and_its_rms_is_in_the_table() {
    let truth = circles(FRAMES, |_| 0.0, |_| 0.0);
    let slow = |size: f64| move |t: f64| size * (1.0 + (2.1 * t).sin() + 0.3 * (5.0 * t).cos());
    let (bad, good) = (circles(FRAMES, slow(0.03), |_| 0.0), circles(FRAMES, slow(0.006), |_| 0.0));
    let (html, evaluations) = page(&truth, [&bad, &good]);
    let figure = &drawings(&html)["Translation error over time"];
    for ((name, estimate), evaluation) in [("none", &bad), ("yf", &good)].into_iter().zip(&evaluations) {
        let error = |(pose, truth): (&StampedPose, &StampedPose)| {
            let aligned = evaluation.ate.alignment.apply(pose).t_world_cam.translation.vector;
            (time_s(pose), (aligned - truth.t_world_cam.translation.vector).norm())
        };
        let expected: Vec<_> = estimate.iter().zip(&truth).map(error).collect();
        let read = read_curve(&html, figure, name, &expected, 0.0);
        let rms = (read.iter().map(|v| v * v).sum::<f64>() / read.len() as f64).sqrt();
        let rmse = evaluation.ate.translation_m.rmse;
        assert!((rms / rmse - 1.0).abs() < 0.02, "{name}: {rms} m in the figure, {rmse} m in the table");
    }
}

#[test]
fn the_curves_of_roll_pitch_and_yaw_show_rotations_about_the_axes_of_the_camera() {
    let truth = circles(FRAMES, |_| 0.0, |_| 0.0);
    // Many whole periods: the alignment removes hardly any constant rotation.
    let period_s = FRAMES as f64 * FRAME_NS as f64 / 1e9;
    let wave = |t: f64, periods: f64| (std::f64::consts::TAU * periods * t / period_s).sin();
    let angles_deg = |t: f64| [2.0 * wave(t, 13.0), 1.2 * wave(t, 17.0), 3.0 * wave(t, 11.0)];
    let turned = |pose: &StampedPose, share: f64| {
        let [roll, pitch, yaw] = angles_deg(time_s(pose)).map(|a| share * a.to_radians());
        let about = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
        // Forward is z, right x, down y.
        let off = about(Vector3::y_axis(), yaw) * about(Vector3::x_axis(), pitch) * about(Vector3::z_axis(), roll);
        let t = pose.t_world_cam;
        StampedPose::new(pose.timestamp_ns, Isometry3::from_parts(t.translation, t.rotation * off))
    };
    let [bad, good] = [1.0, 0.3].map(|share| truth.iter().map(|p| turned(p, share)).collect::<Vec<_>>());
    let (html, _) = page(&truth, [&bad, &good]);
    let figures = drawings(&html);
    for (k, name) in ["Roll", "Pitch", "Yaw"].into_iter().enumerate() {
        for (method, share) in [("none", 1.0), ("yf", 0.3)] {
            let expected: Vec<_> = truth.iter().map(|p| (time_s(p), share * angles_deg(time_s(p))[k])).collect();
            read_curve(&html, &figures[&format!("{name} error over time")], method, &expected, 0.06);
        }
    }
}

/// Returns the distance of a point from a line.
fn distance(line: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
    let to = |pair: &[[f64; 2]]| {
        let ([x0, y0], [dx, dy]) = (pair[0], [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]]);
        let share = (((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy).max(1e-9)).clamp(0.0, 1.0);
        (x - x0 - share * dx).hypot(y - y0 - share * dy)
    };
    line.windows(2).map(to).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_views_show_every_position_at_its_place() {
    let truth = circles(FRAMES, |_| 0.0, |_| 0.0);
    let (bad, good) = (circles(FRAMES, |t| 0.05 * t, |_| 0.0), circles(FRAMES, wobble(0.02), |_| 0.0));
    let (html, evaluations) = page(&truth, [&bad, &good]);
    let figures = drawings(&html);
    let above = &figures["From above"];
    let side = &figures["From the side"];
    let tracks = [("none", &bad, &evaluations[0]), ("yf", &good, &evaluations[1])];
    for (name, track, evaluation) in tracks {
        let ink = color(&html, name);
        for pose in track {
            let p = evaluation.ate.alignment.apply(pose).t_world_cam.translation.vector;
            for (figure, [h, v]) in [(above, [p.x, p.y]), (side, [p.x, p.z])] {
                let off = distance(figure.line(&ink), [figure.x().place(h), figure.y().place(v)]);
                assert!(off < THINNED, "{name}: {off} beside the line at {} s", time_s(pose));
            }
        }
    }
}
