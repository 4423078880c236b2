//! Extracts the features of images, for comparison with other extractors (see `benches/README.md`).
//!
//! `cargo run --release --example extract_features -- OUT IMAGE.pgm ...` writes for each image the number of features (u32), then
//! for each feature x, y, angle (rad), response, octave (f32 each, little-endian) and the 32 bytes of the descriptor.

mod pgm;

use std::io::{BufWriter, Error, ErrorKind, Result, Write};

use yfslam::config::FeatureConfig;
use yfslam::unstable::{Features, OrbExtractor};

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let usage = || Error::new(ErrorKind::InvalidInput, "usage: extract_features OUT IMAGE.pgm ...");
    let mut out = BufWriter::new(std::fs::File::create(arguments.next().ok_or_else(usage)?)?);
    let mut extractor = OrbExtractor::new(&FeatureConfig::default());
    let mut features = Features::default();
    for path in arguments {
        extractor.extract(&pgm::read(path)?, &mut features);
        out.write_all(&(features.key_points.len() as u32).to_le_bytes())?;
        for (k, descriptor) in features.key_points.iter().zip(&features.descriptors) {
            for value in [k.x, k.y, k.angle_rad, k.response, f32::from(k.octave)] {
                out.write_all(&value.to_le_bytes())?;
            }
            for word in descriptor.0 {
                out.write_all(&word.to_le_bytes())?;
            }
        }
    }
    out.flush()
}
