//! Times feature extraction, for comparison with other extractors (see `benches/README.md`).
//!
//! `cargo run --release -p yfslam --example time_features -- RUNS IMAGE.pgm ...` prints for each image the least and the median wall
//! time of so many runs, ms, and the number of features.

mod pgm;

use std::io::{Error, ErrorKind, Result, Write};
use std::time::Instant;

use yfslam::config::FeatureConfig;
use yfslam::unstable::{Features, OrbExtractor};

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let usage = || Error::new(ErrorKind::InvalidInput, "usage: time_features RUNS IMAGE.pgm ...");
    let runs: usize = arguments.next().and_then(|n| n.parse().ok()).filter(|n| *n > 0).ok_or_else(usage)?;
    let mut extractor = OrbExtractor::new(&FeatureConfig::default());
    let mut features = Features::default();
    for path in arguments {
        let image = pgm::read(path)?;
        extractor.extract(&image, &mut features);
        let mut times: Vec<f64> = (0..runs)
            .map(|_| {
                let start = Instant::now();
                extractor.extract(&image, &mut features);
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        writeln!(std::io::stdout(), "{:.4} {:.4} {}", times[0], times[runs / 2], features.key_points.len())?;
    }
    Ok(())
}
