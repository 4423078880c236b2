//! `yfslam bench`: a table of accuracy over sequences, methods and seeds.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, Result};
use clap::{Args, value_parser};
use yfslam_io::write_atomically;

use crate::bench::{Bench, Group, csv, markdown};
use crate::output::OutputFolder;
use crate::progress::Progress;
use crate::terminal::Terminal;

const EXAMPLES: &str = "\
Examples:
  yfslam bench                                           the whole suite of synthetic worlds
  yfslam bench walking_xyz walking_rpy --methods none,yf --seeds 5
  yfslam bench rgbd_bonn_crowd --detector yolo-fastestv2.onnx --seeds 5 -- --camera bonn --grouping ransac
  yfslam bench walking_static --frames 150 -- --fault covered@2+1

In the output folder:
  table.md   median, least and greatest error over the seeds
  cells.csv  every run
  cells/     every cell as JSON; those that are there are not run again, unless program or options have changed
  runs/      what each run left behind

One process takes a sequence with one seed through all methods at once, a thread for each.";

/// Run sequences with several methods and seeds, and tabulate the errors. Can be stopped, and goes on where it stopped.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct BenchArgs {
    /// Folders in TUM or Bonn layout with ground truth, or names of synthetic worlds [default: all worlds of the suite].
    #[arg(value_name = "SEQUENCE")]
    sequences: Vec<String>,
    /// Methods to compare.
    #[arg(long, alias = "method", value_name = "METHOD,METHOD", value_delimiter = ',', default_value = "none,boxes,yf,full",
          value_parser = ["none", "boxes", "yf", "ds", "dyna", "dms", "full"])]
    methods: Vec<String>,
    /// Number of seeds: of the world if it is synthetic, else of the method's random draws.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Number of frames of each sequence [default: all].
    #[arg(long, value_name = "N")]
    frames: Option<u32>,
    /// Network that finds people, for methods that ask for boxes: `embedded` or a file [default: synthetic worlds and boxes.json tell, else
    /// embedded].
    #[arg(long, value_name = "FILE.onnx|embedded")]
    detector: Option<PathBuf>,
    /// Processes at a time; each uses about as many cores as there are methods.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u16).range(1..=256))]
    jobs: u16,
    /// Where results go [default: yfslam-out/bench].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Words for every `yfslam run`, after `--`.
    #[arg(last = true, value_name = "OPTIONS OF RUN")]
    extra: Vec<String>,
}

pub fn run(args: &BenchArgs, terminal: Terminal) -> Result<()> {
    let groups = args.groups()?;
    let out = OutputFolder::prepare(args.out.as_deref(), "bench")?;
    let program = std::env::current_exe().context("cannot find this program's own file")?;
    let image = std::fs::read(&program).with_context(|| format!("cannot read {}", program.display()))?;
    let bench = Bench {
        folder: out.path().into(),
        program,
        program_crc32: format!("{:08x}", crc32fast::hash(&image)),
        jobs: args.jobs.into(),
        extra: args.extra.clone(),
    };
    let progress = Mutex::new(Progress::new(terminal, "bench", groups.iter().map(|group| group.methods.len()).sum()));
    let cells = bench.cells(&groups, |done| {
        if let Ok(mut progress) = progress.lock() {
            progress.at(done, "cells", String::new);
        }
    })?;
    if let Ok(progress) = progress.into_inner() {
        progress.finish();
    }
    for cell in cells.iter().filter(|cell| cell.failure.is_some()) {
        let failure = cell.failure.as_deref().unwrap_or_default();
        terminal.warn(&format!("{} with {}, seed {}: {failure}", cell.sequence, cell.method, cell.seed));
    }
    let table = markdown(&cells);
    for (name, text) in [("table.md", &table), ("cells.csv", &csv(&cells))] {
        write_atomically(&out.path().join(name), |file| file.write_all(text.as_bytes()))?;
    }
    terminal.result(&format!("{table}\nwritten to {}\n", out.path().display()))
}

impl BenchArgs {
    /// All cells, sequence by sequence.
    fn groups(&self) -> Result<Vec<Group>> {
        let suite = || yfslam_synth::names().into_iter().map(str::to_owned).collect();
        let sequences = if self.sequences.is_empty() { suite() } else { self.sequences.clone() };
        let mut groups = Vec::new();
        for sequence in &sequences {
            let folder = Path::new(sequence).is_dir();
            if !folder {
                // Better known before the first run than in the middle of the night.
                yfslam_synth::parse(sequence).with_context(|| format!("{sequence} is no folder either"))?;
            }
            let group = |seed| if folder { self.recorded(sequence, seed) } else { self.world(sequence, seed) };
            groups.extend((1..=self.seeds).map(group));
        }
        Ok(groups)
    }

    fn recorded(&self, folder: &str, seed: u64) -> Group {
        let path = Path::new(folder);
        let name = path.file_name().map_or(folder.into(), |name| name.to_string_lossy());
        let mut options = vec!["--seed".to_owned(), seed.to_string()];
        options.extend(self.frames.into_iter().flat_map(|frames| ["--end".to_owned(), frames.to_string()]));
        self.group(&name, folder.to_owned(), seed, options)
    }

    fn world(&self, spec: &str, seed: u64) -> Group {
        let spec = spec.strip_prefix("synth:").unwrap_or(spec);
        let mut source = format!("synth:{spec}{}seed={seed}", if spec.contains('?') { '&' } else { '?' });
        if let Some(frames) = self.frames {
            source += &format!("&frames={frames}");
        }
        self.group(spec, source, seed, Vec::new())
    }

    fn group(&self, name: &str, source: String, seed: u64, options: Vec<String>) -> Group {
        let mut methods: Vec<String> = Vec::new();
        for method in &self.methods {
            if !methods.contains(method) {
                methods.push(method.clone());
            }
        }
        let detector = self.detector.iter().flat_map(|file| ["--detector".to_owned(), file.display().to_string()]);
        Group { sequence: name.to_owned(), source, methods, seed, options, detector: detector.collect() }
    }
}
