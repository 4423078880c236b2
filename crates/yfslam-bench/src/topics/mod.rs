//! The topics: what is measured for each page of results, and how the page is written from the records.

pub mod ablation;
pub mod cost;
pub mod dense;
pub mod faults;
pub mod instructions;
pub mod loops;
pub mod monocular;
pub mod recordings;
pub mod runs;
pub mod shutter;
pub mod stereo;
pub mod synthetic;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::program::Program;
use crate::record::{self, Record, State};
use crate::row::Row;
use crate::state;

/// What a topic is measured with.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The program and its folders.
    pub program: Program,
    /// The state that is measured.
    pub state: State,
    /// Tiny settings, to try whether the topic can be measured.
    pub quick: bool,
}

impl Setup {
    /// The number for a real measurement, or the one for a trial.
    pub fn pick<T>(&self, real: T, quick: T) -> T {
        if self.quick { quick } else { real }
    }

    /// The recordings of `names` that are there.
    pub fn recordings<'a>(&self, names: &[&'a str]) -> Vec<(&'a str, PathBuf)> {
        let folder = |name: &&'a str| (*name, self.program.data.join("rgbd").join(name));
        names.iter().map(folder).filter(|(_, folder)| folder.is_dir()).collect()
    }
}

/// A part of a topic that is measured at once.
pub struct Job {
    /// Its name, by which a measurement that was interrupted knows what is done.
    pub name: String,
    /// The network, where it is not the embedded one.
    pub network: Option<String>,
    /// Measures: the command and the rows.
    pub run: Measure,
}

/// Measures a job: returns the command that gives the figures, and the figures.
pub type Measure = Box<dyn Fn(&Setup) -> Result<(String, Vec<Row>)>>;

impl Job {
    /// A job with the embedded network.
    pub fn new(name: impl Into<String>, run: impl Fn(&Setup) -> Result<(String, Vec<Row>)> + 'static) -> Self {
        Self { name: name.into(), network: None, run: Box::new(run) }
    }
}

/// A page of results.
pub struct Topic {
    /// Name of its files: `NAME.md` and `data/NAME.json`.
    pub name: &'static str,
    /// Title of the page.
    pub title: &'static str,
    /// About how long it takes to measure on two cores, minutes.
    pub minutes: u32,
    /// The jobs that can be measured with what is there.
    pub jobs: fn(&Setup) -> Result<Vec<Job>>,
    /// The text of the page below the title.
    pub page: fn(&[&Record]) -> Result<String>,
}

/// All topics, in the order of the pages.
pub const TOPICS: [&Topic; 11] = [
    &recordings::TOPIC,
    &synthetic::TOPIC,
    &monocular::TOPIC,
    &stereo::TOPIC,
    &shutter::TOPIC,
    &cost::TOPIC,
    &instructions::TOPIC,
    &dense::TOPIC,
    &loops::TOPIC,
    &ablation::TOPIC,
    &faults::TOPIC,
];

/// The topics of a name, or all of them.
///
/// # Errors
/// No topic has that name.
pub fn named(name: &str) -> Result<Vec<&'static Topic>> {
    let chosen: Vec<_> = TOPICS.iter().filter(|topic| name == "all" || topic.name == name).copied().collect();
    let names: Vec<_> = TOPICS.iter().map(|topic| topic.name).collect();
    ensure!(!chosen.is_empty(), "there is no topic {name}; choose all, {}", names.join(", "));
    Ok(chosen)
}

/// Measures what a topic's file does not have for this state yet. Each job is written as soon as it is done. Records of earlier states
/// go away with the first new one. Returns the failures.
///
/// # Errors
/// The file cannot be read or written, or the jobs cannot be listed.
pub fn measure(topic: &Topic, setup: &Setup, folder: &Path, tell: &dyn Fn(&str)) -> Result<Vec<String>> {
    let path = folder.join(format!("{}.json", topic.name));
    let jobs = (topic.jobs)(setup).with_context(|| format!("topic {}", topic.name))?;
    let mut failures = Vec::new();
    for (number, job) in jobs.iter().enumerate() {
        let mut records = record::read(&path)?;
        let network = job.network.clone().unwrap_or_else(|| setup.state.network.clone());
        let state = State { network, ..setup.state.clone() };
        let is_current =
            |r: &Record| r.state.commit == state.commit && r.state.machine == state.machine && r.quick == setup.quick;
        if records.iter().any(|r| is_current(r) && r.job == job.name && r.state == state) {
            continue;
        }
        tell(&format!("{} {} of {}: {}", topic.name, number + 1, jobs.len(), job.name));
        match (job.run)(setup) {
            Ok((command, rows)) => {
                records.retain(is_current);
                let new = |row| Record::new(state.clone(), &job.name, setup.quick, command.clone(), row);
                records.extend(rows.into_iter().map(new));
                record::write(&path, &records)?;
            }
            Err(error) => {
                tell(&format!("failed: {error:#}"));
                failures.push(format!("{}, {}: {error:#}", topic.name, job.name));
            }
        }
        let _ = std::fs::remove_dir_all(&setup.program.out);
    }
    if jobs.is_empty() {
        tell(&format!("{}: the data is not there, nothing is measured", topic.name));
    }
    Ok(failures)
}

/// The state that is measured at `root` with the program at `path`.
///
/// # Errors
/// See [`state::find`].
pub fn setup(root: &Path, path: PathBuf, data: PathBuf, out: PathBuf, quick: bool) -> Result<Setup> {
    let state = state::find(root, &path, quick)?;
    Ok(Setup { program: Program { path, data, out }, state, quick })
}
