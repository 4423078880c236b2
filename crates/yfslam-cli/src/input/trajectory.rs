//! Trajectories from files.

use std::path::Path;

use anyhow::Result;
use yfslam_eval::StampedPose;
use yfslam_io::TrajectoryFile;

use crate::ui::terminal::Terminal;

/// Reads a trajectory and warns of the poses in it that cannot be used.
///
/// # Errors
/// The file cannot be read or holds values that are not a pose.
pub fn read_poses(path: &Path, terminal: Terminal) -> Result<Vec<StampedPose>> {
    Ok(checked_poses(TrajectoryFile::read(path)?, path, terminal))
}

/// Returns the poses that were read from `path`; warns of those that were left out.
pub fn checked_poses(file: TrajectoryFile, path: &Path, terminal: Terminal) -> Vec<StampedPose> {
    let TrajectoryFile { poses, duplicates_skipped, backward_skipped, notes, .. } = file;
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
