//! What each part of method `full` is worth: the error without it.

use anyhow::{Context, Result};

use super::recordings::RECORDINGS;
use super::{Job, Setup, Topic, runs};
use crate::record::Record;
use crate::render::{Spread, Table, number, one_state, select, values};
use crate::row::Row;
use crate::trajectories::{Part, frame_count};

/// The topic.
pub const TOPIC: Topic = Topic { name: "ablation", title: "What each part of `full` is worth", minutes: 6, jobs, page };

const WORLDS: [&str; 5] = ["walking_xyz", "walking_rpy", "pushed_chair", "carried_box", "crowd"];
const SEEDS: usize = 3;
/// What is left out, and the configuration that leaves it out.
const PARTS: [(&str, &str); 9] = [
    ("nothing", ""),
    (
        "tracks of people are carried over missed detections",
        "[dynamic]\nmax_misses = 0\n[dynamic.full]\nmax_misses = 0\n",
    ),
    ("comparison with the depth history", "[dynamic.full]\nhistory_frames = 1\n"),
    ("segmentation across gaps in the depth", "[dynamic.full]\nmax_gap_cells = 0\n"),
    ("features at the edges of person masks are dropped", "[dynamic.full]\nedge_px = 0.0\n"),
    ("visibility check of landmarks", "[dynamic.full]\nfree_space_margin_m = 100.0\n"),
    ("features tell which instances move", "[dynamic.full]\ndisplacement_min_features = 100000\n"),
    ("boxes are doubted before the camera is lost", "[dynamic.full]\ndoubted_box_trust = 0.0\n"),
    ("features return when too few are left", "[dynamic]\nmin_trusted = 0\n"),
];

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let mut jobs = Vec::new();
    for (part, settings) in &PARTS[..setup.pick(PARTS.len(), 2)] {
        for world in &WORLDS[..setup.pick(WORLDS.len(), 1)] {
            jobs.push(Job::new(format!("{world} without: {part}"), move |setup| {
                let mut rows = Vec::new();
                let mut first = String::new();
                for seed in 1..=setup.pick(SEEDS, 1) {
                    let options = [("seed", seed.to_string()), ("frames", setup.pick(150, 60).to_string())];
                    let (command, row) = run(setup, &runs::world(world, &options), settings, &[])?;
                    rows.push(row(Row::new().case("sequence", world).case("without", part).case("seed", seed)));
                    first = if first.is_empty() { command } else { first };
                }
                Ok((first, rows))
            }));
        }
        for (name, folder) in setup.recordings(&RECORDINGS[..setup.pick(RECORDINGS.len(), 1)]) {
            let (name, folder) = (name.to_owned(), folder.clone());
            jobs.push(Job::new(format!("{name} without: {part}"), move |setup| {
                let range = Part { start: 0, frames: setup.quick.then_some(60), backward: false };
                let mut options = vec!["--detector".to_owned(), "embedded".to_owned(), "--groundtruth".to_owned()];
                options.push(runs::text(&folder.join("groundtruth.txt"))?);
                options.extend(range.arguments(frame_count(&folder)?));
                let (command, row) = run(setup, &runs::text(&folder)?, settings, &options)?;
                Ok((command, vec![row(Row::new().case("sequence", &name).case("without", part).case("seed", 0))]))
            }));
        }
    }
    Ok(jobs)
}

/// A run with changed settings: its command, and what fills a row.
fn run(
    setup: &Setup,
    sequence: &str,
    settings: &str,
    options: &[String],
) -> Result<(String, impl FnOnce(Row) -> Row + use<>)> {
    std::fs::create_dir_all(&setup.program.out)?;
    let file = setup.program.out.join("part.toml");
    std::fs::write(&file, settings).with_context(|| format!("cannot write {}", file.display()))?;
    let mut options = options.to_vec();
    options.extend(["--config".to_owned(), runs::text(&file)?]);
    let (command, mut done) = runs::methods(setup, sequence, &["full"], &options)?;
    let done = done.pop().context("no run")?;
    if let Err(failure) = &done.result {
        anyhow::bail!("{command} with {settings:?}: {failure}");
    }
    let command = format!("{command}  (part.toml: {})", settings.trim().replace('\n', "; "));
    Ok((command, move |row| runs::row(row, &done, runs::accuracy)))
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    let sequences = values(records, "sequence");
    let mut table = Table::new(["without"].into_iter().chain(sequences.iter().copied()));
    for part in values(records, "without") {
        let cell = |sequence: &&str| {
            let rows = select(records, &[("without", part), ("sequence", sequence)]);
            let ate = Spread::of(rows.iter().map(|record| record.figure("ate_m"))).map(|spread| spread.median);
            let missing = |record: &&Record| Some(record.figure("frames_read")? - record.figure("frames_tracked")?);
            let lost: f64 = rows.iter().filter_map(missing).sum();
            number(ate, 4) + &if lost > 0.0 { format!(" ({lost} lost)") } else { String::new() }
        };
        table.row([part.to_owned()].into_iter().chain(sequences.iter().map(cell)));
    }
    Ok(format!(
        "ATE in metres of method `full` without one of its parts: the median of three seeds of rendered worlds (boxes from the renderer), and \
         one run of each recording (boxes from the embedded network). Behind it, where there are any, the frames that were not tracked. \
         Differences of a few per cent are within the spread between seeds or starts.\n\n{table}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_is_left_out_by_settings_that_exist() {
        for (part, settings) in PARTS {
            let config = yfslam::Config::from_toml(settings);
            assert!(config.is_ok(), "{part}: {:?}", config.err());
        }
    }
}
