//! A single camera: five seeds of the start of the map.

use anyhow::Result;

use super::recordings::RECORDINGS;
use super::{Job, Setup, Topic, runs};
use crate::record::Record;
use crate::render::{Spread, Table, one_state, select, values};
use crate::row::Row;
use crate::trajectories::{Part, frame_count};

/// The topic.
pub const TOPIC: Topic = Topic { name: "monocular", title: "A single camera", minutes: 5, jobs, page };

const SEEDS: usize = 5;

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let mut jobs = Vec::new();
    for (name, folder) in setup.recordings(&RECORDINGS) {
        for seed in 0..setup.pick(SEEDS, 1) {
            let (name, folder) = (name.to_owned(), folder.clone());
            jobs.push(Job::new(format!("{name}, seed {seed}"), move |setup| {
                let part = Part { start: 0, frames: setup.quick.then_some(180), backward: false };
                let words =
                    ["--sensor", "mono", "--seed", &seed.to_string(), "--detector", "embedded", "--groundtruth"];
                let mut options: Vec<String> = words.map(str::to_owned).to_vec();
                options.push(runs::text(&folder.join("groundtruth.txt"))?);
                options.extend(part.arguments(frame_count(&folder)?));
                let (command, done) = runs::methods(setup, &runs::text(&folder)?, &["full"], &options)?;
                let case = |method: &str| Row::new().case("sequence", &name).case("method", method).case("seed", seed);
                Ok((command, done.iter().map(|run| runs::row(case(&run.method), run, runs::accuracy)).collect()))
            }));
        }
    }
    Ok(jobs)
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    let mut table = Table::new(["sequence", "method", "ATE by Sim(3), m", "frames tracked", "frames", "seeds, failed"]);
    for sequence in values(records, "sequence") {
        let rows = select(records, &[("sequence", sequence)]);
        let spread = |key: &str| Spread::of(rows.iter().map(|record| record.figure(key)));
        let failed = rows.iter().filter(|record| record.text("failure").is_some()).count();
        table.row([
            sequence.to_owned(),
            values(&rows, "method").join(", "),
            Spread::text(spread("ate_m"), 4),
            Spread::text(spread("frames_tracked"), 0),
            Spread::middle(spread("frames_read"), 0),
            format!("{}, {failed}", rows.len()),
        ]);
    }
    Ok(format!(
        "Colour images alone (`--sensor mono`). A single camera does not know the scale, so errors are those after alignment by Sim(3) and \
         cannot be compared with those of cameras that measure depth. Frames that are not tracked come before the map begins, or while \
         people hide the room. Median over the seeds of the start, with the least and the greatest.\n\n{table}"
    ))
}
