//! Rolling shutter: what its correction gains on recordings and in rendered worlds, and how well the readout time is estimated.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;
use yfslam_eval::AlignmentKind;

use super::recordings::RECORDINGS;
use super::{Job, Setup, Topic, runs};
use crate::record::Record;
use crate::render::{Spread, Table, number, one_state, select, values};
use crate::row::Row;
use crate::trajectories::{Part, ate_m, frame_count, ground_truth};

/// The topic.
pub const TOPIC: Topic = Topic { name: "shutter", title: "Rolling shutter", minutes: 30, jobs, page };

/// The starts: every fifth frame from 0 to 20.
const STARTS: usize = 5;
/// How the readout time reaches the program.
const SOURCES: [&str; 3] = ["known", "estimated", "ignored"];
/// Camera motions of the worlds.
const WORLDS: [&str; 4] = ["walking_static", "walking_xyz", "walking_rpy", "walking_halfsphere"];
/// Readout time of the rendered cameras, ms.
const READOUT_MS: u32 = 30;
/// Size of the rendered images: errors are larger than at full size, by the same factor for every shutter.
const SIZE: [(&str, &str); 2] = [("width", "400"), ("height", "300")];
const SEEDS: u32 = 3;
/// World, readout times, ms, and number of seeds from which the readout time is estimated.
const ESTIMATED: (&str, [u32; 3], u32) = ("walking_halfsphere", [0, 15, 33], 20);

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let mut jobs = Vec::new();
    for (name, folder) in setup.recordings(&RECORDINGS) {
        for source in SOURCES {
            for backward in [false, true] {
                for start in (0..setup.pick(STARTS, 1)).map(|index| 5 * index) {
                    let part = Part { start, frames: setup.quick.then_some(60), backward };
                    jobs.push(recording(name, &folder, source, part));
                }
            }
        }
    }
    for world in &WORLDS[..setup.pick(WORLDS.len(), 1)] {
        for people in [false, true] {
            jobs.extend((0..setup.pick(SEEDS, 1)).map(|seed| rendered(world, people, seed)));
        }
    }
    for readout_ms in ESTIMATED.1 {
        jobs.extend((0..setup.pick(ESTIMATED.2, 1)).map(|seed| estimate(readout_ms, seed)));
    }
    Ok(jobs)
}

/// Writes the configuration that leaves the readout time out, and returns the arguments that use it.
fn ignoring(setup: &Setup) -> Result<[String; 2]> {
    let file = setup.program.out.join("ignored.toml");
    std::fs::create_dir_all(&setup.program.out)?;
    std::fs::write(&file, "[tracking]\nestimate_readout = \"never\"\n")
        .with_context(|| format!("cannot write {}", file.display()))?;
    Ok(["--config".to_owned(), runs::text(&file)?])
}

/// A recording: with the readout time of the preset, with the camera file of the data folder, which does not tell it, and without.
fn recording(name: &'static str, folder: &Path, source: &'static str, part: Part) -> Job {
    let direction = if part.backward { "backward" } else { "forward" };
    let folder = folder.to_owned();
    Job::new(format!("{name} {direction} from {}, {source}", part.start), move |setup| {
        // Where people walk, no result without a filter says anything.
        let (preset, methods): (_, &[&str]) =
            if name.starts_with("tum") { ("tum1", &["none", "full"]) } else { ("bonn", &["full"]) };
        let mut options = part.arguments(frame_count(&folder)?);
        match source {
            "known" => options.extend(["--camera".to_owned(), preset.to_owned()]),
            "ignored" => options.extend(ignoring(setup)?),
            _ => {}
        }
        let (command, done) = runs::methods(setup, &runs::text(&folder)?, methods, &options)?;
        let truth = ground_truth(&folder, part)?;
        let rows = done.iter().map(|run| {
            let case = Row::new().case("sequence", name).case("method", &run.method).case("direction", direction);
            runs::row(case.case("readout", source).case("start", part.start), run, |row, value| {
                let live_m = ate_m(&truth, &run.folder.join("live.txt"), AlignmentKind::Se3);
                readout(runs::accuracy(row, value).figure("ate_live_m", live_m), value)
            })
        });
        Ok((command, rows.collect()))
    })
}

/// The same world with a global shutter, and with a rolling one that is known, estimated and ignored.
fn rendered(world: &'static str, people: bool, seed: u32) -> Job {
    let with = if people { "people" } else { "no people" };
    Job::new(format!("{world}, {with}, seed {seed}"), move |setup| {
        let method = if people { "full" } else { "none" };
        let (mut rows, mut commands) = (Vec::new(), Vec::new());
        for shutter in ["global"].into_iter().chain(SOURCES) {
            let mut options = SIZE.map(|(key, value)| (key, value.to_owned())).to_vec();
            options.extend([("frames", setup.pick(150, 60).to_string()), ("seed", seed.to_string())]);
            if !people {
                options.push(("people", "0".to_owned()));
            }
            if shutter != "global" {
                options.push(("readout", READOUT_MS.to_string()));
            }
            if ["estimated", "ignored"].contains(&shutter) {
                options.push(("unknown_readout", "on".to_owned()));
            }
            let more = if shutter == "ignored" { ignoring(setup)?.to_vec() } else { Vec::new() };
            let (command, done) = runs::methods(setup, &runs::world(world, &options), &[method], &more)?;
            commands.push(command);
            let case = Row::new().case("world", world).case("people", with).case("seed", seed).case("shutter", shutter);
            rows.extend(
                done.iter()
                    .map(|run| runs::row(case.clone(), run, |row, value| readout(runs::accuracy(row, value), value))),
            );
        }
        Ok((commands.join("\n    "), rows))
    })
}

/// The estimate of a readout time that the camera does not tell.
fn estimate(readout_ms: u32, seed: u32) -> Job {
    Job::new(format!("estimate of {readout_ms} ms, seed {seed}"), move |setup| {
        let mut options = SIZE.map(|(key, value)| (key, value.to_owned())).to_vec();
        options.extend([("frames", setup.pick(150, 60).to_string()), ("seed", (100 + seed).to_string())]);
        options.extend([("people", "0".to_owned()), ("readout", readout_ms.to_string())]);
        options.push(("unknown_readout", "on".to_owned()));
        let (command, done) = runs::methods(setup, &runs::world(ESTIMATED.0, &options), &["none"], &[])?;
        let case = Row::new().case("true_ms", readout_ms).case("seed", seed);
        Ok((command, done.iter().map(|run| runs::row(case.clone(), run, readout)).collect()))
    })
}

/// The readout time that a run reports.
fn readout(row: Row, run: &Value) -> Row {
    let certain = run.pointer("/readout/is_certain").and_then(Value::as_bool);
    row.figure("in_use_ms", runs::number(run, "/readout/in_use_ms"))
        .figure("estimate_ms", runs::number(run, "/readout/estimate_ms"))
        .figure("sigma_ms", runs::number(run, "/readout/sigma_ms"))
        .figure("certain", certain.map(f64::from))
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    Ok(format!(
        "The rows of a rolling shutter are read one after another. *Known*: the camera preset tells the readout time. *Estimated*: the camera \
         file does not, and the program estimates it while it runs. *Ignored*: no correction. Ground truth serves only to measure the errors.\n\n\
         ## Recordings\n\n\
         Five starts (frames 0, 5, …, 20 of the playing), median, least and greatest. *Live* are the poses as they were known at the time of \
         each frame.\n\n{}\n\
         ## Rendered worlds\n\n\
         400 × 300 px, 150 frames, a readout of {READOUT_MS} ms for colour and depth; ATE in metres, median of up to {SEEDS} worlds each. Without \
         people the method is `none`, with people `full`.\n\n{}\n\
         ## Estimates of the readout time\n\n\
         Rendered worlds of `{}` without people, 400 × 300 px, 150 frames, up to {} seeds for each readout time. The program uses an estimate only \
         where it is certain.\n\n{}",
        recordings_table(records),
        worlds_table(records),
        ESTIMATED.0,
        ESTIMATED.2,
        estimates_table(records)
    ))
}

fn recordings_table(records: &[&Record]) -> Table {
    let mut table = Table::new([
        "recording",
        "method",
        "direction",
        "readout",
        "ATE, m",
        "ATE live, m",
        "live / final",
        "RPE per frame, m",
        "RPE per frame, °",
        "readout in use, ms",
    ]);
    let records: Vec<&Record> = records.iter().filter(|record| !record.case("sequence").is_empty()).copied().collect();
    for sequence in values(&records, "sequence") {
        let of_sequence = select(&records, &[("sequence", sequence)]);
        for method in values(&of_sequence, "method") {
            for direction in values(&of_sequence, "direction") {
                for source in values(&of_sequence, "readout") {
                    let case = [("method", method), ("direction", direction), ("readout", source)];
                    let rows = select(&of_sequence, &case);
                    let spread = |key: &str| Spread::of(rows.iter().map(|record| record.figure(key)));
                    let [last, live] = ["ate_m", "ate_live_m"].map(|key| spread(key).map(|spread| spread.median));
                    table.row([
                        sequence.to_owned(),
                        method.to_owned(),
                        direction.to_owned(),
                        source.to_owned(),
                        Spread::text(spread("ate_m"), 4),
                        Spread::text(spread("ate_live_m"), 4),
                        number(live.zip(last).map(|(live, last)| live / last), 2),
                        Spread::middle(spread("rpe_frame_m"), 4),
                        Spread::middle(spread("rpe_frame_deg"), 3),
                        Spread::text(spread("in_use_ms"), 1),
                    ]);
                }
            }
        }
    }
    table
}

fn worlds_table(records: &[&Record]) -> Table {
    let columns = ["global"].into_iter().chain(SOURCES);
    let mut table = Table::new(["world", "people"].into_iter().chain(columns.clone()).chain(["known / global"]));
    let records: Vec<&Record> = records.iter().filter(|record| !record.case("world").is_empty()).copied().collect();
    for world in values(&records, "world") {
        for people in values(&records, "people") {
            let spread = |shutter: &str| {
                let rows = select(&records, &[("world", world), ("people", people), ("shutter", shutter)]);
                Spread::of(rows.iter().map(|record| record.figure("ate_m")))
            };
            let [global, known] = ["global", "known"].map(|shutter| spread(shutter).map(|spread| spread.median));
            let cells = columns.clone().map(|shutter| Spread::text(spread(shutter), 4));
            let ratio = number(known.zip(global).map(|(known, global)| known / global), 2);
            table.row([world.to_owned(), people.to_owned()].into_iter().chain(cells).chain([ratio]));
        }
    }
    table
}

fn estimates_table(records: &[&Record]) -> Table {
    let mut table = Table::new([
        "true readout, ms",
        "runs",
        "certain",
        "estimate where certain, ms",
        "error where certain, ms: RMS, largest",
        "in use, ms",
    ]);
    let records: Vec<&Record> = records.iter().filter(|record| !record.case("true_ms").is_empty()).copied().collect();
    for true_ms in values(&records, "true_ms") {
        let rows = select(&records, &[("true_ms", true_ms)]);
        let certain: Vec<f64> = rows
            .iter()
            .filter(|record| record.figure("certain") == Some(1.0))
            .filter_map(|record| record.figure("estimate_ms"))
            .collect();
        let truth: f64 = true_ms.parse().unwrap_or(f64::NAN);
        let squares: f64 = certain.iter().map(|estimate| (estimate - truth).powi(2)).sum();
        let largest = certain.iter().map(|estimate| (estimate - truth).abs()).max_by(f64::total_cmp);
        let rms = (!certain.is_empty()).then(|| (squares / certain.len() as f64).sqrt());
        table.row([
            true_ms.to_owned(),
            rows.len().to_string(),
            certain.len().to_string(),
            Spread::text(Spread::of(certain.iter().copied().map(Some)), 1),
            format!("{}, {}", number(rms, 2), number(largest, 2)),
            Spread::text(Spread::of(rows.iter().map(|record| record.figure("in_use_ms"))), 1),
        ]);
    }
    table
}
