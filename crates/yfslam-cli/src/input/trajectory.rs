//! Trajectories from files.

use std::path::Path;

use anyhow::{Result, ensure};
use yfslam_eval::StampedPose;
use yfslam_io::trajectory::{TrajectoryFormat, read_times};
use yfslam_io::{TrajectoryFile, read_trajectory};

use crate::ui::terminal::Terminal;

/// A file of poses, or a topic of a bag.
#[derive(Clone, Copy, Debug)]
pub struct Compared<'a> {
    /// The file or bag.
    pub path: &'a Path,
    /// Topic of the bag; `None` finds it by type.
    pub topic: Option<&'a str>,
    /// What the user chooses the topic with.
    pub flag: &'a str,
}

impl<'a> Compared<'a> {
    /// Makes the file of these arguments.
    pub fn of(path: &'a Path, topic: &'a Option<String>, flag: &'a str) -> Self {
        Self { path, topic: topic.as_deref(), flag }
    }
}

/// Reads a ground truth and estimates that are compared with it, in any format. A file in the format of KITTI has no times: they come from
/// `times`, or from the numbers of the lines if all files have as many.
///
/// # Errors
/// A file cannot be read, or only some of them have times.
pub fn read_compared(
    compared: &[Compared<'_>],
    times: Option<&Path>,
    terminal: Terminal,
) -> Result<Vec<Vec<StampedPose>>> {
    let times_ns = times.map(read_times).transpose()?;
    let paths: Vec<&Path> = compared.iter().map(|file| file.path).collect();
    let mut files = Vec::new();
    for Compared { path, topic, flag } in compared {
        let file = read_trajectory(path, *topic, flag)?;
        files.push(match &times_ns {
            Some(times_ns) if file.format == TrajectoryFormat::Kitti => {
                file.with_times(times_ns, times.unwrap_or(path))?
            }
            _ => file,
        });
    }
    let untimed = |file: &TrajectoryFile| times.is_none() && file.format == TrajectoryFormat::Kitti;
    if let Some(first) = files.iter().position(untimed) {
        let length = |file: &TrajectoryFile| file.poses.len();
        let name = paths.get(first).map_or_else(String::new, |path| path.display().to_string());
        ensure!(
            files.iter().all(untimed),
            "{name} is in the format of KITTI, which has no times, but another file has them; give --times with the list of times of its frames (times.txt)"
        );
        ensure!(
            files.windows(2).all(|pair| pair.first().map(length) == pair.last().map(length)),
            "the files are in the format of KITTI, which has no times, and have different numbers of poses; give files with one pose for each frame, or files in the format of TUM"
        );
    }
    Ok(files.into_iter().zip(paths).map(|(file, path)| checked_poses(file, path, terminal)).collect())
}

/// Returns the poses that were read from `path`; warns of those that were left out.
pub fn checked_poses(file: TrajectoryFile, path: &Path, terminal: Terminal) -> Vec<StampedPose> {
    let TrajectoryFile { poses, duplicates_skipped, backward_skipped, notes, source, .. } = file;
    if let Some(source) = source {
        terminal.note(&format!("{}: {} poses of {source}", path.display(), poses.len()));
    }
    for note in notes {
        terminal.warn(&format!("{}: {note}", path.display()));
    }
    if duplicates_skipped + backward_skipped > 0 {
        terminal.warn(&format!(
            "{}: {duplicates_skipped} poses skipped because their time stamp repeats, {backward_skipped} because it runs backward",
            path.display()
        ));
    }
    poses
}
