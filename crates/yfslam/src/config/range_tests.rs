//! Short runs with each numeric key at both ends of its range: none may panic or take long.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::section::{Check, Entry, Number, Section};
use super::{Config, DepthSource, Method};
use crate::{BoundingBox, Camera, DepthImage, Detection, Frame, Image, RgbImage, Slam};

const SIDES: [usize; 2] = [320, 240];

/// Random grey levels in fields of 8 × 8 px, moved to the left by `shift_px`; without texture if `blank`.
fn wall(shift_px: usize, blank: bool) -> RgbImage {
    let pixel = |i: usize| {
        let (x, y) = ((i % SIDES[0] + shift_px) / 8, i / SIDES[0] / 8);
        let mixed = (y as u32 * 7919 + x as u32 * 104_729).wrapping_mul(2_654_435_761);
        [if blank { 128 } else { ((mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 24) as u8 }; 3]
    };
    RgbImage::from_vec(SIDES[0], SIDES[1], (0..SIDES[0] * SIDES[1]).map(pixel).collect()).unwrap()
}

/// A camera that moves sideways along a wall, is covered for a frame and moves on. A person walks before the wall.
fn frames() -> Vec<Frame> {
    let frame = |k: usize| {
        let mut raw = Image::new(SIDES[0], SIDES[1]);
        raw.data_mut().fill(9000u16);
        let left = 20 + 10 * k;
        (40..230).for_each(|y| raw.row_mut(y)[left..left + 60].fill(5000));
        let bbox = BoundingBox { x_min: left as f32 - 2.0, y_min: 38.0, x_max: left as f32 + 62.0, y_max: 232.0 };
        let depth = DepthImage { raw, metres_per_unit: 1.0 / 5000.0 };
        let detections = if k == 2 { Vec::new() } else { vec![Detection { class: 0, score: 0.9, bbox }] };
        let color = wall(3 * k, k == 3);
        let mut frame = Frame::rgbd(k as i64 * 300_000_000, color, depth).with_detections(detections);
        frame.right = Some(Arc::new(wall(3 * k + 14, k == 3)));
        frame
    };
    (0..5).map(frame).collect()
}

/// Tracks the frames and returns the number of poses.
fn run(config: Config, frames: &[Frame], with_dense: bool) -> usize {
    let builder = Slam::builder(Camera::pinhole(SIDES[0], SIDES[1], 260.0, 260.0, 160.0, 120.0));
    let builder = if with_dense { builder.dense(config.dense.clone()) } else { builder };
    let mut slam = builder.config(config).build().unwrap();
    for frame in frames {
        slam.track(frame).unwrap();
    }
    slam.finish_mapping();
    if with_dense {
        let mut dense = slam.dense().unwrap();
        dense.cloud();
        dense.mesh();
        dense.ground_grid([-1.0, 1.0]);
    }
    slam.trajectories().iter().map(Vec::len).sum()
}

/// The default configuration for a section's sensor, with a method that needs no detector where there is no depth image.
fn base(section: &str) -> Config {
    let mut config = Config::default();
    (config.depth.source, config.dynamic.method) = match section {
        "stereo" => (DepthSource::Stereo, Method::None),
        "monocular" => (DepthSource::Motion, Method::None),
        _ => (DepthSource::Image, Method::Full),
    };
    // The images are small.
    (config.tracking.init_min_features, config.tracking.init_min_landmarks) = (100, 50);
    config
}

#[test]
fn no_value_within_its_range_makes_a_run_panic_or_hang() {
    let frames = frames();
    for section in ["depth", "stereo", "monocular"] {
        let poses = run(base(section), &frames, false);
        // Motion along a wall alone is ambiguous for a single camera.
        assert!(poses >= 3 || section == "monocular", "only {poses} poses with {section}");
    }
    let mut ends: Vec<(String, Number)> = Vec::new();
    Config::default().visit_keys("", &mut |path, key, _| {
        if let Check::Range(range) = key.check {
            ends.extend(range().map(|end| (path.to_owned(), end)));
        }
    });
    for (path, end) in ends {
        let section = path.split('.').next().unwrap_or_default();
        let mut config = base(section);
        config.set(&path, end);
        let start = Instant::now();
        run(config, &frames, section == "dense");
        assert!(start.elapsed() < Duration::from_secs(60), "{path} = {end} takes {:?}", start.elapsed());
    }
}
