//! The table of an evaluation.

#![allow(clippy::unwrap_used, reason = "a test may")]

mod common;

use common::circles;
use yfslam_eval::{AlignmentKind, EvalOptions, ExpectedFrames, StampedPose, evaluate};
use yfslam_report::{TableStyle, evaluation_table};

#[test]
fn the_table_has_all_errors_and_says_how_poses_were_associated() {
    let reference = circles(40, |_| 0.0, |_| 0.0);
    let halved = |pose: &StampedPose| {
        let mut pose = *pose;
        pose.t_world_cam.translation.vector *= 0.5;
        pose
    };
    let estimate: Vec<StampedPose> = reference[..30].iter().map(halved).collect();
    let expected = ExpectedFrames::StampsNs(reference.iter().map(|p| p.timestamp_ns).collect());
    let options = EvalOptions { alignment: AlignmentKind::Sim3, expected, ..EvalOptions::default() };
    let evaluation = evaluate(&reference, &estimate, &options).unwrap();
    let text = evaluation_table(&evaluation, TableStyle::Plain);
    let (header, ate) = (text.lines().next().unwrap(), text.lines().nth(2).unwrap());
    assert_eq!(
        header.split_whitespace().collect::<Vec<_>>(),
        ["error", "RMSE", "mean", "median", "S.D.", "min", "max", "n"]
    );
    assert!(ate.starts_with("ATE, Sim(3) (m)  ") && ate.ends_with("  0.0000   30"), "{text}");
    assert!(text.ends_with("; Sim(3), scale s = 2.0000; tracked 30 of 40 frames (75.0 %)\n"), "{text}");
    assert!(evaluation_table(&evaluation, TableStyle::Markdown).starts_with("| error "));
}
