//! `yfslam bench`: the tables of the paper over sequences, methods and seeds.

mod benchmark_datasets;
mod cell;
mod external;
mod figures;
mod names;
mod paper;
mod runner;
mod table;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, Result, ensure};
use clap::{Args, value_parser};
use yfslam_io::{prepare_folder, write_atomically};
use yfslam_report::{TableSection, TableStyle, TablesPage};

use self::cell::{Cell, Group};
use self::external::External;
use self::figures::SequenceFigures;
use self::names::distinct_names;
use self::paper::sections;
use self::runner::Bench;
use self::table::{csv, summary_csv};
use crate::output::folder::OutputFolder;
use crate::ui::command_line::command_line;
use crate::ui::failures::Failures;
use crate::ui::interrupt::Interrupt;
use crate::ui::program;
use crate::ui::progress::Progress;
use crate::ui::terminal::Terminal;

const HELP: &str = "\
Examples:
  yfslam bench                                           all worlds of the synthetic suite
  yfslam bench walking_xyz walking_rpy --methods none,yf --seeds 5
  yfslam bench rgbd_bonn_crowd --detector yolo-fastestv2.onnx --seeds 5 -- --camera bonn --grouping ransac
  yfslam bench walking_static --frames 150 -- --fault covered@2+1
  yfslam bench DIR                                       all sequences in a folder of folders
  yfslam bench DIR --external ORB-SLAM3=results/orb      adds trajectories of another system
  yfslam bench --known DIR --methods none,yf,full        the dynamic sequences of TUM and Bonn in a folder

Files in the output folder:
  report.html  tables of the paper: errors with their improvement on none, times, frames tracked; figures
  table.md     the same tables as Markdown
  tables/      each table as CSV and as LaTeX (booktabs, the best figures bold)
  cells.csv    one line for each run, one number in each cell
  summary.csv  one line for each sequence and system: medians and ranges over the seeds
  figures/     trajectories and errors of all systems with the first seed, and errors over the seeds, as SVG and PDF
  cells/       results of each run as JSON; existing ones are reused unless program or options have changed
  runs/        output folders of the runs

Published results:
  If a whole recorded sequence of TUM or Bonn is run, results from papers are added to the tables, marked as published.

Signals:
  SIGINT (Ctrl-C) and SIGTERM end the bench and its processes, with exit code 130 or 143. Unfinished runs are removed, and finished cells
  stay: the same command continues the bench.

Processes:
  One process runs all methods on a sequence with one seed, with one thread for each method.";

/// Run sequences with several methods and seeds, and write tables of the errors; an interrupted bench can be continued.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct BenchArgs {
    /// Sequences in TUM or Bonn layout with ground truth, folders of such sequences, or synthetic worlds [default: all worlds].
    #[arg(value_name = "SEQUENCE")]
    sequences: Vec<String>,
    /// Run the dynamic sequences of TUM and Bonn in this folder, and list the missing ones; nothing is downloaded.
    #[arg(long, value_name = "DIR", conflicts_with = "sequences")]
    known: Option<PathBuf>,
    /// Methods to compare.
    #[arg(long, alias = "method", value_name = "METHOD,METHOD", value_delimiter = ',', default_value = "none,boxes,yf,full",
          value_parser = ["none", "boxes", "yf", "ds", "dyna", "dms", "full"])]
    methods: Vec<String>,
    /// Number of seeds, of a synthetic world or else of the random draws of the method.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Number of frames of each sequence [default: all].
    #[arg(long, value_name = "N")]
    frames: Option<u32>,
    /// Network that detects people: `embedded` or an ONNX file [default: the boxes of the sequence, else embedded].
    #[arg(long, value_name = "FILE.onnx|embedded")]
    detector: Option<PathBuf>,
    /// Trajectories of another system: a file, or a folder with a file for each sequence, such as walking_xyz.txt, or walking_xyz_2.txt
    /// for the second seed; can be given several times.
    #[arg(long, value_name = "NAME=FILE|DIR")]
    external: Vec<External>,
    /// Number of processes at the same time; each uses about as many cores as there are methods.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u16).range(1..=256))]
    jobs: u16,
    /// Output folder [default: yfslam-out/bench].
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Options of every `yfslam run`, after `--`.
    #[arg(last = true, value_name = "OPTIONS OF RUN")]
    extra: Vec<String>,
}

pub fn run(args: &BenchArgs, terminal: Terminal) -> Result<()> {
    let interrupt = Interrupt::watch()?;
    let datasets = args.known.as_deref().map(benchmark_datasets::find).transpose()?;
    let missing = datasets.as_ref().map_or("", |datasets| &datasets.missing);
    for line in missing.lines() {
        terminal.note(line);
    }
    let groups = args.groups(datasets.as_ref().map(|datasets| datasets.folders.as_slice()))?;
    external::check(&args.external, &args.methods, &groups)?;
    let out = OutputFolder::prepare(args.out.as_deref(), "bench")?;
    ["cells", "tables"].iter().try_for_each(|part| prepare_folder(&out.path().join(part)))?;
    let program = program::files().context("cannot find the file of this program")?;
    let binary =
        std::fs::read(&program.content).with_context(|| format!("cannot read {}", program.content.display()))?;
    let bench = Bench {
        folder: out.path().into(),
        program: program.start,
        program_crc32: format!("{:08x}", crc32fast::hash(&binary)),
        jobs: args.jobs.into(),
        extra: args.extra.clone(),
        interrupt,
    };
    let progress = Mutex::new(Progress::new(terminal, "bench", groups.iter().map(|group| group.methods.len()).sum()));
    let cells = bench.cells(&groups, |done| {
        if let Ok(mut progress) = progress.lock() {
            progress.at(done, "cells", String::new);
        }
    });
    if let Ok(progress) = progress.into_inner() {
        progress.finish();
    }
    let cells = external::with_externals(cells?, &groups, &args.external, &args.extra, terminal);
    for cell in cells.iter().filter(|cell| cell.failure.is_some()) {
        let failure = cell.failure.as_deref().unwrap_or_default();
        terminal.warn(&format!("{} with {}, seed {}: {failure}", cell.sequence, cell.method, cell.seed));
    }
    let sections = sections(&cells);
    let mut failures = Failures::new(terminal);
    let drawn = figures::draw(out.path(), &groups, &cells, &args.external, &args.extra, terminal);
    let drawn = failures.keep(drawn).unwrap_or_default();
    let page = write(out.path(), args, &cells, &sections, &drawn, missing, &mut failures);
    let overview = sections.first().map_or(String::new(), |section| section.table.render(TableStyle::Markdown));
    let summary = format!("{overview}\nwritten to {}\nreport: {}\n", out.path().display(), page.display());
    let printed = terminal.result(&summary);
    failures.check()?;
    printed
}

/// Writes the tables in all formats; returns the path of the page.
fn write(
    out: &Path,
    args: &BenchArgs,
    cells: &[Cell],
    sections: &[TableSection],
    drawn: &[SequenceFigures],
    missing: &str,
    failures: &mut Failures,
) -> PathBuf {
    let mut text = String::new();
    for TableSection { id, title, about, table } in sections {
        text += &format!("## {title}\n\n{about}\n\n{}\n", table.render(TableStyle::Markdown));
        for (extension, style) in [("csv", TableStyle::Csv), ("tex", TableStyle::Latex)] {
            let table = table.render(style);
            let path = out.join("tables").join(format!("{id}.{extension}"));
            failures.keep(write_atomically(&path, |file| file.write_all(table.as_bytes())));
        }
    }
    if !missing.is_empty() {
        text += &format!("## Not run\n\n{missing}");
    }
    let frames = args.frames.map_or("all".to_owned(), |frames| format!("the first {frames}"));
    let mut facts = vec![
        ("Seeds", args.seeds.to_string()),
        ("Frames of each sequence", frames),
        ("Failed runs", cells.iter().filter(|cell| cell.failure.is_some()).count().to_string()),
    ];
    if !args.extra.is_empty() {
        facts.push(("Options of every run", args.extra.join(" ")));
    }
    facts.extend(missing.lines().map(|line| ("Not run", line.to_owned())));
    let version = env!("CARGO_PKG_VERSION");
    let title = "Comparison of methods";
    // The page has trajectory and error over time; the other figures are in the folder.
    let shown = ["trajectory-from-above", "trajectory-from-the-side", "translation-error", "ate-over-runs"];
    let of_sequence = |one: &SequenceFigures| {
        let chosen = one.figures.iter().filter(|figure| shown.contains(&figure.name.as_str()));
        chosen.map(|figure| (format!("{}: {}", one.sequence, figure.title), figure.svg.clone())).collect::<Vec<_>>()
    };
    let figures = drawn.iter().flat_map(of_sequence).collect();
    let page = TablesPage { title, facts, sections, figures, version, command: command_line() }.html();
    let path = out.join("report.html");
    for (path, text) in [
        (&out.join("table.md"), &text),
        (&out.join("cells.csv"), &csv(cells)),
        (&out.join("summary.csv"), &summary_csv(cells)),
        (&path, &page),
    ] {
        failures.keep(write_atomically(path, |file| file.write_all(text.as_bytes())));
    }
    path
}

/// What the user wants to be run.
enum Input {
    /// Folder of a sequence.
    Recording(PathBuf),
    /// Synthetic world.
    World(String),
}

impl Input {
    fn folder(&self) -> Option<&Path> {
        match self {
            Self::Recording(folder) => Some(folder),
            Self::World(_) => None,
        }
    }

    /// Returns what is the same for different paths to the same folder.
    fn place(&self) -> PathBuf {
        match self {
            Self::Recording(folder) => folder.canonicalize().unwrap_or_else(|_| folder.clone()),
            Self::World(spec) => format!("synth:{}", spec.strip_prefix("synth:").unwrap_or(spec)).into(),
        }
    }
}

impl BenchArgs {
    /// Returns what to run, sequence by sequence.
    fn groups(&self, known: Option<&[PathBuf]>) -> Result<Vec<Group>> {
        let suite = || yfslam_synth::names().into_iter().map(str::to_owned).collect();
        let sequences = if self.sequences.is_empty() && known.is_none() { suite() } else { self.sequences.clone() };
        let mut inputs: Vec<Input> = known.unwrap_or_default().iter().cloned().map(Input::Recording).collect();
        for sequence in sequences {
            if Path::new(&sequence).is_dir() {
                let folders = benchmark_datasets::sequences_in(Path::new(&sequence))?;
                inputs.extend(folders.into_iter().map(Input::Recording));
            } else {
                // Checked before the first run.
                yfslam_synth::parse(&sequence).with_context(|| format!("{sequence} is not a folder either"))?;
                inputs.push(Input::World(sequence));
            }
        }
        let mut known = BTreeSet::new();
        inputs.retain(|input| known.insert(input.place()));
        let folders: Vec<&Path> = inputs.iter().filter_map(Input::folder).collect();
        let mut names = distinct_names(&folders).into_iter();
        let group = |input: &Input| match input {
            Input::Recording(folder) => self.recorded(folder, &names.next().unwrap_or_default()),
            Input::World(spec) => (1..=self.seeds).map(|seed| self.world(spec, seed)).collect(),
        };
        let groups: Vec<Group> = inputs.iter().flat_map(group).collect();
        let mut files: BTreeMap<String, &str> = BTreeMap::new();
        for group in &groups {
            let other = files.insert(group.key(), &group.source).unwrap_or(&group.source);
            ensure!(
                other == group.source,
                "the results of {other} and of {} would have the same names ({}); rename one of the folders",
                group.source,
                group.key()
            );
        }
        Ok(groups)
    }

    /// Returns the runs of a recording with this name in the tables, one for each seed.
    fn recorded(&self, folder: &Path, name: &str) -> Vec<Group> {
        let has_option = |option: &str| self.extra.iter().any(|argument| argument.split('=').next() == Some(option));
        let changes = ["--start", "--end", "--reverse", "--fault", "--depth-factor"];
        let whole = self.frames.is_none() && !changes.iter().any(|option| has_option(option));
        let camera = benchmark_datasets::camera_of(folder).filter(|_| !has_option("--camera"));
        let group = |seed: u64| {
            let mut options = vec!["--seed".to_owned(), seed.to_string()];
            options.extend(self.frames.into_iter().flat_map(|frames| ["--end".to_owned(), frames.to_string()]));
            options.extend(camera.into_iter().flat_map(|camera| ["--camera".to_owned(), camera.to_owned()]));
            Group { whole, ..self.group(name, folder.display().to_string(), seed, options) }
        };
        (1..=self.seeds).map(group).collect()
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
        Group { sequence: name.to_owned(), source, methods, seed, options, detector: detector.collect(), whole: false }
    }
}
