//! Errors of trajectories that `run.json` does not hold: with a free scale, and of the poses as known at the time of each frame.

use std::path::Path;

use anyhow::Result;
use yfslam_eval::{AlignmentKind, EvalOptions, StampedPose, evaluate};
use yfslam_io::time::TimeMirror;
use yfslam_io::trajectory::mirror_trajectory;
use yfslam_io::{Sequence, SequenceOptions, TrajectoryFile};

/// Largest difference between the time stamps of an estimated and a true pose, ns.
const MAX_DIFFERENCE_NS: u64 = 20_000_000;

/// The part of a recording that is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Frames left out at the beginning of the playing.
    pub start: usize,
    /// Frames played at most.
    pub frames: Option<usize>,
    /// Whether it is played backward.
    pub backward: bool,
}

impl Part {
    /// The first frame of the recording that is played and the one after the last, in recorded order, of `count` frames.
    pub fn range(self, count: usize) -> (usize, usize) {
        let length = self.frames.unwrap_or(count).min(count.saturating_sub(self.start));
        if self.backward {
            let end = count - self.start.min(count);
            (end - length, end)
        } else {
            (self.start, self.start + length)
        }
    }

    /// The words for `yfslam run`.
    pub fn arguments(self, count: usize) -> Vec<String> {
        let (start, end) = self.range(count);
        let mut words = Vec::new();
        if start > 0 {
            words.extend(["--start".to_owned(), start.to_string()]);
        }
        if end < count {
            words.extend(["--end".to_owned(), end.to_string()]);
        }
        if self.backward {
            words.push("--reverse".to_owned());
        }
        words
    }
}

/// Number of frames of a recording.
///
/// # Errors
/// The recording cannot be read.
pub fn frame_count(folder: &Path) -> Result<usize> {
    Ok(Sequence::open(folder, &SequenceOptions::default())?.entries.len())
}

/// The ground truth of a recording, with mirrored time stamps if it is played backward.
///
/// # Errors
/// The recording or its ground truth cannot be read.
pub fn ground_truth(folder: &Path, part: Part) -> Result<Vec<StampedPose>> {
    let (start, end) = part.range(frame_count(folder)?);
    let options = SequenceOptions { start, end: Some(end), reverse: part.backward, ..Default::default() };
    let mirror: Option<TimeMirror> = Sequence::open(folder, &options)?.mirror;
    let mut truth = TrajectoryFile::read(&folder.join("groundtruth.txt"))?.poses;
    if let Some(mirror) = mirror {
        truth = mirror_trajectory(&truth, mirror);
    }
    Ok(truth)
}

/// The absolute trajectory error of a file after alignment, RMSE, m; `None` if it has too few poses to be aligned.
pub fn ate_m(truth: &[StampedPose], file: &Path, kind: AlignmentKind) -> Option<f64> {
    let estimate = TrajectoryFile::read(file).ok()?.poses;
    let options =
        EvalOptions { max_diff_ns: MAX_DIFFERENCE_NS, alignment: kind, rpe: Vec::new(), ..Default::default() };
    Some(evaluate(truth, &estimate, &options).ok()?.ate.translation_m.rmse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_later_start_leaves_out_what_is_played_first_in_either_direction() {
        let part = |start, frames, backward| Part { start, frames, backward };
        assert_eq!(part(0, None, false).arguments(300), Vec::<String>::new());
        assert_eq!(part(4, None, false).arguments(300), ["--start", "4"]);
        assert_eq!(part(4, None, true).arguments(300), ["--end", "296", "--reverse"]);
        assert_eq!(part(4, Some(60), true).arguments(300), ["--start", "236", "--end", "296", "--reverse"]);
        assert_eq!(part(290, Some(60), false).range(300), (290, 300));
    }
}
