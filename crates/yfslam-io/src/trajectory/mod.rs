//! Trajectories in the formats of TUM, KITTI and EuRoC: world from camera, or from the body whose poses the file has.
//!
//! ```text
//! TUM     timestamp tx ty tz qx qy qz qw        one pose in each line, with blanks or commas
//! EuRoC   nanoseconds,px,py,pz,qw,qx,qy,qz,…    with commas
//! KITTI   r11 r12 r13 tx r21 … tz               no time; also 4 × 4 matrices of 16 numbers
//! bag     PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped, or chains of TF
//! ```

mod bag;
mod columns;
mod parse;
mod stamps;
mod transforms;
mod write;

use std::path::Path;

pub use yfslam_eval::StampedPose;

use crate::error::{Error, Result};
use crate::text::read_text;
use crate::time::TimeMirror;
use crate::timestamp_order::keep_ascending;
pub(crate) use bag::read_topic;
pub use bag::read_trajectory;
pub use write::{write_trajectory, write_trajectory_as};

const FORMAT_CURE: &str = "write 'timestamp tx ty tz qx qy qz qw' with blanks between the values, or give a file in the format of KITTI or EuRoC";

/// Time between two poses of a file without times, ns: the rate of KITTI is 10 Hz.
const KITTI_PERIOD_NS: i64 = 100_000_000;

/// A file whose stamps run backward in more than one of this many lines is sorted; in fewer, these lines are left out.
const LINES_PER_BACKWARD: usize = 20;

/// Formats of trajectory files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrajectoryFormat {
    /// Time in seconds, position, quaternion x y z w.
    #[default]
    Tum,
    /// Time in nanoseconds, position, quaternion w x y z, with commas.
    Euroc,
    /// The upper three rows of a matrix, without a time.
    Kitti,
    /// Time in nanoseconds, position, quaternion x y z w, with commas and a header, as VSLAM-LAB has ground truths and results. It is
    /// written; a file that is read is recognised as that of TUM with a header.
    VslamLab,
}

/// A trajectory read from a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrajectoryFile {
    /// The poses; stamps ascend strictly.
    pub poses: Vec<StampedPose>,
    /// Lines skipped because their stamp occurred before.
    pub duplicates_skipped: usize,
    /// Lines skipped because their stamps run backward.
    pub backward_skipped: usize,
    /// Format of the file.
    pub format: TrajectoryFormat,
    /// What the user should know about how the file was read.
    pub notes: Vec<String>,
    /// Topic of a bag that the poses come from; `None` for a file of text.
    pub source: Option<String>,
}

impl TrajectoryFile {
    /// Reads a trajectory file in any of the formats, which is recognised by its content, or a bag with one topic of poses;
    /// [`read_trajectory`] chooses one of several.
    ///
    /// # Errors
    /// The file is unreadable or empty, or a line has the wrong number of columns, a value that is not finite, or a rotation that is
    /// none.
    pub fn read(path: &Path) -> Result<Self> {
        read_trajectory(path, None, "`yfslam convert BAG poses.txt --to tum --topic`")
    }

    /// Parses the text of a trajectory file; `path` names it in error messages.
    ///
    /// # Errors
    /// As [`TrajectoryFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let parse::Parsed { poses, format, notes } = parse::parse(text, path)?;
        let mut file = Self::from_poses(poses, path)?;
        file.format = format;
        file.notes.splice(0..0, notes);
        Ok(file)
    }

    /// Keeps the poses whose stamps ascend, or sorts them where many run backward; `path` names the file in error messages.
    pub(crate) fn from_poses(poses: Vec<StampedPose>, path: &Path) -> Result<Self> {
        if poses.is_empty() {
            return Err(Error::content(path, "contains no pose", FORMAT_CURE));
        }
        let lines = poses.len();
        let unsorted = || Sorted::of(&poses);
        match keep_ascending(poses.clone(), |pose: &StampedPose| pose.timestamp_ns, path) {
            Ok(kept) if kept.backward <= (lines / LINES_PER_BACKWARD).max(1) => Ok(Self {
                poses: kept.items,
                duplicates_skipped: kept.duplicates,
                backward_skipped: kept.backward,
                ..Self::default()
            }),
            _ => {
                let Sorted { poses, duplicates } = unsorted();
                let notes = vec!["the poses are not in the order of time; they were sorted".to_owned()];
                Ok(Self { poses, duplicates_skipped: duplicates, notes, ..Self::default() })
            }
        }
    }

    /// Takes the times of a list, one for each pose, for a file without times.
    ///
    /// # Errors
    /// The numbers differ, or the times do not ascend.
    pub fn with_times(mut self, times_ns: &[i64], path: &Path) -> Result<Self> {
        if times_ns.len() != self.poses.len() {
            let problem = format!("holds {} times, but the trajectory has {} poses", times_ns.len(), self.poses.len());
            return Err(Error::content(path, problem, "give the times of this sequence"));
        }
        for (pose, &timestamp_ns) in self.poses.iter_mut().zip(times_ns) {
            pose.timestamp_ns = timestamp_ns;
        }
        if self.poses.windows(2).any(|pair| matches!(pair, [a, b] if a.timestamp_ns >= b.timestamp_ns)) {
            return Err(Error::content(path, "has times that do not ascend", "give the times of this sequence"));
        }
        self.notes.clear();
        Ok(self)
    }
}

/// Reads a list of times in seconds, one in each line, such as `times.txt` of KITTI.
///
/// # Errors
/// The file is unreadable, or a line is not a time.
pub fn read_times(path: &Path) -> Result<Vec<i64>> {
    let text = read_text(path)?;
    stamps::parse_all(crate::text::content_lines(&text), path).map(|stamps| stamps.stamps_ns)
}

/// Poses in the order of time.
struct Sorted {
    poses: Vec<StampedPose>,
    duplicates: usize,
}

impl Sorted {
    fn of(poses: &[StampedPose]) -> Self {
        let mut sorted = poses.to_vec();
        sorted.sort_by_key(|pose| pose.timestamp_ns);
        let all = sorted.len();
        sorted.dedup_by_key(|pose| pose.timestamp_ns);
        Self { duplicates: all - sorted.len(), poses: sorted }
    }
}

/// Returns the ground truth of a sequence that is played backward: the stamps are mirrored and the order is reversed.
pub fn mirror_trajectory(poses: &[StampedPose], mirror: TimeMirror) -> Vec<StampedPose> {
    let mirrored = |pose: &StampedPose| StampedPose { timestamp_ns: mirror.apply(pose.timestamp_ns), ..*pose };
    poses.iter().rev().map(mirrored).collect()
}

#[cfg(test)]
mod tests;
