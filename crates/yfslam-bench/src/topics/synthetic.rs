//! Accuracy on the suite of rendered worlds, and beside it the published filters on four of them.

use anyhow::{Context, Result};
use serde_json::Value;

use super::{Job, Setup, Topic, runs};
use crate::record::Record;
use crate::render::{Spread, Table, methods, one_state, percent, select, values};
use crate::row::Row;

/// The topic.
pub const TOPIC: Topic = Topic { name: "synthetic", title: "Accuracy on rendered worlds", minutes: 9, jobs, page };

const METHODS: [&str; 4] = ["none", "boxes", "yf", "full"];
/// Filters of published systems, and the worlds on which they are compared.
const PUBLISHED: [&str; 3] = ["ds", "dyna", "dms"];
const WORLDS: [&str; 4] = ["walking_xyz", "walking_rpy", "sitting_xyz", "pushed_chair"];
const SEEDS: usize = 3;

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let suite = yfslam_synth::names();
    let worlds = suite.iter().take(setup.pick(suite.len(), 1));
    let mut jobs: Vec<Job> = worlds.map(|world| job(world, &METHODS)).collect();
    jobs.extend(WORLDS[..setup.pick(WORLDS.len(), 1)].iter().map(|world| job(world, &PUBLISHED)));
    Ok(jobs)
}

/// All seeds of a world, by `yfslam bench`.
fn job(world: &str, methods: &'static [&'static str]) -> Job {
    let world = world.to_owned();
    Job::new(format!("{world} with {}", methods.join(", ")), move |setup| {
        let (seeds, frames) = (setup.pick(SEEDS, 1).to_string(), setup.pick(150, 60).to_string());
        let out = setup.program.out.join("bench");
        let words = [
            "bench",
            &world,
            "--methods",
            &methods.join(","),
            "--seeds",
            &seeds,
            "--frames",
            &frames,
            "--quiet",
            "--out",
        ];
        let arguments: Vec<String> =
            words.map(str::to_owned).into_iter().chain([out.to_string_lossy().into_owned()]).collect();
        setup.program.run(&arguments)?;
        Ok((setup.program.command(&arguments), cells(&out.join("cells"))?))
    })
}

/// The cells that `yfslam bench` leaves, by method and seed.
fn cells(folder: &std::path::Path) -> Result<Vec<Row>> {
    let mut paths = std::fs::read_dir(folder)
        .with_context(|| format!("cannot read {}", folder.display()))?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<Vec<_>>>()?;
    paths.sort();
    let mut rows = Vec::new();
    for path in paths.iter().filter(|path| path.extension().is_some_and(|extension| extension == "json")) {
        let cell: Value = serde_json::from_str(&std::fs::read_to_string(path)?)?;
        let word = |key: &str| cell.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
        let seed = cell.get("seed").map_or_else(String::new, ToString::to_string);
        let mut row = Row::new().case("sequence", word("sequence")).case("method", word("method")).case("seed", seed);
        for key in ["ate_rmse_m", "tracked", "rpe_frame_m", "rpe_second_m", "rpe_second_deg"] {
            row = row.figure(key, runs::number(&cell, &format!("/{key}")));
        }
        let failure = word("failure");
        rows.push(if failure.is_empty() { row } else { row.figure("failure", failure) });
    }
    Ok(rows)
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    let published = |record: &&&Record| PUBLISHED.contains(&record.case("method"));
    let suite: Vec<&Record> = records.iter().filter(|record| !published(record)).copied().collect();
    let text = "Five seconds (150 frames) of each world of `yfslam synth --list` at 640 × 480 px. Boxes of people come from the renderer, so \
        these figures do not depend on the network. Figures are the median over the seeds, each of which gives another world.\n\n";
    let mut text = text.to_owned() + &table(&suite, &values(&suite, "sequence"))?.to_string();
    let worlds = values(&records.iter().filter(published).copied().collect::<Vec<_>>(), "sequence");
    if !worlds.is_empty() {
        text += "\n## Filters of published systems\n\n\
            The filters of DS-SLAM (`ds`), DynaSLAM (`dyna`) and DMS-SLAM (`dms`) on the front and back end of this project, beside ours. \
            What those systems owe to their other parts is not compared.\n\n";
        text += &table(records, &worlds)?.to_string();
    }
    Ok(text)
}

fn table(records: &[&Record], worlds: &[&str]) -> Result<Table> {
    one_state(records.iter().copied())?;
    let mut table = Table::new([
        "world",
        "method",
        "ATE, m",
        "tracked, median (least)",
        "RPE per frame, m",
        "RPE per second, m",
        "runs, failed",
    ]);
    for world in worlds {
        let of_world = select(records, &[("sequence", world)]);
        for method in methods(&of_world) {
            let rows = select(&of_world, &[("method", method)]);
            let spread = |key: &str| Spread::of(rows.iter().map(|record| record.figure(key)));
            let tracked = spread("tracked");
            let failed = rows.iter().filter(|record| record.text("failure").is_some()).count();
            table.row([
                (*world).to_owned(),
                method.to_owned(),
                Spread::text(spread("ate_rmse_m"), 4),
                format!("{} ({})", percent(tracked.map(|s| s.median), 1), percent(tracked.map(|s| s.min), 1)),
                Spread::middle(spread("rpe_frame_m"), 4),
                Spread::middle(spread("rpe_second_m"), 4),
                format!("{}, {failed}", rows.len()),
            ]);
        }
    }
    Ok(table)
}
