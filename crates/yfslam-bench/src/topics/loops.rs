//! Loop closing, relocalisation and place recognition on a small set of sequences.

use anyhow::Result;

use super::recordings::RECORDINGS;
use super::{Job, Setup, Topic};
use crate::places::{Arguments, Experiment, measure};
use crate::record::Record;
use crate::render::{Table, number, one_state, percent, select};
use crate::row::Row;

/// The topic.
pub const TOPIC: Topic = Topic { name: "loops", title: "Loops and relocalisation", minutes: 6, jobs, page };

/// Once around a corridor without people, and a drive around it several times.
const ROUND: &str = "corridor_loop?people=0&width=320&height=240&frames=1330";
const DRIVE: &str = "corridor_loop?people=0&width=320&height=240&frames=2700&fps=10&motion=drive";
const OFFICE: &str = "walking_xyz?frames=150";

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let recordings: Vec<String> =
        setup.recordings(&RECORDINGS).into_iter().map(|(_, folder)| folder.to_string_lossy().into_owned()).collect();
    let short = |spec: &str| setup.pick(spec.to_owned(), "walking_xyz?width=320&height=240&frames=45".to_owned());
    let mut jobs = Vec::new();
    let mut add = |name: &'static str, experiment: Experiment, sequences: Vec<String>| {
        for sequence in &sequences {
            let (sequences, experiment) = (vec![sequence.clone()], experiment.clone());
            let arguments = Arguments { experiment, sequences, detector: None, config: None };
            let shown = sequence.rsplit('/').next().unwrap_or(sequence).to_owned();
            jobs.push(Job::new(format!("{name}: {shown}"), move |_| {
                let rows = measure(&arguments)?.into_iter();
                // The figures of single trials are few; those over all trials of a sequence are in its last row.
                let rows =
                    rows.map(|row| Row { case: [vec![("experiment", name.to_owned())], row.case].concat(), ..row });
                Ok((format!("yfslam-bench places {name} '{shown}'"), rows.collect()))
            }));
        }
    };
    let everywhere =
        |spec: &str| [vec![short(spec)], if setup.quick { Vec::new() } else { recordings.clone() }].concat();
    add("loops", Experiment::Loops, everywhere(ROUND));
    add("false-positives", Experiment::FalsePositives { mapped: 0.45 }, vec![short(ROUND)]);
    add("recall", Experiment::Recall { mapped: 0.3 }, everywhere(DRIVE));
    let count = setup.pick(12, 3);
    add("relocalisation", Experiment::Relocalisation { count, seed: 0 }, everywhere(OFFICE));
    Ok(jobs)
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    let of = |experiment: &str| select(records, &[("experiment", experiment)]);
    Ok(format!(
        "## Loops\n\n\
         Sequences played forward, and forward then backward, with and without loop closing. A loop is false if the motion measured between its \
         ends is off the truth by more than 0.3 m or 10°. In the recordings the camera never leaves what it sees, so there is no loop to close.\n\n{}\n\
         ## Places that are not in the map\n\n\
         The first 45 % are mapped, then every fourth frame of the whole is relocalised, each for itself. Most later frames show places that \
         the map does not have.\n\n{}\n\
         ## Place recognition\n\n\
         The first 30 % are mapped; every fourth later frame that shows a mapped place (a keyframe within 1.5 m and 30°) is a query, by appearance \
         alone, without the geometric check that follows. The bag of words is trained on the very map. *Right*: the best candidate shows the \
         place. *Recall without an error*: the share of queries whose best candidate is right and scores higher than every wrong one.\n\n{}\n\
         ## Relocalisation\n\n\
         The sequence is mapped. A camera begins in the map at a random moment, is tracked for ten frames, covered for 1, 5 or 20 s while it moves \
         on, and uncovered. A pose is wrong if it is off by more than 0.3 m or 10°, or given while the camera is covered.\n\n{}",
        loops(&of("loops")),
        false_positives(&of("false-positives")),
        recall(&of("recall")),
        relocalisation(&of("relocalisation"))
    ))
}

fn loops(records: &[&Record]) -> Table {
    let mut table = Table::new([
        "sequence",
        "played",
        "tracked",
        "ATE without, m",
        "ATE, m",
        "loops",
        "drift taken away, m",
        "worst loop, m / °",
        "false loops",
    ]);
    for record in records {
        let figure = |key: &str, decimals| number(record.figure(key), decimals);
        let worst = record
            .figure("worst_loop_m")
            .map_or("–".to_owned(), |_| format!("{} / {}", figure("worst_loop_m", 3), figure("worst_loop_deg", 2)));
        table.row([
            format!("`{}`", record.case("sequence")),
            record.case("played").to_owned(),
            percent(record.figure("tracked"), 1),
            figure("ate_without_m", 4),
            figure("ate_m", 4),
            figure("loops", 0),
            record.text("drift_m").filter(|text| !text.is_empty()).unwrap_or("–").to_owned(),
            worst,
            figure("false_loops", 0),
        ]);
    }
    table
}

fn false_positives(records: &[&Record]) -> Table {
    let headers = ["sequence", "mapped frames: tried, right, wrong", "later frames: tried, right, wrong"];
    let mut table = Table::new(headers);
    for record in records {
        let three = |part: &str| {
            ["tried", "right", "wrong"].map(|key| number(record.figure(&format!("{part}_{key}")), 0)).join(", ")
        };
        table.row([format!("`{}`", record.case("sequence")), three("mapped"), three("later")]);
    }
    table
}

fn recall(records: &[&Record]) -> Table {
    let mut table = Table::new([
        "sequence",
        "recogniser",
        "keyframes",
        "queries",
        "right",
        "recall without an error",
        "ms a query",
    ]);
    for record in records {
        table.row([
            format!("`{}`", record.case("sequence")),
            record.case("recogniser").to_owned(),
            number(record.figure("keyframes"), 0),
            number(record.figure("queries"), 0),
            percent(record.figure("right"), 1),
            percent(record.figure("recall_without_error"), 1),
            number(record.figure("ms_per_query"), 2),
        ]);
    }
    table
}

fn relocalisation(records: &[&Record]) -> Table {
    let mut table = Table::new([
        "sequence",
        "covered, s",
        "trials",
        "within 10 frames",
        "frames, median / worst",
        "never",
        "with a wrong pose",
        "slowest frame, ms",
    ]);
    for record in records.iter().filter(|record| record.case("sequence") != "all") {
        let figure = |key: &str| number(record.figure(key), 0);
        table.row([
            format!("`{}`", record.case("sequence")),
            record.case("covered_s").to_owned(),
            figure("trials"),
            figure("within_10_frames"),
            format!("{} / {}", figure("frames_median"), figure("frames_worst")),
            figure("never"),
            figure("wrong_poses"),
            figure("slowest_frame_ms"),
        ]);
    }
    table
}
