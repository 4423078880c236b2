//! Trajectories of other systems in a bench.
//!
//! In: a name with a file or folder of trajectories. Out: cells like those of our methods, without times.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result, ensure};
use yfslam_eval::Delta;
use yfslam_io::TrajectoryFile;
use yfslam_io::trajectory::TrajectoryFormat;

use super::cell::{Cell, Group};
use crate::command::run::RunArgs;
use crate::run::evaluation::evaluate_possible;
use crate::ui::terminal::{Terminal, explain};

/// Endings of a trajectory after the name of its sequence.
const ENDINGS: [&str; 8] = [
    ".txt",
    ".csv",
    ".tum",
    ".kitti",
    "/trajectory.txt",
    "/CameraTrajectory.txt",
    "/KeyFrameTrajectory.txt",
    "_KeyFrameTrajectory.csv",
];

/// Another system with its trajectories.
#[derive(Clone, Debug)]
pub struct External {
    /// Name in the tables.
    pub name: String,
    /// A trajectory, or a folder with one for each sequence.
    path: PathBuf,
}

impl FromStr for External {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('=').map(|(name, path)| (name.trim(), path.trim()));
        let (name, path) = parts
            .filter(|(name, path)| !name.is_empty() && !path.is_empty())
            .ok_or_else(|| format!("'{text}' is not NAME=FILE or NAME=FOLDER, such as ORB-SLAM3=results/orb"))?;
        Ok(Self { name: name.to_owned(), path: path.into() })
    }
}

/// Checks names and paths before the first run.
///
/// # Errors
/// A name is that of a method or is given twice, a path does not exist, or one file is given for several sequences.
pub fn check(externals: &[External], methods: &[String], groups: &[Group]) -> Result<()> {
    for (index, External { name, path }) in externals.iter().enumerate() {
        let is_taken = methods.contains(name) || externals.iter().take(index).any(|other| other.name == *name);
        ensure!(!is_taken, "--external {name}: a system of this name is in the tables already; choose another name");
        ensure!(path.exists(), "--external {name}: {} does not exist", path.display());
        let several = groups.windows(2).any(|pair| matches!(pair, [a, b] if a.sequence != b.sequence));
        ensure!(
            path.is_dir() || !several,
            "--external {name}: {} is one file, but there are several sequences; give a folder with a file for each sequence, such as {}.txt",
            path.display(),
            groups.first().map_or("walking_xyz", |group| file_name(group))
        );
    }
    Ok(())
}

/// Returns the last part of the name of a sequence, which files of other programs have.
fn file_name(group: &Group) -> &str {
    group.sequence.rsplit('/').next().unwrap_or(&group.sequence)
}

impl External {
    /// Returns the cell of a group; `None` where the system has no trajectory for a further seed. `is_first` is the first seed of a sequence.
    pub fn cell(&self, group: &Group, is_first: bool, extra: &[String], terminal: Terminal) -> Option<Cell> {
        let file = self.file(group, is_first);
        let cell = Cell {
            sequence: group.sequence.clone(),
            method: self.name.clone(),
            seed: group.seed,
            whole: group.whole,
            arguments: vec!["external".into(), file.as_ref().unwrap_or(&self.path).display().to_string()],
            ..Cell::default()
        };
        let Some(file) = file else {
            let looked = format!("no trajectory such as {}.txt in {}", file_name(group), self.path.display());
            return is_first.then_some(Cell { failure: Some(looked), ..cell });
        };
        Some(match self.evaluated(&file, group, extra, terminal) {
            Ok(figures) => figures(cell),
            Err(error) => Cell { failure: Some(explain(&error)), ..cell },
        })
    }

    /// Returns the trajectory for a sequence and seed. One without a seed in its name is that of the first seed.
    pub fn file(&self, group: &Group, is_first: bool) -> Option<PathBuf> {
        if self.path.is_file() {
            return is_first.then(|| self.path.clone());
        }
        let plain: String = group.sequence.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let names = [group.sequence.as_str(), file_name(group), &plain];
        let seed = group.seed;
        let seeded = names
            .iter()
            .flat_map(|name| [format!("{name}-{seed}"), format!("{name}_{seed}"), format!("{name}/{seed}")]);
        let unseeded = names.iter().map(|name| (*name).to_owned()).filter(|_| is_first);
        let stems: Vec<String> = seeded.chain(unseeded).collect();
        let candidates = stems.iter().flat_map(|stem| ENDINGS.map(|ending| self.path.join(format!("{stem}{ending}"))));
        candidates.into_iter().find(|path| path.is_file())
    }

    /// Evaluates a trajectory as those of our methods.
    fn evaluated(
        &self,
        file: &Path,
        group: &Group,
        extra: &[String],
        terminal: Terminal,
    ) -> Result<impl Fn(Cell) -> Cell + use<>> {
        // The arguments of the run, without its name.
        let arguments: Vec<OsString> = group.arguments(&["none"], extra).into_iter().skip(1).map(Into::into).collect();
        let (stamps_ns, truth, options) = RunArgs::parse(&arguments)?.reference(terminal)?;
        let mut estimate = TrajectoryFile::read(file)?;
        if estimate.format == TrajectoryFormat::Kitti {
            estimate = estimate.with_times(&stamps_ns, file)?;
        }
        let evaluation = evaluate_possible(&truth.poses, &estimate.poses, options);
        let evaluation = evaluation.with_context(|| format!("cannot evaluate {}", file.display()))?;
        Ok(move |cell: Cell| {
            let rpe = |seconds: bool| {
                let wanted = |delta: &Delta| matches!(delta, Delta::Seconds(_)) == seconds;
                evaluation.rpe.iter().find(|rpe| wanted(&rpe.options.delta))
            };
            Cell {
                ate_rmse_m: Some(evaluation.ate.translation_m.rmse),
                ate_std_m: Some(evaluation.ate.translation_m.std),
                tracked: evaluation.coverage.map(|coverage| coverage.fraction),
                rpe_frame_m: rpe(false).map(|rpe| rpe.translation_m.rmse),
                rpe_second_m: rpe(true).map(|rpe| rpe.translation_m.rmse),
                rpe_second_std_m: rpe(true).map(|rpe| rpe.translation_m.std),
                rpe_second_deg: rpe(true).map(|rpe| rpe.rotation_deg.rmse),
                rpe_second_std_deg: rpe(true).map(|rpe| rpe.rotation_deg.std),
                ..cell
            }
        })
    }
}

/// Adds the cells of other systems behind those of each group.
pub fn with_externals(
    cells: Vec<Cell>,
    groups: &[Group],
    externals: &[External],
    extra: &[String],
    terminal: Terminal,
) -> Vec<Cell> {
    let mut own = cells.into_iter();
    let mut all = Vec::new();
    let mut before: Option<&str> = None;
    for group in groups {
        all.extend(own.by_ref().take(group.methods.len()));
        let is_first = before != Some(&group.sequence);
        all.extend(externals.iter().filter_map(|external| external.cell(group, is_first, extra, terminal)));
        before = Some(&group.sequence);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_is_given_with_name_and_place() {
        let external: External = "ORB=a=b".parse().unwrap();
        assert_eq!((external.name.as_str(), external.path), ("ORB", PathBuf::from("a=b")));
        for text in ["", "ORB", "=a", "ORB="] {
            assert!(text.parse::<External>().unwrap_err().contains("NAME=FILE"), "{text}");
        }
    }
}
