//! Trajectories in the TUM format: `timestamp tx ty tz qx qy qz qw`, one pose per line, world from camera.

use std::io;
use std::path::Path;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

pub use yfslam_eval::StampedPose;

use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::text::{content_lines, read_text};
use crate::time::{TimeMirror, format_stamp, parse_stamp_ns};
use crate::timestamp_order::keep_ascending;

/// Largest deviation of the length of a quaternion from 1. Files with two decimals stay below it; columns in another order rarely do.
const MAX_NORM_ERROR: f64 = 0.05;

/// Names of the columns after the stamp.
const COLUMNS: [&str; 7] = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"];

const FORMAT_CURE: &str = "write 'timestamp tx ty tz qx qy qz qw' with blanks between the values";

/// A trajectory read from a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrajectoryFile {
    /// The poses; stamps ascend strictly.
    pub poses: Vec<StampedPose>,
    /// Lines skipped because their stamp occurred before.
    pub duplicates_skipped: usize,
    /// Lines skipped because their stamps run backward.
    pub backward_skipped: usize,
}

impl TrajectoryFile {
    /// Reads a trajectory file.
    ///
    /// # Errors
    /// The file is unreadable or empty, or a line has the wrong number of columns, a value that is not finite, or a quaternion that is
    /// not of unit length.
    pub fn read(path: &Path) -> Result<Self> {
        Self::parse(&read_text(path)?, path)
    }

    /// Parses the text of a trajectory file; `path` names it in error messages.
    ///
    /// # Errors
    /// As [`TrajectoryFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let poses =
            content_lines(text).map(|(number, line)| parse_pose(line, path, number)).collect::<Result<Vec<_>>>()?;
        Self::from_poses(poses, path)
    }

    /// Keeps the poses whose stamps ascend; `path` names the file in error messages.
    pub(crate) fn from_poses(poses: Vec<StampedPose>, path: &Path) -> Result<Self> {
        if poses.is_empty() {
            return Err(Error::content(path, "contains no pose", FORMAT_CURE));
        }
        let kept = keep_ascending(poses, |pose: &StampedPose| pose.timestamp_ns, path)?;
        Ok(Self { poses: kept.items, duplicates_skipped: kept.duplicates, backward_skipped: kept.backward })
    }
}

/// Returns the ground truth of a sequence that is played backward: the stamps are mirrored and the order is reversed.
pub fn mirror_trajectory(poses: &[StampedPose], mirror: TimeMirror) -> Vec<StampedPose> {
    let mirrored = |pose: &StampedPose| StampedPose { timestamp_ns: mirror.apply(pose.timestamp_ns), ..*pose };
    poses.iter().rev().map(mirrored).collect()
}

/// Writes poses with all nine decimals of their stamps.
///
/// # Errors
/// The file cannot be written, or a pose is not finite.
pub fn write_trajectory(path: &Path, poses: &[StampedPose]) -> Result<()> {
    write_atomically(path, |writer| {
        writeln!(writer, "# timestamp tx ty tz qx qy qz qw")?;
        for StampedPose { timestamp_ns, t_world_cam } in poses {
            let (t, q) = (t_world_cam.translation.vector, t_world_cam.rotation.coords);
            let stamp = format_stamp(*timestamp_ns);
            if !t.iter().chain(q.iter()).all(|value| value.is_finite()) {
                return Err(io::Error::new(io::ErrorKind::InvalidData, format!("the pose at {stamp} is not finite")));
            }
            writeln!(writer, "{stamp} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9}", t.x, t.y, t.z, q.x, q.y, q.z, q.w)?;
        }
        Ok(())
    })
}

fn parse_pose(line: &str, path: &Path, number: usize) -> Result<StampedPose> {
    let mut columns = line.split_whitespace();
    let count = columns.clone().count();
    if count != 8 {
        return Err(Error::line(path, number, format!("{count} columns, not 8"), FORMAT_CURE));
    }
    let stamp = columns.next().unwrap_or_default();
    let timestamp_ns = parse_stamp_ns(stamp).map_err(|error| {
        Error::line(path, number, format!("stamp '{stamp}' {error}"), "write it as decimal seconds")
    })?;
    let mut values = [0.0; 7];
    for ((value, text), name) in values.iter_mut().zip(columns).zip(COLUMNS) {
        *value = match text.parse::<f64>() {
            Ok(parsed) if parsed.is_finite() => parsed,
            _ => {
                let problem = format!("{name} is '{text}', not a finite number");
                return Err(Error::line(path, number, problem, "remove the line or repair the value"));
            }
        };
    }
    let [tx, ty, tz, qx, qy, qz, qw] = values;
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    let norm = quaternion.norm();
    if (norm - 1.0).abs() > MAX_NORM_ERROR {
        let problem = format!("quaternion ({qx} {qy} {qz} {qw}) has the length {norm:.3}, not 1");
        return Err(Error::line(path, number, problem, "check the order of the columns: tx ty tz qx qy qz qw"));
    }
    let pose = Isometry3::from_parts(Translation3::new(tx, ty, tz), UnitQuaternion::from_quaternion(quaternion));
    Ok(StampedPose::new(timestamp_ns, pose))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<TrajectoryFile> {
        TrajectoryFile::parse(text, Path::new("groundtruth.txt"))
    }

    fn refusal(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    const GOOD: &str = "# ground truth\r\n1305031101.1759 1.3812 0.6186 1.6987 0.6520 0.6182 -0.2954 -0.3248\r\n\n\
        1.305031102175899982e+09\t0 0 0 0 0 0 1\n";

    #[test]
    fn comments_crlf_tabs_and_exponents_are_read() {
        let file = parse(GOOD).unwrap();
        assert_eq!(file.poses.len(), 2);
        assert_eq!(file.poses[0].timestamp_ns, 1_305_031_101_175_900_000);
        assert_eq!(file.poses[0].t_world_cam.translation.vector.as_slice(), [1.3812, 0.6186, 1.6987]);
        assert!(
            (file.poses[0].t_world_cam.rotation.w + 0.3248).abs() < 1e-4
                && (file.poses[0].t_world_cam.rotation.norm() - 1.0).abs() < 1e-12
        );
        assert_eq!(file.poses[1].timestamp_ns, 1_305_031_102_175_899_982);
    }

    #[test]
    fn malformed_poses_are_refused_with_line_and_value() {
        for (line, expected) in [
            ("1 nan 0 0 0 0 0 1", "tx is 'nan'"),
            ("1 0 0 inf 0 0 0 1", "tz is 'inf'"),
            ("1 0 0 0 0 0 0 x", "qw is 'x'"),
            ("NaN 0 0 0 0 0 0 1", "stamp 'NaN'"),
            ("1 0 0 0 0 0 1", "7 columns, not 8"),
            ("1 0 0 0 0 0 0 1 9", "9 columns, not 8"),
            ("1,0,0,0,0,0,0,1", "1 columns, not 8"),
            ("1 0 0 0 0 0 0 0", "length 0.000"),
            ("1 0 0 0 0 1 1 1", "length 1.732"),
        ] {
            let error = refusal(&format!("{GOOD}{line}\n"));
            assert!(error.starts_with("groundtruth.txt:5: ") && error.contains(expected), "{error}");
        }
        assert!(refusal("# nothing\n").contains("contains no pose"));
        assert!(TrajectoryFile::read(Path::new("/nowhere/x.txt")).unwrap_err().to_string().contains("/nowhere/x.txt"));
    }

    #[test]
    fn repeated_and_backward_stamps_are_skipped_and_counted() {
        let lines: String = ["1", "2", "2", "9", "3", "4"].iter().map(|t| format!("{t} {t} 0 0 0 0 0 1\n")).collect();
        let file = parse(&lines).unwrap();
        assert_eq!((file.poses.len(), file.duplicates_skipped, file.backward_skipped), (4, 1, 1));
        assert!(refusal("3 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").contains("sort the file"));
    }

    #[test]
    fn a_mirrored_trajectory_ascends_and_keeps_its_poses() {
        let lines: String = (1..=3).map(|t| format!("{t} {t} 0 0 0 0 0 1\n")).collect();
        let poses = parse(&lines).unwrap().poses;
        let mirrored = mirror_trajectory(&poses, TimeMirror { first_ns: 1_000_000_000, last_ns: 4_000_000_000 });
        let seen: Vec<_> =
            mirrored.iter().map(|p| (p.timestamp_ns / 1_000_000_000, p.t_world_cam.translation.x)).collect();
        assert_eq!(seen, [(2, 3.0), (3, 2.0), (4, 1.0)]);
    }

    #[test]
    fn a_pose_that_is_not_finite_is_never_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.txt");
        let pose = StampedPose::new(5, Isometry3::translation(f64::NAN, 0.0, 0.0));
        let error = write_trajectory(&path, &[pose]).unwrap_err().to_string();
        assert!(error.contains("poses.txt") && error.contains("0.000000005"), "{error}");
        assert!(!path.exists());
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_again(raw in prop::collection::vec((0i64..1 << 60, prop::array::uniform6(-9.0..9.0f64)), 1..20)) {
            let mut poses: Vec<_> = raw
                .into_iter()
                .map(|(timestamp_ns, [x, y, z, a, b, c])| {
                    let rotation = UnitQuaternion::from_euler_angles(a, b, c);
                    StampedPose::new(timestamp_ns, Isometry3::from_parts(Translation3::new(x, y, z), rotation))
                })
                .collect();
            poses.sort_by_key(|p| p.timestamp_ns);
            poses.dedup_by_key(|p| p.timestamp_ns);
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("poses.txt");
            write_trajectory(&path, &poses).unwrap();
            let read = TrajectoryFile::read(&path).unwrap();
            prop_assert_eq!(read.poses.len(), poses.len());
            for (read, written) in read.poses.iter().zip(&poses) {
                prop_assert_eq!(read.timestamp_ns, written.timestamp_ns);
                prop_assert!((read.t_world_cam.translation.vector - written.t_world_cam.translation.vector).norm() < 2e-9);
                prop_assert!(read.t_world_cam.rotation.angle_to(&written.t_world_cam.rotation) < 2e-8);
            }
        }

        #[test]
        fn arbitrary_text_never_panics(text in "([0-9]{1,3} ){0,9}|([-0-9.e \tnaif\n#]|.){0,200}") {
            let _ = parse(&text);
        }
    }
}
