//! Faults of cameras and drivers, put into a world with people and into recordings: what the program says, and what it is worth afterwards.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;
use yfslam_eval::{AlignmentKind, StampedPose};
use yfslam_io::{FaultKind, TrajectoryFile, write_trajectory};
use yfslam_synth::World;

use super::recordings::RECORDINGS;
use super::{Job, Setup, Topic, runs};
use crate::record::Record;
use crate::render::{Table, number, one_state, select, values};
use crate::row::Row;
use crate::trajectories::{Part, ate_m, ground_truth};

/// The topic.
pub const TOPIC: Topic = Topic { name: "faults", title: "Faults", minutes: 12, jobs, page };

const WORLD: &str = "walking_xyz?people=2&width=320&height=240&frames=150";
/// Begin and duration of each fault, s.
const WHEN_S: [f64; 2] = [2.0, 1.0];
/// Frames of a recording.
const FRAMES: usize = 210;
const NS: f64 = 1e9;
/// An error is that of the fault if it is larger than without fault by this factor and by this length, m.
const WORSE: (f64, f64) = (2.0, 0.03);

/// What is expected while a fault lasts.
fn expected(kind: FaultKind) -> &'static str {
    match kind {
        FaultKind::Dropped => "a gap in time; tracked afterwards",
        FaultKind::Repeated | FaultKind::Late => "frames whose stamp is not later are refused",
        FaultKind::Blank | FaultKind::Black => "lost; recognised afterwards",
        FaultKind::Frozen => "the same image again; recognised afterwards",
        FaultKind::DepthDropout | FaultKind::Covered | FaultKind::NanStamp => "frames are skipped",
        FaultKind::WrongSize => "frames are refused",
        FaultKind::ClockAhead => "a gap in time; frames are refused until the clock is there again",
        FaultKind::ClockBehind => "frames are refused",
        FaultKind::DepthNoise => "depth that is noise",
        FaultKind::DepthScale => "lost, or depth that contradicts the images",
        FaultKind::DepthSaturated => "saturated depth",
        FaultKind::DepthLate => "tracked",
        FaultKind::FalseBoxes | FaultKind::NoBoxes => "tracked",
        FaultKind::OverExposed | FaultKind::Blurred | FaultKind::Flicker | FaultKind::Dirt | FaultKind::IrPattern => {
            "tracked, or lost and recognised afterwards"
        }
    }
}

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let kinds = &FaultKind::ALL[..setup.pick(FaultKind::ALL.len(), 3)];
    let mut jobs = Vec::new();
    let mut sequences: Vec<(String, PathBuf)> = vec![("walking_xyz".to_owned(), PathBuf::new())];
    if !setup.quick {
        let recordings = setup.recordings(&RECORDINGS).into_iter();
        sequences.extend(recordings.map(|(name, folder)| (name.to_owned(), folder)));
    }
    for (name, folder) in sequences {
        let (shown, folder_of_base) = (name.clone(), folder.clone());
        jobs.push(Job::new(format!("{name}: no fault"), move |setup| measure(setup, &shown, &folder_of_base, None)));
        for (fault, kind, _) in kinds {
            let (name, folder) = (name.clone(), folder.clone());
            jobs.push(Job::new(format!("{name}: {fault}"), move |setup| {
                measure(setup, &name, &folder, Some((*fault, *kind)))
            }));
        }
    }
    Ok(jobs)
}

/// Tracks a sequence with a fault, or without.
fn measure(
    setup: &Setup,
    name: &str,
    folder: &Path,
    fault: Option<(&'static str, FaultKind)>,
) -> Result<(String, Vec<Row>)> {
    let is_world = folder.as_os_str().is_empty();
    let sequence = if is_world { format!("synth:{WORLD}") } else { runs::text(folder)? };
    let mut options = Vec::new();
    if !is_world {
        let preset = if name.starts_with("tum") { "tum1" } else { "bonn" };
        options.extend(["--camera".to_owned(), preset.to_owned(), "--end".to_owned(), FRAMES.to_string()]);
    }
    let [begin_s, duration_s] = WHEN_S;
    if let Some((fault, _)) = fault {
        options.extend(["--fault".to_owned(), format!("{fault}@{begin_s}+{duration_s}")]);
    }
    let (command, runs) = runs::methods(setup, &sequence, &["full"], &options)?;
    let run = runs.first().context("no run")?;
    let case = Row::new().case("sequence", name).case("fault", fault.map_or("none", |(fault, _)| fault));
    let case = case.figure("expected", fault.map_or("tracked", |(_, kind)| expected(kind)));
    let truth = if is_world {
        truth_of_world()?
    } else {
        ground_truth(folder, Part { start: 0, frames: Some(FRAMES), backward: false })?
    };
    let row = runs::row(case, run, |row, value| {
        let first_ns = first_ns(&run.folder, &truth);
        let end_ns = first_ns + ((begin_s + duration_s) * NS) as i64;
        figures(row, value, &run.folder, &truth, end_ns)
    });
    Ok((command, vec![row]))
}

/// The time of the first frame: that of the first pose, which the first frame has in all sequences.
fn first_ns(folder: &Path, truth: &[StampedPose]) -> i64 {
    let live = TrajectoryFile::read(&folder.join("live.txt")).map(|file| file.poses).unwrap_or_default();
    live.first().or(truth.first()).map_or(0, |pose| pose.timestamp_ns)
}

fn truth_of_world() -> Result<Vec<StampedPose>> {
    let world = World::new(&yfslam_synth::parse(WORLD)?)?;
    Ok((0..world.len()).map(|index| StampedPose::new(world.timestamp_ns(index), world.pose(index))).collect())
}

fn figures(row: Row, run: &Value, folder: &Path, truth: &[StampedPose], end_ns: i64) -> Row {
    let signs: Vec<String> = run["health"]
        .as_object()
        .into_iter()
        .flatten()
        .filter_map(|(sign, value)| {
            let frames = value["frames"].as_u64().filter(|frames| *frames > 0)?;
            Some(format!("{} {frames}", sign.replace('_', " ")))
        })
        .collect();
    let live = TrajectoryFile::read(&folder.join("live.txt")).map(|file| file.poses).unwrap_or_default();
    let after: Vec<StampedPose> = live.into_iter().filter(|pose| pose.timestamp_ns >= end_ns).collect();
    let interval_s = 1.0 / 30.0;
    let recovered = after.first().map(|pose| ((pose.timestamp_ns - end_ns) as f64 / NS / interval_s).round());
    let file = folder.join("after.txt");
    let after_m = write_trajectory(&file, &after).ok().and_then(|()| ate_m(truth, &file, AlignmentKind::Se3));
    row.figure("lost", runs::number(run, "/frames/lost"))
        .figure("skipped", runs::number(run, "/frames/skipped"))
        .figure("signs", signs.join(", "))
        .figure("recovered_frames", recovered)
        .figure("after_m", after_m)
        .figure("ate_m", runs::number(run, "/evaluation/ate/translation_m/rmse"))
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    let mut text = format!(
        "Method `full`, each fault from {} s on for {} s. *Signs*: the checks of `health` in run.json, with the number of frames. *Recovered*: frames \
         of 30 Hz from the end of the fault to the next pose. *After*: ATE of the poses after the fault, aligned for themselves. *Said*: `right` if the ATE \
         of the whole run is at most {} times and {} m above that without fault; else `yes` if signs, lost or skipped frames, more of them than \
         without fault, say that something was wrong, and **no** if nothing does: a silent wrong answer.\n",
        WHEN_S[0], WHEN_S[1], WORSE.0, WORSE.1
    );
    for sequence in values(records, "sequence") {
        let of_sequence = select(records, &[("sequence", sequence)]);
        let base = select(&of_sequence, &[("fault", "none")]).first().copied();
        let mut table = Table::new([
            "fault",
            "expected",
            "lost",
            "skipped",
            "signs",
            "recovered after",
            "after, m",
            "ATE, m",
            "said",
        ]);
        for record in of_sequence {
            table.row([
                record.case("fault").to_owned(),
                record.text("expected").unwrap_or_default().to_owned(),
                number(record.figure("lost"), 0),
                number(record.figure("skipped"), 0),
                record.text("signs").filter(|signs| !signs.is_empty()).unwrap_or("–").to_owned(),
                number(record.figure("recovered_frames"), 0),
                number(record.figure("after_m"), 4),
                number(record.figure("ate_m"), 4),
                said(record, base).to_owned(),
            ]);
        }
        text += &format!("\n## `{sequence}`\n\n{table}");
    }
    Ok(text)
}

/// Whether the result is right or, if it is not, something says so that the run without fault does not say as well.
fn said(record: &Record, base: Option<&Record>) -> &'static str {
    let base_m = base.and_then(|base| base.figure("ate_m"));
    let is_right = |ate_m: f64| base_m.is_some_and(|base| ate_m <= (WORSE.0 * base).max(base + WORSE.1));
    let more = |frames: Option<f64>, of_base: Option<f64>| frames.unwrap_or(0.0) > of_base.unwrap_or(0.0);
    let frames = |name: &str| more(record.figure(name), base.and_then(|base| base.figure(name)));
    let of_base = signs(base);
    let sign = |(name, frames): (&str, f64)| {
        let usual = of_base.iter().find(|(other, _)| *other == name).map(|(_, frames)| *frames);
        more(Some(frames), usual)
    };
    let is_noticed = frames("lost") || frames("skipped") || signs(Some(record)).into_iter().any(sign);
    match record.figure("ate_m") {
        Some(ate_m) if is_right(ate_m) => "right",
        _ if is_noticed || record.text("failure").is_some() => "yes",
        _ => "**no**",
    }
}

/// The signs of a run with the number of frames of each, as [`figures`] writes them: `stands still 1, time gap 2`.
fn signs(record: Option<&Record>) -> Vec<(&str, f64)> {
    let signs = record.and_then(|record| record.text("signs")).unwrap_or_default();
    signs
        .split(", ")
        .filter_map(|sign| sign.rsplit_once(' '))
        .map(|(name, n)| (name, n.parse().unwrap_or(0.0)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(ate_m: f64, signs: &str, lost: f64) -> Record {
        let row = Row::new().figure("ate_m", Some(ate_m)).figure("signs", signs).figure("lost", Some(lost));
        let machine = crate::record::Machine { cpu: String::new(), cores: 1, simd: String::new() };
        let state = crate::record::State { commit: String::new(), network: String::new(), machine };
        Record::new(state, "job", false, String::new(), row)
    }

    #[test]
    fn what_the_run_without_fault_says_as_well_is_no_sign_of_the_fault() {
        let base = record(0.01, "stands still 1", 2.0);
        let said = |ate_m: f64, signs: &str, lost: f64| said(&record(ate_m, signs, lost), Some(&base));
        assert_eq!(said(0.02, "", 0.0), "right");
        assert_eq!(said(0.5, "stands still 1", 2.0), "**no**");
        assert_eq!(said(0.5, "stands still 2", 2.0), "yes");
        assert_eq!(said(0.5, "stands still 1, time gap 1", 2.0), "yes");
        assert_eq!(said(0.5, "", 3.0), "yes");
    }
}
