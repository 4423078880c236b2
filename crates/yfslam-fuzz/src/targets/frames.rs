//! Damaged frames among good ones: a frame that is refused leaves no trace.
//!
//! Each byte is a frame, good or damaged in the way that the byte says. One run gets all of them, a second one only those that the first
//! run accepted: every result of both must be the same. No frame may cause a panic, and no pose may have a number that is not finite.

use std::sync::{Arc, LazyLock};

use yfslam::{
    BoundingBox, Camera, Config, DepthImage, Detection, Frame, FrameRejected, Image, Method, RgbImage, Slam, Tracked,
};
use yfslam_synth::{World, WorldConfig};

/// Size of the images, px.
const SIZE: [usize; 2] = [160, 120];
/// Frames of the synthetic sequence; after them, it begins again.
const SYNTHETIC: usize = 8;
/// Most frames of a run.
const MOST_FRAMES: usize = 16;
/// Time between frames, ns.
const PERIOD_NS: i64 = 33_000_000;

static GOOD: LazyLock<Vec<Frame>> = LazyLock::new(|| {
    let [width, height] = SIZE;
    let camera = Camera::pinhole(width, height, 133.85, 134.8, 80.0, 62.0);
    let config = WorldConfig { frames: SYNTHETIC, people: 0, camera, ..WorldConfig::default() };
    let world = World::new(&config);
    world.map_or_else(|_| Vec::new(), |world| (0..SYNTHETIC).map(|index| world.frame(index).frame).collect())
});

/// A run of as many frames as there are bytes.
pub fn frames(bytes: &[u8]) -> bool {
    let method = if bytes.first().is_some_and(|first| first & 128 == 0) { Method::None } else { Method::Full };
    let frames: Vec<Frame> =
        bytes.iter().take(MOST_FRAMES).enumerate().filter_map(|(index, &byte)| frame(index, byte)).collect();
    let all = run(method, frames.iter());
    let accepted = frames.iter().zip(&all).filter(|(_, result)| result.is_ok()).map(|(frame, _)| frame);
    let only = run(method, accepted);
    let kept: Vec<_> = all.iter().filter(|result| result.is_ok()).collect();
    assert_eq!(kept.len(), only.len());
    for (with, without) in kept.iter().zip(&only) {
        assert_eq!(summary(with), summary(without), "a frame that was refused changed the result of another");
    }
    only.iter().flatten().any(|tracked| tracked.t_world_cam.is_some())
}

fn run<'a>(method: Method, frames: impl Iterator<Item = &'a Frame>) -> Vec<Result<Tracked, FrameRejected>> {
    let [width, height] = SIZE;
    let camera = Camera::pinhole(width, height, 133.85, 134.8, 80.0, 62.0);
    let mut config = Config::default();
    config.dynamic.method = method;
    // Small images have few features.
    (config.tracking.init_min_features, config.tracking.init_min_landmarks) = (100, 50);
    let Ok(mut slam) = Slam::builder(camera).config(config).build() else { return Vec::new() };
    let tracked = frames.map(|frame| slam.track(frame)).collect();
    let _ = slam.finish_mapping();
    let finite =
        slam.trajectory().iter().all(|(_, pose)| pose.to_homogeneous().iter().all(|number| number.is_finite()));
    assert!(finite, "a pose is not finite");
    tracked
}

/// What of a result must be the same: all but the times that it took.
fn summary(result: &Result<Tracked, FrameRejected>) -> String {
    match result {
        Ok(tracked) => format!(
            "{} {:?} {:?} {:?} {} {} {:?} {:?} {:?}",
            tracked.timestamp_ns,
            tracked.state,
            tracked.t_world_cam,
            tracked.covariance,
            tracked.inliers,
            tracked.is_keyframe,
            tracked.start,
            tracked.lost_reason,
            tracked.loop_closure,
        ),
        Err(rejected) => format!("{rejected:?}"),
    }
}

/// Makes the frame of a byte: its lower five bits say how it is damaged.
fn frame(index: usize, byte: u8) -> Option<Frame> {
    let mut frame = GOOD.get(index % SYNTHETIC)?.clone();
    let [width, height] = SIZE;
    frame.timestamp_ns = PERIOD_NS * (index as i64 + 1);
    frame.depth_timestamp_ns = None;
    let color = |width, height| Arc::new(RgbImage::new(width, height));
    let depth =
        |width, height, metres_per_unit| Arc::new(DepthImage { raw: Image::new(width, height), metres_per_unit });
    let raw = frame.depth.as_ref()?.raw.clone();
    let with_unit = |metres_per_unit| Some(Arc::new(DepthImage { raw: raw.clone(), metres_per_unit }));
    let boxes = |numbers: [f32; 4], score: f32, class: usize| {
        let [x_min, y_min, x_max, y_max] = numbers;
        Some(vec![Detection { class, score, bbox: BoundingBox { x_min, y_min, x_max, y_max } }])
    };
    match byte & 31 {
        1 => frame.timestamp_ns = 0,
        2 => frame.timestamp_ns -= PERIOD_NS,
        3 => frame.timestamp_ns = i64::MIN,
        4 => frame.timestamp_ns = i64::MAX,
        5 => frame.timestamp_ns = -1,
        6 => frame.color = color(width - 1, height),
        7 => frame.color = color(0, 0),
        8 => frame.color = color(width, height),
        9 => frame.depth = None,
        10 => frame.depth = Some(depth(width, height + 1, 0.001)),
        11 => frame.depth = Some(depth(0, 0, 0.001)),
        12 => frame.depth = Some(depth(width, height, 0.001)),
        13 => frame.depth = with_unit(f32::NAN),
        14 => frame.depth = with_unit(f32::INFINITY),
        15 => frame.depth = with_unit(0.0),
        16 => frame.depth = with_unit(-0.001),
        17 => frame.depth = with_unit(f32::MAX),
        18 => frame.depth = with_unit(f32::MIN_POSITIVE),
        19 => frame.depth_timestamp_ns = Some(i64::MIN),
        20 => frame.depth_timestamp_ns = Some(i64::MAX),
        21 => frame.right = Some(color(3, 3)),
        22 => frame.mask = Some(Arc::new(Image::new(width, height - 1))),
        23 => frame.mask = Some(Arc::new(Image::new(0, 0))),
        24 => frame.mask = Image::from_vec(width, height, vec![255; width * height]).map(Arc::new),
        25 => frame.detections = boxes([f32::NAN; 4], f32::NAN, 0),
        26 => frame.detections = boxes([f32::NEG_INFINITY, 0.0, f32::INFINITY, 1e30], 1.0, usize::MAX),
        27 => frame.detections = boxes([100.0, 100.0, 10.0, 10.0], -1.0, 0),
        28 => frame.detections = boxes([0.0, 0.0, 160.0, 120.0], f32::INFINITY, 0),
        29 => frame.detections = boxes([-1e9, -1e9, 1e9, 1e9], 0.5, 0),
        30 => frame.detections = boxes([1e30, 1e30, 1e31, 1e31], 0.5, 0),
        _ => {}
    }
    Some(frame)
}
