//! What a frame costs on a small board, in instructions: the aarch64 program in qemu, with a plugin that counts. The count is the same
//! on every machine and at every load. `tools/instructions.sh` builds both and measures the topic.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::recordings::RECORDINGS;
use super::{Job, Setup, Topic, runs};
use crate::program::Program;
use crate::record::Record;
use crate::render::{Table, number, one_state, select, values};
use crate::row::Row;

/// The topic.
pub const TOPIC: Topic = Topic { name: "instructions", title: "Instructions on aarch64", minutes: 4, jobs, page };

/// Environment variables with the program and the plugin.
const PROGRAM: &str = "YFSLAM_AARCH64";
const PLUGIN: &str = "YFSLAM_COUNT_PLUGIN";
/// Frames of the two runs; their difference is counted, so that the start does not.
const FRAMES: [usize; 2] = [60, 120];

/// What is counted: name, method, detector.
const CASES: [(&str, &str, &str); 3] = [
    ("`none`", "none", "none"),
    ("`full` without detector", "full", "none"),
    ("`full` with the embedded network", "full", "embedded"),
];

fn jobs(setup: &Setup) -> Result<Vec<Job>> {
    let (Some(program), Some(plugin)) = (std::env::var_os(PROGRAM), std::env::var_os(PLUGIN)) else {
        return Ok(Vec::new());
    };
    let (program, plugin) = (PathBuf::from(program), PathBuf::from(plugin));
    let mut jobs = Vec::new();
    for (name, folder) in setup.recordings(&RECORDINGS) {
        for (case, method, detector) in CASES {
            let (name, folder, program, plugin) = (name.to_owned(), folder.clone(), program.clone(), plugin.clone());
            jobs.push(Job::new(format!("{name}, {case}"), move |setup| {
                let frames = setup.pick(FRAMES, [2, 4]);
                let mut counts = [0.0; 2];
                let mut command = String::new();
                for (count, end) in counts.iter_mut().zip(frames) {
                    let end = end.to_string();
                    let out = runs::text(&setup.program.out.join("run"))?;
                    let sequence = runs::text(&folder)?;
                    let words = [
                        "run",
                        &sequence,
                        "--method",
                        method,
                        "--detector",
                        detector,
                        "--end",
                        &end,
                        "--quiet",
                        "--out",
                        &out,
                    ]
                    .map(str::to_owned);
                    *count = instructions(setup, &program, &plugin, &words)?;
                    command = setup.program.command(&words);
                }
                let each = (counts[1] - counts[0]) / (frames[1] - frames[0]) as f64;
                let row = Row::new()
                    .case("sequence", &name)
                    .case("what", case)
                    .figure("million_instructions_per_frame", each * 1e-6);
                Ok((command, vec![row]))
            }));
        }
    }
    Ok(jobs)
}

/// Runs the aarch64 program in qemu and returns the number of its instructions.
fn instructions(setup: &Setup, program: &Path, plugin: &Path, words: &[String]) -> Result<f64> {
    let counted = setup.program.out.join("instructions.txt");
    let qemu = Program { path: "qemu-aarch64".into(), ..setup.program.clone() };
    let plugin = format!("{},out={}", runs::text(plugin)?, runs::text(&counted)?);
    let arguments = [vec!["-plugin".to_owned(), plugin, runs::text(program)?], words.to_vec()].concat();
    qemu.run(&arguments)?;
    let text = std::fs::read_to_string(&counted).with_context(|| format!("cannot read {}", counted.display()))?;
    text.trim().parse().with_context(|| format!("no number in {}", counted.display()))
}

fn page(records: &[&Record]) -> Result<String> {
    one_state(records.iter().copied())?;
    let mut table = Table::new(["sequence", "what", "million instructions a frame"]);
    for sequence in values(records, "sequence") {
        for what in values(records, "what") {
            let rows = select(records, &[("sequence", sequence), ("what", what)]);
            let figure = rows.first().and_then(|record| record.figure("million_instructions_per_frame"));
            table.row([sequence.to_owned(), what.to_owned(), number(figure, 1)]);
        }
    }
    let [first, last] = FRAMES;
    Ok(format!(
        "Instructions of the static aarch64 program, all threads, decoding included, from frame {first} to frame {last} of each recording, \
         divided by the frames: counted by a plugin of qemu, so that they are the same at every load. NEON instructions count as one each. \
         `tools/instructions.sh` measures them.\n\n{table}"
    ))
}
