//! Times of the detector on one thread: the forward pass at every level, a whole image, loading a model. The network has random
//! weights and the official size, so that no data is needed; `crates/yfslam-bench/peers/peers_detector.py` compares with other engines.
#![allow(clippy::expect_used, reason = "a benchmark fails as tests do")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Net, Size, Style};
use criterion::{Criterion, criterion_group, criterion_main};
use yfslam::{Detector, RgbImage};
use yfslam_detect::{DetectorConfig, YoloFastestV2, available_levels};

fn detector(bytes: &[u8]) -> YoloFastestV2 {
    YoloFastestV2::from_bytes("synthetic", bytes, &DetectorConfig::default()).expect("the synthetic network loads")
}

fn benches(criterion: &mut Criterion) {
    let net = Net::yolo(&Size { height: 352, width: 352, channels: 24, classes: 80 }, Style::Folded, 1);
    let bytes = net.to_onnx();
    criterion.bench_function("detector/load", |bencher| bencher.iter(|| detector(&bytes)));

    let input: Vec<f32> = (0..3 * 352 * 352).map(|index| (index * 37 % 256) as f32 / 255.0).collect();
    for level in available_levels() {
        let mut detector = detector(&bytes).with_level(level);
        let name = format!("{level:?}");
        let name = format!("detector/forward/{}", name.split('(').next().unwrap_or_default());
        criterion.bench_function(&name, |bencher| bencher.iter(|| detector.forward(&input)));
    }

    let image = RgbImage::new(640, 480);
    let (mut detector, mut found) = (detector(&bytes), Vec::new());
    criterion.bench_function("detector/detect/640x480", |bencher| bencher.iter(|| detector.detect(&image, &mut found)));
}

criterion_group!(detector_benches, benches);
criterion_main!(detector_benches);
