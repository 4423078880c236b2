//! The evaluation of a trajectory against another.

use std::path::Path;

use yfslam_eval::{AlignmentKind, Delta, EvalOptions, ExpectedFrames, RpeOptions, StampedPose, calibrate, evaluate};
use yfslam_io::TrajectoryFile;

/// Most poses of each trajectory: the relative errors of all pairs take time with the square of their number.
const MOST_POSES: usize = 64;

/// A byte of options, then two trajectories as text with a line of `=` between them.
pub fn eval(bytes: &[u8]) -> bool {
    let Some((&choice, text)) = bytes.split_first() else { return false };
    let Ok(text) = std::str::from_utf8(text) else { return false };
    let Some((reference, estimate)) = text.split_once("\n=\n") else { return false };
    let read = |text: &str| {
        let mut poses = TrajectoryFile::parse(text, Path::new("trajectory.txt")).ok()?.poses;
        poses.truncate(MOST_POSES);
        Some(poses)
    };
    let Some((reference, estimate)) = read(reference).zip(read(estimate)) else { return false };
    let alignments = [AlignmentKind::Se3, AlignmentKind::Sim3, AlignmentKind::Origin, AlignmentKind::None];
    let deltas = [Delta::Frames(1), Delta::Frames(usize::MAX), Delta::Seconds(1.0), Delta::Metres(0.1)];
    let chosen = |shift: u8| usize::from(choice >> shift & 3);
    let stamps = || reference.iter().map(|pose: &StampedPose| pose.timestamp_ns).collect();
    let options = EvalOptions {
        max_diff_ns: if choice & 64 == 0 { 20_000_000 } else { u64::MAX },
        alignment: alignments[chosen(0)],
        rpe: vec![RpeOptions::new(deltas[chosen(2)], choice & 16 == 0)],
        expected: if choice & 32 == 0 { ExpectedFrames::StampsNs(stamps()) } else { ExpectedFrames::Count(9) },
    };
    let evaluated = evaluate(&reference, &estimate, &options);
    let _ = evaluate(&estimate, &reference, &EvalOptions::default());
    if choice & 128 != 0 {
        let _ = calibrate(&reference, &estimate, 20_000_000);
    }
    evaluated.is_ok()
}
