//! `--vslam-lab`: the file in which VSLAM-LAB looks for the result of a baseline.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use yfslam_io::prepare_folder;

/// What follows the number of the run in the name of the file.
const SUFFIX: &str = "_KeyFrameTrajectory.csv";

/// Returns the file for `FOLDER/ID`, and removes that of an earlier run, which must not be taken for the result of this one.
///
/// # Errors
/// There is no ID, or the folder cannot be written to.
pub fn prepare(prefix: &Path) -> Result<PathBuf> {
    let ends_in_separator = prefix.to_string_lossy().ends_with(std::path::is_separator);
    let id = prefix.file_name().filter(|_| !ends_in_separator && !prefix.is_dir());
    ensure!(
        id.is_some(),
        "--vslam-lab {} has no number of the run; give the folder and the number, such as {}",
        prefix.display(),
        prefix.join("00000").display()
    );
    let mut name = id.unwrap_or_default().to_owned();
    name.push(SUFFIX);
    let path = prefix.with_file_name(name);
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    prepare_folder(folder)?;
    if path.exists() {
        std::fs::remove_file(&path).with_context(|| format!("cannot remove the old {}", path.display()))?;
    }
    Ok(path)
}
