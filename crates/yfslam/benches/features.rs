//! Feature extraction of one image of 640×480 px: `cargo bench -p yfslam`.
//!
//! The image shows random squares of several sizes, or is the PGM file that `YFSLAM_IMAGE` names.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use yfslam::RgbImage;
use yfslam::config::FeatureConfig;
use yfslam::unstable::{Features, OrbExtractor};
use yfslam::unstable::{GrayImage, gray_from_rgb};

#[path = "../examples/pgm/mod.rs"]
mod pgm;

/// Returns an image of random squares.
fn squares() -> GrayImage {
    let mut image = GrayImage::new(640, 480);
    let mix = |v: u32| (v ^ v >> 15).wrapping_mul(0x85eb_ca6b) ^ v >> 13;
    for y in 0..480u32 {
        for (x, pixel) in (0u32..).zip(image.row_mut(y as usize)) {
            let layers = [5, 13, 37].map(|side| mix(x / side * 7919 + y / side * 104_729 + side) >> 8 & 0x7f);
            *pixel = (layers.iter().sum::<u32>() / 2) as u8;
        }
    }
    image
}

fn extraction(criterion: &mut Criterion) {
    let image = match std::env::var_os("YFSLAM_IMAGE") {
        Some(path) => pgm::read(Path::new(&path)).unwrap_or_else(|_| squares()),
        None => squares(),
    };
    let mut features = Features::default();
    for count in [1000, 2000] {
        let mut extractor = OrbExtractor::new(&FeatureConfig { count, ..Default::default() });
        criterion.bench_function(&format!("extract {count} features"), |bencher| {
            bencher.iter(|| extractor.extract(black_box(&image), &mut features));
        });
    }
    let color = RgbImage::new(640, 480);
    let mut gray = GrayImage::default();
    criterion
        .bench_function("grey from colour", |bencher| bencher.iter(|| gray_from_rgb(black_box(&color), &mut gray)));
}

criterion_group!(benches, extraction);
criterion_main!(benches);
