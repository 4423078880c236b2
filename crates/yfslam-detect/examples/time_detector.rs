//! Measures the forward pass and the whole `detect` on one thread: process CPU time of every run, as one line of JSON per
//! instruction set; `crates/yfslam-bench/peers/peers_detector.py` compares it with other engines.
//!
//! `cargo run --release -p yfslam-detect --example time_detector -- model.onnx [runs [integers]]`
#![allow(clippy::print_stdout, reason = "the result goes to standard output")]

use std::error::Error;
use std::path::Path;

use rustix::time::{ClockId, clock_gettime};
use yfslam::{Detector, RgbImage};
use yfslam_detect::{DetectorConfig, YoloFastestV2, available_levels};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let model =
        arguments.next().ok_or("the path of an ONNX model is missing; usage: time_detector MODEL [RUNS [integers]]")?;
    let runs: usize = arguments.next().map_or(Ok(200), |runs| runs.parse())?;
    let integers = arguments.next().is_some_and(|word| word == "integers");
    let pixels = (0..640 * 480_usize).map(|index| [index, index / 7, index / 640].map(|value| value as u8)).collect();
    let image = RgbImage::from_vec(640, 480, pixels).ok_or("the test image has the wrong size")?;
    for level in available_levels() {
        let config = DetectorConfig { integers, ..DetectorConfig::default() };
        let mut detector = YoloFastestV2::load(Path::new(&model), &config)?.with_level(level);
        let (height, width) = detector.input_size();
        let input: Vec<f32> = (0..3 * height * width).map(|index| (index * 37 % 256) as f32 / 255.0).collect();
        let mut detections = Vec::new();
        let forward = time(runs, || detector.forward(&input))?;
        let detect = time(runs, || detector.detect(&image, &mut detections))?;
        let level = format!("{level:?}");
        let level = level.split('(').next().unwrap_or_default();
        println!("{{\"level\": \"{level}\", \"forward_all_ms\": {forward:?}, \"detect_all_ms\": {detect:?}}}");
    }
    Ok(())
}

/// Returns the CPU time of each of `runs` calls, ms, after ten calls to warm up.
fn time<E>(runs: usize, mut call: impl FnMut() -> Result<(), E>) -> Result<Vec<f64>, E> {
    (0..10).try_for_each(|_| call())?;
    let once = |_| {
        let start = cpu_ms();
        call().map(|()| cpu_ms() - start)
    };
    (0..runs).map(once).collect()
}

fn cpu_ms() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}
