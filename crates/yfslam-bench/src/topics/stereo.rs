//! Rendered stereo pairs beside the depth camera in the same worlds.

use anyhow::Result;

use super::{Job, Setup, Topic, runs};
use crate::record::Record;
use crate::render::{Table, number, one_state, percent, select, values};
use crate::row::Row;

/// The topic.
pub const TOPIC: Topic = Topic { name: "stereo", title: "Stereo", minutes: 3, jobs, page };

const METHODS: [&str; 4] = ["none", "boxes", "yf", "full"];
const WORLDS: [&str; 3] = ["walking_xyz", "walking_halfsphere", "sitting_xyz"];
/// Name of the camera and its baseline, m.
const CAMERAS: [(&str, Option<&str>); 3] =
    [("RGB-D", None), ("stereo, 0.11 m", Some("0.11")), ("stereo, 0.2 m", Some("0.2"))];

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let mut jobs = Vec::new();
    for world in &WORLDS[..setup.pick(WORLDS.len(), 1)] {
        for (camera, baseline) in CAMERAS {
            jobs.push(Job::new(format!("{world}, {camera}"), move |setup| {
                let mut options = vec![("frames", setup.pick(150, 60).to_string())];
                options.extend(baseline.map(|baseline| ("stereo", baseline.to_owned())));
                let (command, done) = runs::methods(setup, &runs::world(world, &options), &METHODS, &[])?;
                let case = |method: &str| Row::new().case("world", world).case("camera", camera).case("method", method);
                Ok((command, done.iter().map(|run| runs::row(case(&run.method), run, runs::accuracy)).collect()))
            }));
        }
    }
    Ok(jobs)
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    let mut table = Table::new(["world", "camera"].into_iter().chain(METHODS).chain(["tracked, least"]));
    for world in values(records, "world") {
        for camera in values(records, "camera") {
            let rows = select(records, &[("world", world), ("camera", camera)]);
            let ate = METHODS.map(|method| {
                number(select(&rows, &[("method", method)]).first().and_then(|record| record.figure("ate_m")), 4)
            });
            let least = rows.iter().filter_map(|record| record.figure("tracked")).min_by(f64::total_cmp);
            table.row([world.to_owned(), camera.to_owned()].into_iter().chain(ate).chain([percent(least, 1)]));
        }
    }
    Ok(format!(
        "Rendered pairs of 640 × 480 px beside the structured-light camera in the same worlds, 150 frames, boxes from the renderer; ATE in \
         metres of each method, one run each.\n\n{table}"
    ))
}
