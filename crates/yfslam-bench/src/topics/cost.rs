//! What a frame costs: the processor time of the whole process as the operating system counts it, and the parts that `run.json` tells.

use std::collections::BTreeMap;

use anyhow::Result;
use serde_json::Value;

use super::recordings::RECORDINGS;
use super::{Job, Setup, Topic, runs};
use crate::program::read_run;
use crate::record::Record;
use crate::render::{Spread, Table, number, one_state, select, values};
use crate::row::Row;
use crate::trajectories::{Part, frame_count};

/// The topic.
pub const TOPIC: Topic = Topic { name: "cost", title: "Processor time and memory", minutes: 3, jobs, page };

const METHODS: [&str; 2] = ["none", "full"];
const ROUNDS: usize = 3;

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let mut jobs = Vec::new();
    // Methods and recordings take turns, so that all of them see the same load.
    for round in 1..=setup.pick(ROUNDS, 1) {
        for (name, folder) in setup.recordings(&RECORDINGS) {
            for method in METHODS {
                let (name, folder) = (name.to_owned(), folder.clone());
                jobs.push(Job::new(format!("{name}, {method}, round {round}"), move |setup| {
                    let out = setup.program.out.join("run");
                    let part = Part { start: 0, frames: setup.quick.then_some(60), backward: false };
                    let words = [
                        "run",
                        &runs::text(&folder)?,
                        "--method",
                        method,
                        "--detector",
                        "embedded",
                        "--quiet",
                        "--out",
                    ];
                    let mut arguments: Vec<String> = words.map(str::to_owned).to_vec();
                    arguments.push(runs::text(&out)?);
                    arguments.extend(part.arguments(frame_count(&folder)?));
                    let (_, processor_s) = setup.program.run(&arguments)?;
                    let run = read_run(&out)?;
                    let frames = runs::number(&run, "/frames/read").unwrap_or_default().max(1.0);
                    let row = Row::new()
                        .case("sequence", &name)
                        .case("method", method)
                        .case("round", round)
                        .figure("process_ms_per_frame", 1e3 * processor_s / frames)
                        .figure("peak_mb", runs::number(&run, "/peak_memory_mb"))
                        .figure("wall_ms_per_frame", runs::number(&run, "/wall_s").map(|wall_s| 1e3 * wall_s / frames))
                        .figure("run_json_ms_per_frame", runs::number(&run, "/process_ms_per_frame"))
                        .figure("parts_ms_per_frame", parts(&run))
                        .figure("stages_median_ms", stages(&run));
                    Ok((setup.program.command(&arguments), vec![row]))
                }));
            }
        }
    }
    Ok(jobs)
}

/// Processor time of each part of the process for a frame, where `run.json` has it, ms.
fn parts(run: &Value) -> Value {
    run.pointer("/process_parts_ms_per_frame").filter(|parts| parts.is_object()).cloned().unwrap_or_default()
}

/// Median wall time of each stage, ms.
fn stages(run: &Value) -> Value {
    let stages = run.pointer("/times").and_then(Value::as_object).into_iter().flatten();
    let median = |(name, stage): (&String, &Value)| Some((name.clone(), stage.get("median_ms")?.clone()));
    Value::Object(stages.filter_map(median).collect())
}

/// The spread of each entry of a figure that is itself a table of figures.
fn nested(rows: &[&Record], key: &str) -> BTreeMap<String, Spread> {
    let mut found: BTreeMap<String, Vec<Option<f64>>> = BTreeMap::new();
    for entries in rows.iter().filter_map(|record| record.figures.get(key)?.as_object()) {
        for (name, value) in entries {
            found.entry(name.clone()).or_default().push(value.as_f64());
        }
    }
    found.into_iter().filter_map(|(name, values)| Some((name, Spread::of(values)?))).collect()
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    let mut whole = Table::new([
        "sequence",
        "method",
        "whole process, ms a frame",
        "over the frames, by `run.json`, ms a frame",
        "wall, ms a frame",
        "peak memory, MB",
    ]);
    for sequence in values(records, "sequence") {
        for method in values(records, "method") {
            let rows = select(records, &[("sequence", sequence), ("method", method)]);
            let spread = |key: &str| Spread::of(rows.iter().map(|record| record.figure(key)));
            whole.row([
                sequence.to_owned(),
                method.to_owned(),
                Spread::text(spread("process_ms_per_frame"), 1),
                Spread::middle(spread("run_json_ms_per_frame"), 1),
                Spread::middle(spread("wall_ms_per_frame"), 1),
                Spread::middle(spread("peak_mb"), 0),
            ]);
        }
    }
    let mut text = format!(
        "The processor time of the whole process, user and system, of all its threads, as the operating system accounts for it at the end of \
         the process, divided by the frames: start, decoding, detection, tracking, mapping, writing the results. Three runs of each, in turns; \
         median, least and greatest. Compare these figures only with others of the same machine.\n\n{whole}"
    );
    let parts = by_name(records, "parts_ms_per_frame", true);
    if !parts.is_empty() {
        text += &format!(
            "\n## Parts of the process\n\nProcessor time as `run.json` counts it, ms a frame. Start and end are what is missing from the whole process.\n\n{parts}"
        );
    }
    let stages = by_name(records, "stages_median_ms", false);
    Ok(text
        + &format!(
            "\n## Stages\n\nWall time as `run.json` tells it, ms; the median over the frames, or over the keyframes for mapping. Decoding runs on \
             other threads than the rest.\n\n{stages}"
        ))
}

/// A table with a row for each entry of a nested figure and a column for each sequence and method; with `rest`, also what is missing
/// from the whole process.
fn by_name(records: &[&Record], key: &str, rest: bool) -> Table {
    let mut columns = Vec::new();
    for sequence in values(records, "sequence") {
        for method in values(records, "method") {
            let rows = select(records, &[("sequence", sequence), ("method", method)]);
            let process = Spread::of(rows.iter().map(|record| record.figure("process_ms_per_frame")));
            columns.push((format!("{sequence}, {method}"), nested(&rows, key), process));
        }
    }
    let mut names: Vec<String> = columns.iter().flat_map(|(_, entries, _)| entries.keys().cloned()).collect();
    names.sort_unstable();
    names.dedup();
    let mut table = Table::new(["part"].into_iter().chain(columns.iter().map(|(title, ..)| title.as_str())));
    for name in &names {
        let cells = columns.iter().map(|(_, entries, _)| Spread::middle(entries.get(name).copied(), 2));
        table.row([name.clone()].into_iter().chain(cells));
    }
    if rest && !names.is_empty() {
        let cells = columns.iter().map(|(_, entries, process)| {
            let counted: f64 = entries.values().map(|spread| spread.median).sum();
            number(process.map(|process| process.median - counted), 2)
        });
        table.row(["start and end".to_owned()].into_iter().chain(cells));
    }
    table
}
