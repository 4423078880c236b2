//! Dense maps: of rendered worlds against the exact world, and of recordings with what they take.

use anyhow::Result;

use super::recordings::RECORDINGS;
use super::{Job, Setup, Topic, runs};
use crate::dense::{Arguments, measure};
use crate::record::Record;
use crate::render::{Table, number, one_state, percent, select};
use crate::row::Row;
use crate::trajectories::{Part, frame_count};

/// The topic.
pub const TOPIC: Topic = Topic { name: "dense", title: "Dense maps", minutes: 5, jobs, page };

const METHODS: [&str; 3] = ["none", "yf", "full"];
const WORLDS: [&str; 3] = ["walking_xyz", "pushed_chair", "crowd"];
const RESOLUTION_M: f32 = 0.05;

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let mut jobs = Vec::new();
    for world in &WORLDS[..setup.pick(WORLDS.len(), 1)] {
        jobs.push(Job::new(*world, move |setup| {
            let spec = format!("{world}?frames={}", setup.pick(240, 45));
            let methods = METHODS.map(str::to_owned).to_vec();
            let command = format!("yfslam-bench dense '{spec}' --methods {}", methods.join(","));
            let arguments =
                Arguments { worlds: vec![spec], methods, no_loops: false, max_range: 4.0, resolution: RESOLUTION_M };
            Ok((command, measure(&arguments)?))
        }));
    }
    for (name, folder) in setup.recordings(&RECORDINGS) {
        let (name, folder) = (name.to_owned(), folder.clone());
        jobs.push(Job::new(name.clone(), move |setup| {
            let part = Part { start: 0, frames: setup.quick.then_some(60), backward: false };
            let mut options = ["--dense", "--detector", "embedded"].map(str::to_owned).to_vec();
            options.extend(part.arguments(frame_count(&folder)?));
            let (command, done) = runs::methods(setup, &runs::text(&folder)?, &METHODS, &options)?;
            let rows = done.iter().map(|run| recording_row(setup, &name, run)).collect::<Result<_>>()?;
            Ok((command + "; yfslam map OUT/run/METHOD", rows))
        }));
    }
    Ok(jobs)
}

/// The dense map of a run of a recording, and the products that `yfslam map` makes of it.
fn recording_row(setup: &Setup, name: &str, run: &runs::MethodRun) -> Result<Row> {
    let case = Row::new().case("recording", name).case("method", &run.method);
    let Ok(value) = &run.result else { return Ok(runs::row(case, run, |row, _| row)) };
    let products = setup.program.out.join("products");
    let _ = std::fs::remove_dir_all(&products);
    let words =
        ["map", &runs::text(&run.folder)?, "--resolution", &RESOLUTION_M.to_string(), "--out", &runs::text(&products)?];
    let (text, processor_s) = setup.program.run(&words.map(str::to_owned))?;
    let size_mb = |path: &std::path::Path| std::fs::metadata(path).ok().map(|data| data.len() as f64 * 1e-6);
    let cell = |keys: &[&str]| keys.iter().find_map(|key| runs::number(value, key));
    Ok(case
        .figure("keyframe_patches", cell(&["/dense/keyframes", "/dense/patches"]))
        .figure("ms_per_keyframe", cell(&["/dense/cpu_ms_per_keyframe"]))
        .figure("memory_mb", cell(&["/dense/pieces_mb", "/dense/patches_mb"]))
        .figure("file_mb", size_mb(&run.folder.join("dense.map")))
        .figure("occupied", occupied(&text))
        .figure("products_s", processor_s)
        .figure("mesh_mb", size_mb(&products.join("mesh.ply")))
        .figure("octomap_mb", size_mb(&products.join("octomap.bt"))))
}

/// The number of occupied voxels in the output of `yfslam map`.
fn occupied(text: &str) -> Option<u64> {
    let line = text.lines().find(|line| line.starts_with("occupancy"))?;
    line.split(|c: char| !c.is_ascii_digit()).find(|word| !word.is_empty())?.parse().ok()
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    let (recordings, worlds): (Vec<&Record>, Vec<&Record>) =
        records.iter().partition(|r| !r.case("recording").is_empty());
    let mut exact = Table::new([
        "world",
        "method",
        "precision",
        "recall",
        "ghosts",
        "voxels by those of exact poses",
        "wall thickness (with exact poses), mm",
        "filled",
        "fillable",
        "valid",
        "PSNR, dB",
        "PSNR of what was filled, dB",
    ]);
    for record in worlds {
        let figure = |key: &str| record.figure(key);
        // Without a filter nothing is removed, so there is nothing to fill.
        let filling = |cell: String| if record.case("method") == "none" { "–".to_owned() } else { cell };
        let [thick, thick_exact] = ["wall_thickness_mm", "wall_thickness_exact_mm"].map(|key| number(figure(key), 1));
        exact.row([
            record.case("world").to_owned(),
            record.case("method").to_owned(),
            number(figure("precision"), 3),
            number(figure("recall"), 3),
            percent(figure("ghosts"), 3),
            number(figure("of_exact_poses"), 2),
            format!("{thick} ({thick_exact})"),
            filling(percent(figure("filled"), 0)),
            filling(percent(figure("fillable"), 0)),
            filling(percent(figure("valid"), 0)),
            filling(number(figure("psnr_db"), 1)),
            filling(number(figure("filled_psnr_db"), 1)),
        ]);
    }
    let mut cost = Table::new([
        "recording",
        "method",
        "keyframe patches",
        "occupied voxels",
        "processor time a keyframe patch, ms",
        "keyframe patches, MB",
        "`dense.map`, MB",
        "`yfslam map`: processor time, s",
        "`mesh.ply`, MB",
        "`octomap.bt`, MB",
    ]);
    let sequences = RECORDINGS.iter().flat_map(|name| select(&recordings, &[("recording", name)]));
    for record in sequences {
        let figure = |key: &str, decimals| number(record.figure(key), decimals);
        cost.row([
            record.case("recording").to_owned(),
            record.case("method").to_owned(),
            figure("keyframe_patches", 0),
            figure("occupied", 0),
            figure("ms_per_keyframe", 1),
            figure("memory_mb", 1),
            figure("file_mb", 1),
            figure("products_s", 1),
            figure("mesh_mb", 1),
            figure("octomap_mb", 2),
        ]);
    }
    let text = format!(
        "## Against the exact world\n\n\
         Eight seconds of rendered worlds at 640 × 480 px, boxes from the renderer, voxels of 5 cm. A voxel is right if an exact static surface \
         is within 5 cm of its centre. Recall is the share of the measured static surfaces, up to 4 m, that is occupied. Ghosts are occupied \
         voxels where something has moved through and nothing static is. More voxels than with the exact poses come from doubled walls. The views \
         without people are compared with the same world without people: *filled* is the share of the hidden pixels whose colour is known, \
         *fillable* the share that another keyframe has seen, *valid* the share of all pixels.\n\n{exact}\n\
         ## Recordings\n\n\
         Maps of the recordings with the embedded network, voxels of 5 cm, and all products of `yfslam map`.\n\n{cost}"
    );
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_voxels_is_read_from_the_output() {
        let text = "occupancy: 12584 voxels of 0.05 m occupied, 92907 free; 10.2 ms a keyframe\nfloor: 1.46 m\n";
        assert_eq!(occupied(text), Some(12_584));
        assert_eq!(occupied("floor: 1 m"), None);
    }
}
