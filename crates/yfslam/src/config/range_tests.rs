//! Short runs of the methods none, yf and full with each numeric key at both ends of its range: none may panic, hang or need much memory.

use std::sync::Arc;
use std::thread;

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
fn base(section: &str, method: Method) -> Config {
    let mut config = Config::default();
    (config.depth.source, config.dynamic.method) = match section {
        "stereo" => (DepthSource::Stereo, Method::None),
        "monocular" => (DepthSource::Motion, Method::None),
        _ => (DepthSource::Image, method),
    };
    // The images are small.
    (config.tracking.init_min_features, config.tracking.init_min_landmarks) = (100, 50);
    config
}

/// The largest memory of this process so far, MB; 0 where the system does not tell.
fn peak_memory_mb() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
    peak.unwrap_or(0) / 1024
}

#[test]
fn no_value_within_its_range_makes_a_run_panic_or_hang_or_take_much_memory() {
    let frames = frames();
    for section in ["depth", "stereo", "monocular"] {
        let poses = run(base(section, Method::Full), &frames, false);
        // Motion along a wall alone is ambiguous for a single camera.
        assert!(poses >= 3 || section == "monocular", "only {poses} poses with {section}");
    }
    let mut ends: Vec<(String, Number, Method)> = Vec::new();
    Config::default().visit_keys("", &mut |path, key, _| {
        if let Check::Range(range) = key.check {
            let alone = path.starts_with("stereo.") || path.starts_with("monocular.");
            let methods = if alone { &[Method::None][..] } else { &[Method::None, Method::YfSlam, Method::Full] };
            let each = range().into_iter().flat_map(|end| methods.iter().map(move |method| (end, *method)));
            ends.extend(each.map(|(end, method)| (path.to_owned(), end, method)));
        }
    });
    assert!(ends.len() > 900, "{}", ends.len());
    let run_end = |(path, end, method): &(String, Number, Method)| {
        let section = path.split('.').next().unwrap_or_default();
        let mut config = base(section, *method);
        config.set(path, *end);
        run(config, &frames, section == "dense");
        let peak_mb = peak_memory_mb();
        assert!(peak_mb < 2000, "{path} = {end} with {method:?}: {peak_mb} MB");
    };
    let workers = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        let work = |first: usize| ends.iter().skip(first).step_by(workers).for_each(run_end);
        (0..workers).for_each(|first| drop(scope.spawn(move || work(first))));
    });
}
