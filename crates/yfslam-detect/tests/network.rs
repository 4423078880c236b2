//! The whole path from ONNX bytes to raw outputs, on a generated network, compared with a naive executor.
#![allow(clippy::expect_used, reason = "helpers of tests fail as tests do")]

mod common;

use common::{Net, Size, Style, random};
use yfslam_detect::{DetectorConfig, Level, YoloFastestV2, available_levels};

fn levels() -> Vec<Level> {
    let mut levels = available_levels();
    levels.push(Level::fallback());
    levels
}

fn config(classes: usize) -> DetectorConfig {
    DetectorConfig { class_names: (0..classes).map(|class| format!("class {class}")).collect(), ..Default::default() }
}

fn image(size: &Size, seed: u64) -> Vec<f32> {
    let mut state = seed;
    (0..3 * size.height * size.width).map(|_| random(&mut state)).collect()
}

/// Runs `net` at `level`; returns all outputs in one list.
fn run(net: &Net, classes: usize, image: &[f32], level: Level) -> Vec<f32> {
    let detector = YoloFastestV2::from_bytes("synthetic", &net.to_onnx(), &config(classes));
    let mut detector = detector.expect("the synthetic network loads").with_level(level);
    detector.forward(image).expect("the image has the right size");
    detector.raw_outputs().into_iter().flat_map(|output| output.values).collect()
}

fn check(size: &Size, style: Style, seed: u64) {
    let net = Net::yolo(size, style, seed);
    let image = image(size, seed + 1);
    let expected: Vec<f64> = net.run(&image).concat();
    let scale = expected.iter().map(|value| value.abs()).fold(1.0, f64::max);
    for level in levels() {
        let values = run(&net, size.classes, &image, level);
        assert_eq!(values.len(), expected.len());
        let error = values.iter().zip(&expected).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-5 * scale, "{style:?} at {level:?}: {error} of {scale}");
    }
}

#[test]
fn every_level_computes_the_operators_as_defined() {
    check(&Size { height: 96, width: 96, channels: 24, classes: 80 }, Style::Folded, 1);
}

#[test]
fn every_form_of_the_graph_gives_the_same_network() {
    for style in [Style::Folded, Style::Unfolded, Style::Split] {
        check(&Size { height: 64, width: 96, channels: 8, classes: 3 }, style, 2);
    }
}

#[test]
fn weights_stored_in_16_bits_give_the_same_bits_as_the_same_weights_in_32() {
    let size = Size { height: 64, width: 96, channels: 8, classes: 3 };
    let [whole, halves] = [false, true].map(|store| {
        let mut net = Net::yolo(&size, Style::Folded, 6);
        net.halve(store);
        (net.to_onnx().len(), run(&net, 3, &image(&size, 7), Level::new()))
    });
    assert!(whole.1 == halves.1 && halves.1.iter().any(|value| *value != 0.0));
    assert!(halves.0 < whole.0, "{} bytes, {} in 32 bits", halves.0, whole.0);
}

#[test]
fn sizes_and_channels_that_fill_no_vector_are_computed_correctly() {
    for (height, width, channels, classes) in [(32, 32, 1, 1), (32, 160, 5, 2), (224, 32, 7, 13), (96, 160, 24, 4)] {
        check(&Size { height, width, channels, classes }, Style::Folded, 3);
    }
}

/// Returns metadata with, on each line, the name of a 1×1 convolution and the step and the zero of its input.
fn scales(net: &Net, image: &[f32]) -> String {
    let line = |(name, low, high): (&str, f64, f64)| {
        let step = (high - low) / 255.0;
        format!("{name} {step} {}\n", (-low / step) as u8)
    };
    net.ranges(image).into_iter().map(line).collect()
}

#[test]
fn integers_give_the_same_bits_at_every_level_and_nearly_the_results_of_floats() {
    let size = Size { height: 96, width: 160, channels: 24, classes: 4 };
    let (mut net, image) = (Net::yolo(&size, Style::Folded, 8), image(&size, 9));
    net.metadata = vec![("scales", scales(&net, &image))];
    let run = |integers: bool, level: Level| {
        let config = DetectorConfig { integers, ..config(4) };
        let detector = YoloFastestV2::from_bytes("synthetic", &net.to_onnx(), &config);
        let mut detector = detector.expect("the synthetic network loads").with_level(level);
        detector.forward(&image).expect("the image has the right size");
        detector.raw_outputs().into_iter().flat_map(|output| output.values).collect::<Vec<f32>>()
    };
    // Float layers round in their own way on levels without fused operations.
    let fused = |level: &Level| ["Avx", "Neon"].iter().any(|name| format!("{level:?}").starts_with(name));
    let mut outputs = available_levels().into_iter().filter(fused).map(|level| run(true, level));
    let Some(first) = outputs.next() else { return };
    assert!(outputs.all(|other| other == first));
    let floats = run(false, Level::new());
    let mean = |values: &mut dyn Iterator<Item = f32>| values.map(f64::from).sum::<f64>() / floats.len() as f64;
    let error = mean(&mut floats.iter().zip(&first).map(|(a, b)| (a - b).powi(2)));
    let power = mean(&mut floats.iter().map(|a| a.powi(2)));
    assert!(error > 0.0 && error < 1e-2 * power, "{error} of {power}");
}

#[test]
fn a_level_with_fused_multiply_add_gives_the_same_bits_as_any_other() {
    let size = Size { height: 96, width: 160, channels: 24, classes: 4 };
    let (net, image) = (Net::yolo(&size, Style::Folded, 4), image(&size, 5));
    let fused = |level: &Level| {
        let name = format!("{level:?}");
        ["Avx", "Neon"].iter().any(|fused| name.starts_with(fused))
    };
    let mut outputs = available_levels().into_iter().filter(fused).map(|level| run(&net, 4, &image, level));
    let Some(first) = outputs.next() else { return };
    assert!(outputs.all(|other| other == first));
}
