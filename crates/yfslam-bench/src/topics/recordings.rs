//! Accuracy on recordings: every method, forward and backward, from ten starts.

use std::path::{Path, PathBuf};

use anyhow::Result;
use yfslam_eval::AlignmentKind;

use super::{Job, Setup, Topic, runs};
use crate::record::Record;
use crate::render::{Spread, Table, number, one_state, percent, select, values};
use crate::row::Row;
use crate::state::network_of_file;
use crate::trajectories::{Part, ate_m, frame_count, ground_truth};

/// The topic.
pub const TOPIC: Topic = Topic { name: "recordings", title: "Accuracy on recordings", minutes: 13, jobs, page };

/// The recordings of the data folder.
pub const RECORDINGS: [&str; 2] = ["tum_fr1_xyz_dev", "bonn_crowd_dev"];
const METHODS: [&str; 4] = ["none", "boxes", "yf", "full"];
/// The starts: every second frame from 0 to 18.
const STARTS: usize = 10;

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let mut jobs = Vec::new();
    let starts = setup.pick(STARTS, 1);
    for (name, folder) in setup.recordings(&RECORDINGS) {
        for backward in [false, true] {
            for start in (0..starts).map(|index| 2 * index) {
                let part = Part { start, frames: setup.quick.then_some(60), backward };
                jobs.push(job(name, &folder, part, &METHODS, None)?);
            }
        }
    }
    let official = setup.program.data.join("models/yolo-fastestv2-coco.onnx");
    if official.is_file() {
        for (name, folder) in setup.recordings(&RECORDINGS) {
            for backward in [false, true] {
                let part = Part { start: 0, frames: setup.quick.then_some(60), backward };
                jobs.push(job(name, &folder, part, &METHODS[1..], Some(&official))?);
            }
        }
    }
    Ok(jobs)
}

fn job(
    name: &str,
    folder: &Path,
    part: Part,
    methods: &'static [&'static str],
    network: Option<&PathBuf>,
) -> Result<Job> {
    let direction = if part.backward { "backward" } else { "forward" };
    let of_network = if network.is_some() { ", official weights" } else { "" };
    let title = format!("{name} {direction} from {}{of_network}", part.start);
    let (name, folder, file) = (name.to_owned(), folder.to_owned(), network.cloned());
    let mut job = Job::new(title, move |setup: &Setup| {
        let truth = runs::text(&folder.join("groundtruth.txt"))?;
        let detector = file.as_deref().map_or(Ok("embedded".to_owned()), runs::text)?;
        let mut options = vec!["--groundtruth".to_owned(), truth, "--detector".to_owned(), detector];
        options.extend(part.arguments(frame_count(&folder)?));
        let (command, done) = runs::methods(setup, &runs::text(&folder)?, methods, &options)?;
        let truth = ground_truth(&folder, part)?;
        let rows = done.iter().map(|run| {
            let case = Row::new().case("sequence", &name).case("direction", direction);
            let case = case.case("start", part.start).case("method", &run.method);
            runs::row(case, run, |row, value| {
                let [last, live] = ["trajectory.txt", "live.txt"].map(|file| run.folder.join(file));
                runs::accuracy(row, value)
                    .figure("ate_sim3_m", ate_m(&truth, &last, AlignmentKind::Sim3))
                    .figure("ate_live_m", ate_m(&truth, &live, AlignmentKind::Se3))
            })
        });
        Ok((command, rows.collect()))
    });
    job.network = network.map(|file| network_of_file(file)).transpose()?;
    Ok(job)
}

fn page(records: &[&Record]) -> Result<String> {
    let (official, embedded): (Vec<&Record>, Vec<&Record>) =
        records.iter().partition(|record| record.state.network.starts_with("official"));
    let mut text = "Every method on the first 300 pairs of TUM `freiburg1_xyz` and the first 600 of Bonn `rgbd_bonn_crowd`, played forward \
        and backward, each from ten starts (frames 0, 2, …, 18 of the playing). The figures are the median over the starts, with the \
        least and the greatest. ATE is the RMSE of the positions after alignment by SE(3) of all tracked frames with their final poses; \
        *live* is the same of the poses as they were known at the time of each frame; Sim(3) alignment also chooses the scale. \
        Poses are matched with the ground truth within 20 ms.\n\n"
        .to_owned();
    for sequence in values(&embedded, "sequence") {
        text += &format!("## {sequence}\n\n{}\n", table(&select(&embedded, &[("sequence", sequence)]))?);
    }
    text += "The relative pose errors on `bonn_crowd_dev` say little: its ground truth is the pose of a motion-capture marker beside the \
             camera, not of the camera.\n";
    if !official.is_empty() {
        text += "\n## With the official weights\n\n\
                 One start, with the COCO weights that the authors of YOLO-FastestV2 publish. They are not part of this project.\n\n";
        text += &official_table(&official)?;
    }
    Ok(text)
}

fn table(records: &[&Record]) -> Result<Table> {
    one_state(records.iter().copied())?;
    let mut table = Table::new([
        "method",
        "direction",
        "ATE, m",
        "ATE live, m",
        "ATE Sim(3), m",
        "tracked, least",
        "RPE per frame, m",
        "RPE per frame, °",
        "RPE per second, m",
        "RPE per second, °",
        "path length, estimated / true",
        "runs, failed",
    ]);
    for method in values(records, "method") {
        for direction in values(records, "direction") {
            let rows = select(records, &[("method", method), ("direction", direction)]);
            let spread = |key: &str| Spread::of(rows.iter().map(|record| record.figure(key)));
            let failed = rows.iter().filter(|record| record.text("failure").is_some()).count();
            table.row([
                method.to_owned(),
                direction.to_owned(),
                Spread::text(spread("ate_m"), 4),
                Spread::middle(spread("ate_live_m"), 4),
                Spread::middle(spread("ate_sim3_m"), 4),
                percent(spread("tracked").map(|spread| spread.min), 1),
                Spread::middle(spread("rpe_frame_m"), 4),
                Spread::middle(spread("rpe_frame_deg"), 2),
                Spread::middle(spread("rpe_second_m"), 4),
                Spread::middle(spread("rpe_second_deg"), 2),
                Spread::middle(spread("path_ratio"), 3),
                format!("{}, {failed}", rows.len()),
            ]);
        }
    }
    Ok(table)
}

fn official_table(records: &[&Record]) -> Result<String> {
    let state = one_state(records.iter().copied())?;
    let mut table = Table::new(["sequence", "direction", "method", "ATE, m", "tracked"]);
    for record in records {
        let cells = ["sequence", "direction", "method"].map(|key| record.case(key).to_owned());
        let figures = [number(record.figure("ate_m"), 4), percent(record.figure("tracked"), 1)];
        table.row(cells.into_iter().chain(figures));
    }
    Ok(state.map_or_else(String::new, |state| format!("Measured on {state}.\n\n")) + &table.to_string())
}
