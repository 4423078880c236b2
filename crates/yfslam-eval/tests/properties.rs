//! Properties that hold for any trajectory, and cases with figures that were computed by hand.

#![allow(clippy::unwrap_used, reason = "a test may")]

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use yfslam_eval::{
    AlignmentKind, Delta, EvalError, EvalOptions, ExpectedFrames, Match, RpeOptions, StampedPose, align, associate,
    ate, evaluate, rpe,
};

const FRAME_NS: i64 = 100_000_000;

/// Returns poses at 10 Hz.
fn trajectory(poses: impl IntoIterator<Item = Isometry3<f64>>) -> Vec<StampedPose> {
    poses.into_iter().zip(0..).map(|(p, i)| StampedPose::new(i * FRAME_NS, p)).collect()
}

fn at(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, z)
}

/// Returns a path that is neither straight nor flat.
fn curve(n: usize) -> Vec<StampedPose> {
    trajectory((0..n).map(|i| {
        let s = i as f64 / 10.0;
        Isometry3::new(Vector3::new(s.cos(), (1.3 * s).sin(), 0.2 * s), Vector3::new(0.1 * s, 0.3, -0.2 * s))
    }))
}

fn matched(reference: &[StampedPose], estimate: &[StampedPose]) -> Vec<Match> {
    associate(reference, estimate, 1_000_000).unwrap()
}

fn transformed(poses: &[StampedPose], scale: f64, by: &Isometry3<f64>) -> Vec<StampedPose> {
    let scaled =
        |p: &Isometry3<f64>| Isometry3::from_parts(Translation3::from(p.translation.vector * scale), p.rotation);
    poses.iter().map(|p| StampedPose::new(p.timestamp_ns, by * scaled(&p.t_world_cam))).collect()
}

fn any_motion() -> impl Strategy<Value = Isometry3<f64>> {
    let component = || -3.0..3.0_f64;
    let vector = move || (component(), component(), component()).prop_map(|(x, y, z)| Vector3::new(x, y, z));
    (vector(), vector()).prop_map(|(t, r)| Isometry3::new(t, r))
}

fn any_trajectory() -> impl Strategy<Value = Vec<StampedPose>> {
    prop::collection::vec(any_motion(), 12..40).prop_map(trajectory)
}

proptest! {
    #[test]
    fn a_rigid_motion_of_the_estimate_changes_neither_ate_nor_rpe(e in any_trajectory(), by in any_motion()) {
        let r = curve(e.len());
        let (before, after) = (matched(&r, &e), matched(&r, &transformed(&e, 1.0, &by)));
        for kind in [AlignmentKind::Se3, AlignmentKind::Sim3] {
            let [a, b] = [&before, &after].map(|m| ate(m, kind).unwrap());
            prop_assert!((a.translation_m.rmse - b.translation_m.rmse).abs() < 1e-9);
            prop_assert!((a.alignment.scale - b.alignment.scale).abs() < 1e-9);
        }
        let [a, b] = [&before, &after].map(|m| rpe(m, &RpeOptions::per_second()).unwrap());
        prop_assert!((a.translation_m.rmse - b.translation_m.rmse).abs() < 1e-9);
        prop_assert!((a.rotation_deg.rmse - b.rotation_deg.rmse).abs() < 1e-6);
    }

    #[test]
    fn scale_and_pose_of_a_similar_trajectory_are_recovered(r in any_trajectory(), by in any_motion(), scale in 0.01..100.0) {
        let m = matched(&r, &transformed(&r, scale, &by));
        let found = ate(&m, AlignmentKind::Sim3).unwrap();
        prop_assert!(found.translation_m.max < 1e-9);
        prop_assert!((found.alignment.scale * scale - 1.0).abs() < 1e-9);
        prop_assert!(found.alignment.rotation.angle_to(&by.rotation.inverse()) < 1e-6);
    }

    #[test]
    fn no_nearby_transform_beats_the_alignment(e in any_trajectory(), nudge in any_motion(), zoom in -1.0..1.0_f64) {
        let m = matched(&curve(e.len()), &e);
        for kind in [AlignmentKind::Se3, AlignmentKind::Sim3] {
            let best = align(&m, kind).unwrap();
            let mut other = best;
            other.rotation = UnitQuaternion::identity().slerp(&nudge.rotation, 1e-3) * best.rotation;
            other.translation += 1e-3 * nudge.translation.vector;
            if kind == AlignmentKind::Sim3 {
                other.scale *= 1.0 + 1e-3 * zoom;
            }
            let cost = |a: &yfslam_eval::Alignment| -> f64 {
                let offset = |m: &Match| a.apply(&m.estimate).t_world_cam.translation.vector
                    - m.reference.t_world_cam.translation.vector;
                m.iter().map(|m| offset(m).norm_squared()).sum()
            };
            prop_assert!(cost(&best) <= cost(&other));
        }
    }

    #[test]
    fn each_pose_of_the_shorter_trajectory_takes_the_nearest_of_the_longer(
        r in prop::collection::btree_set(0..60_i64, 1..12), e in prop::collection::btree_set(0..60_i64, 1..12), max in 0..9_i64,
    ) {
        const SECOND_NS: i64 = 1_000_000_000;
        let poses = |s: &std::collections::BTreeSet<i64>| -> Vec<StampedPose> {
            s.iter().map(|t| StampedPose::new(t * SECOND_NS, Isometry3::identity())).collect()
        };
        let swap = e.len() > r.len();
        let (short, long) = if swap { (&r, &e) } else { (&e, &r) };
        let mut expected = Vec::new();
        for t in short {
            let n = long.iter().min_by_key(|o| (t - **o).abs()).unwrap();
            if (t - n).abs() <= max {
                expected.push(if swap { (*t, *n) } else { (*n, *t) });
            }
        }
        let seconds = |m: &Match| (m.reference.timestamp_ns / SECOND_NS, m.estimate.timestamp_ns / SECOND_NS);
        let found = associate(&poses(&r), &poses(&e), (max * SECOND_NS) as u64);
        prop_assert_eq!(found.map_or(vec![], |m| m.iter().map(seconds).collect()), expected);
    }
}

#[test]
fn identical_trajectories_have_no_error() {
    let evaluation = evaluate(&curve(50), &curve(50), &EvalOptions::default()).unwrap();
    assert!(evaluation.ate.translation_m.max < 1e-14);
    for rpe in evaluation.rpe {
        assert!(rpe.translation_m.max < 1e-14 && rpe.rotation_deg.max < 1e-5);
    }
}

#[test]
fn alternately_lifted_corners_of_a_square_have_the_lift_as_error() {
    let square = |lift: f64| trajectory([at(1., 1., lift), at(-1., 1., -lift), at(-1., -1., lift), at(1., -1., -lift)]);
    let ate = ate(&matched(&square(0.0), &square(0.25)), AlignmentKind::Se3).unwrap();
    assert!((ate.translation_m.min - 0.25).abs() < 1e-12 && (ate.translation_m.max - 0.25).abs() < 1e-12);
    assert!(ate.alignment.rotation.angle() < 1e-12);
}

#[test]
fn constant_drift_is_measured_over_frames_seconds_and_metres() {
    // Every 0.1 s the camera moves 0.1 m forward; the estimate adds 1 mm and turns by 0.2 degrees about the direction of travel.
    let straight = |step_m: f64, turn_deg: f64| {
        trajectory((0..31).map(|i| {
            let i = f64::from(i);
            Isometry3::new(Vector3::x() * step_m * i, Vector3::x() * (turn_deg * i).to_radians())
        }))
    };
    let m = matched(&straight(0.1, 0.0), &straight(0.101, 0.2));
    let cases = [
        (Delta::Frames(1), false, 30, 1.0),
        (Delta::Frames(10), false, 3, 10.0),
        (Delta::Frames(10), true, 21, 10.0),
        (Delta::Seconds(1.0), false, 3, 10.0),
        (Delta::Seconds(1.0), true, 21, 10.0),
        (Delta::Metres(0.5), false, 6, 5.0),
        (Delta::Metres(0.5), true, 26, 5.0),
    ];
    for (delta, all_pairs, count, steps) in cases {
        let found = rpe(&m, &RpeOptions { delta, all_pairs, relative_tolerance: 0.05 }).unwrap();
        assert_eq!(found.translation_m.count, count, "{delta}, all pairs {all_pairs}");
        assert!((found.translation_m.mean - 0.001 * steps).abs() < 1e-12, "{delta}");
        assert!((found.rotation_deg.mean - 0.2 * steps).abs() < 1e-9, "{delta}");
        assert!(found.translation_m.std < 1e-12, "{delta}");
    }
}

#[test]
fn no_pair_in_seconds_spans_a_gap_in_tracking() {
    let all = curve(60);
    let estimate: Vec<_> = all.iter().copied().filter(|p| !(15..35).contains(&(p.timestamp_ns / FRAME_NS))).collect();
    let m = matched(&all, &estimate);
    // The 15 poses before the gap start 5 pairs, and the 25 after it start 15.
    assert_eq!(rpe(&m, &RpeOptions::per_second()).unwrap().translation_m.count, 5 + 15);
    assert_eq!(
        rpe(&m, &RpeOptions { all_pairs: false, ..RpeOptions::per_second() }).unwrap().translation_m.count,
        1 + 2
    );
}

#[test]
fn input_that_cannot_be_compared_is_refused_by_name() {
    let good = curve(20);
    let with = |f: &dyn Fn(&mut Vec<StampedPose>)| {
        let mut changed = good.clone();
        f(&mut changed);
        evaluate(&good, &changed, &EvalOptions::default()).unwrap_err()
    };
    assert!(matches!(with(&|p| p.clear()), EvalError::Empty { .. }));
    assert!(matches!(with(&|p| p.truncate(2)), EvalError::TooFewMatches { found: 2, needed: 3 }));
    assert!(matches!(with(&|p| p.swap(3, 4)), EvalError::Unsorted { index: 4, .. }));
    let nan = with(&|p| p[7].t_world_cam.translation.x = f64::NAN).to_string();
    assert!(nan.contains("pose 7 of the estimate, at 0.700000000 s"), "{nan}");
    assert!(matches!(with(&|p| p[7].t_world_cam.translation.x = 1e200), EvalError::BadPose { index: 7, .. }));
    let zero_quaternion = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(0.0, 0.0, 0.0, 0.0));
    assert!(matches!(with(&|p| p[7].t_world_cam.rotation = zero_quaternion), EvalError::BadPose { index: 7, .. }));
    let apart = with(&|p| p.iter_mut().for_each(|p| p.timestamp_ns += 1_000_000_000_000)).to_string();
    assert!(apart.contains("0.000000000 to 1.900000000 s, the estimate 1000.000000000 to"), "{apart}");
    let near = with(&|p| p.iter_mut().for_each(|p| p.timestamp_ns += 40_000_000));
    assert_eq!(near, EvalError::NoMatch { max_diff_ns: 10_000_000, closest_ns: 40_000_000 });
}

#[test]
fn positions_on_a_line_or_at_a_point_have_no_alignment() {
    let along = Vector3::new(0.3, -0.7, 0.1);
    let line = trajectory((0..20).map(|i| Isometry3::from(Vector3::new(5.0, 6.0, 7.0) + along * f64::from(i) / 3.0)));
    let point = trajectory((0..20).map(|_| at(0.1, 0.2, 0.3)));
    for estimate in [&line, &point] {
        for kind in [AlignmentKind::Se3, AlignmentKind::Sim3] {
            let error = ate(&matched(&curve(20), estimate), kind).unwrap_err();
            assert!(matches!(error, EvalError::Degenerate { .. }), "{error}");
        }
    }
}

#[test]
fn a_span_that_does_not_occur_or_is_out_of_range_is_refused() {
    let m = matched(&curve(20), &curve(20));
    for delta in [Delta::Frames(20), Delta::Seconds(5.0), Delta::Metres(100.0)] {
        for all_pairs in [false, true] {
            let error = rpe(&m, &RpeOptions::new(delta, all_pairs)).unwrap_err();
            assert!(matches!(error, EvalError::NoPairs { matches: 20, .. }), "{error}");
        }
    }
    for delta in [Delta::Frames(0), Delta::Seconds(-1.0), Delta::Metres(f64::NAN)] {
        assert!(matches!(rpe(&m, &RpeOptions::new(delta, true)), Err(EvalError::BadDelta { .. })));
    }
}

#[test]
fn an_evaluation_survives_json() {
    let reference = curve(40);
    let expected = ExpectedFrames::StampsNs(reference.iter().map(|p| p.timestamp_ns).collect());
    let options = EvalOptions { alignment: AlignmentKind::Sim3, expected, ..EvalOptions::default() };
    let estimate = transformed(&reference[..30], 0.5, &Isometry3::identity());
    let evaluation = evaluate(&reference, &estimate, &options).unwrap();
    let json = serde_json::to_string(&evaluation).unwrap();
    let again = serde_json::from_str::<yfslam_eval::Evaluation>(&json).unwrap();
    // Decimal numbers may differ in the last bit.
    assert_eq!((again.matches, again.coverage), (evaluation.matches, evaluation.coverage));
    assert!((again.ate.alignment.scale - 2.0).abs() < 1e-9 && again.rpe.len() == evaluation.rpe.len());
}

#[test]
fn the_path_ratio_is_the_scale_of_the_estimate_unless_the_alignment_takes_it_out() {
    let reference = curve(30);
    let half = transformed(&reference, 0.5, &at(1.0, 2.0, 3.0));
    let ratio = |alignment| {
        let options = EvalOptions { alignment, ..EvalOptions::default() };
        evaluate(&reference, &half, &options).unwrap().path_ratio.unwrap()
    };
    assert!((ratio(AlignmentKind::Se3) - 0.5).abs() < 1e-9);
    assert!((ratio(AlignmentKind::Sim3) - 1.0).abs() < 1e-9);
}
