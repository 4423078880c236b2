//! Mutates the corpus of a target, or of all, for as long as one likes, and prints the number of cases of each:
//!
//!     cargo run --release -p yfslam-fuzz --example mutate -- [SECONDS [TARGET...]]
//!
//! Needs no fuzzing engine. An input that is not read within the time of its target is in the file that is named first.

use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};
use std::{env, fs};

use yfslam_fuzz::TARGETS;
use yfslam_fuzz::mutation::Mutator;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let time = Duration::from_secs_f64(arguments.next().map_or(Ok(1.0), |text| text.parse())?);
    let chosen: Vec<String> = arguments.collect();
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let input = env::temp_dir().join("yfslam-fuzz-input");
    eprintln!("the input at work: {}", input.display());
    for target in TARGETS.iter().filter(|target| chosen.is_empty() || chosen.iter().any(|name| name == target.name)) {
        let mut paths: Vec<_> = fs::read_dir(corpus.join(target.name))?
            .map(|entry| Ok(entry?.path()))
            .collect::<Result<_, std::io::Error>>()?;
        paths.sort();
        let files = paths.iter().map(fs::read).collect::<Result<Vec<_>, _>>()?;
        let (mut mutator, begin, mut cases, mut slowest) =
            (Mutator::new(1, target.max_length), Instant::now(), 0, Duration::ZERO);
        while begin.elapsed() < time {
            let bytes = mutator.mutate(&files);
            fs::write(&input, &bytes)?;
            let run = Instant::now();
            (target.run)(&bytes);
            slowest = slowest.max(run.elapsed());
            cases += 1;
        }
        eprintln!("{:<20} {cases:>10} cases, slowest {slowest:?}", target.name);
    }
    Ok(())
}
