//! The inputs of a frame besides its image: masks of movable objects, depth, the right image, detections.
#![allow(clippy::unwrap_used, reason = "a test may")]

use std::sync::Arc;

use yfslam::config::FullConfig;
use yfslam::{
    BoundingBox, Camera, Config, DepthImage, DepthSource, Detection, Frame, FrameRejected, Image, Method, RgbImage,
    SetupError, Slam,
};

/// Returns a frame of a textured wall, with a mask of the given width.
fn frame(timestamp_ns: i64, mask_width: usize) -> Frame {
    let grain = |i: usize| {
        let mixed = ((i / 640 / 6 * 107 + i % 640 / 6) as u32).wrapping_mul(0x9e37_79b1);
        ((mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 24) as u8
    };
    let mut raw = Image::new(640, 480);
    raw.data_mut().fill(9000u16);
    let mut mask = Image::new(mask_width, 480);
    (100..400).for_each(|y| mask.row_mut(y)[..mask_width / 2].fill(1));
    let color = RgbImage::from_vec(640, 480, (0..640 * 480).map(|i| [grain(i); 3]).collect()).unwrap();
    let depth = DepthImage { raw, metres_per_unit: 1.0 / 5000.0 };
    Frame::rgbd(timestamp_ns, color, depth).with_detections(Vec::new()).with_mask(mask)
}

fn camera() -> Camera {
    let (fx, fy, cx, cy) = (520.0, 520.0, 320.0, 240.0);
    Camera::pinhole(640, 480, fx, fy, cx, cy)
}

#[test]
fn features_on_a_mask_are_distrusted_and_a_mask_of_another_size_is_refused() {
    let mut config = Config::default();
    config.dynamic.method = Method::Full;
    let mut slam = Slam::builder(camera()).config(config).build().unwrap();
    slam.track(&frame(0, 640)).unwrap();
    let masked = |x: f32, y: f32| x < 320.0 && (100.0..400.0).contains(&y);
    let features = &slam.features();
    let on = features.iter().filter(|f| masked(f.raw[0], f.raw[1]));
    assert!(on.clone().count() > 50 && on.clone().all(|f| f.trust == 0.0));
    assert!(features.iter().filter(|f| f.raw[0] > 400.0).all(|f| f.trust > 0.0));
    let refused = slam.track(&frame(1, 320)).unwrap_err();
    assert!(matches!(refused, FrameRejected::Size { image: "mask", width: 320, .. }), "{refused}");
}

#[test]
fn depth_images_are_used_only_if_the_configuration_says_so() {
    for (source, is_tracked) in [(DepthSource::Image, true), (DepthSource::Motion, false)] {
        let mut config = Config::default();
        config.depth.source = source;
        config.dynamic.method = Method::None;
        let mut slam = Slam::builder(camera()).config(config).build().unwrap();
        let tracked = slam.track(&frame(0, 640)).unwrap();
        assert_eq!(tracked.t_world_cam.is_some(), is_tracked, "{source:?}");
        assert!(slam.features().iter().all(|f| f.depth_m.is_some() == is_tracked), "{source:?}");
    }
}

#[test]
fn stereo_refuses_a_frame_without_a_right_image() {
    let mut config = Config::default();
    config.depth.source = DepthSource::Stereo;
    let mut slam = Slam::builder(camera()).config(config).build().unwrap();
    assert_eq!(slam.track(&frame(0, 640)).unwrap_err(), FrameRejected::NoRightImage);
    let lens = camera().with_distortion([0.1, 0.0, 0.0, 0.0, 0.0]);
    let mut config = Config::default();
    config.depth.source = DepthSource::Stereo;
    assert!(matches!(Slam::builder(lens).config(config).build(), Err(SetupError::NotRectified(_))));
}

/// Returns a stereo frame of two walls: above with a disparity of 52 px, below with 26 px.
fn pair(timestamp_ns: i64) -> Frame {
    let left = frame(timestamp_ns, 640);
    let mut right = RgbImage::new(640, 480);
    for y in 0..480 {
        let disparity = if y < 240 { 52 } else { 26 };
        let width = 640 - disparity;
        right.row_mut(y)[..width].copy_from_slice(&left.color.row(y)[disparity..]);
    }
    Frame::stereo(timestamp_ns, left.color, right).with_detections(Vec::new())
}

#[test]
fn stereo_depth_is_baseline_times_focal_length_by_disparity_the_same_on_every_run() {
    let run = || {
        let mut config = Config::default();
        config.depth.source = DepthSource::Stereo;
        config.dynamic.method = Method::None;
        let camera = camera().with_bf(0.1 * 520.0);
        let mut slam = Slam::builder(camera.clone()).config(config).build().unwrap();
        (0..3).for_each(|k| assert!(slam.track(&pair(k)).unwrap().t_world_cam.is_some()));
        slam.features().to_vec()
    };
    let features = run();
    assert_eq!(features, run());
    // Patches near the step contain both walls.
    let off_step = features.iter().filter(|f| (f.v - 240.0).abs() > 80.0);
    let (mut correct, mut found, mut all) = (0, 0, 0);
    for f in off_step.filter(|f| f.u > 130.0) {
        let wanted_m = if f.v < 240.0 { 1.0 } else { 2.0 };
        all += 1;
        found += usize::from(f.depth_m.is_some());
        correct += usize::from(f.depth_m.is_some_and(|z| (z / wanted_m - 1.0).abs() < 0.03));
    }
    // The extractor does not always choose the same ones of so many similar corners in both images.
    assert!(found * 2 > all && correct * 50 > found * 49, "{correct} correct of {found} found of {all}");
}

/// Returns a frame of a wall 1.8 m away with an object 1 m away in front of it or, later, other parts of the wall.
fn with_object(timestamp_ns: i64, has_object: bool) -> Frame {
    let mut frame = frame(timestamp_ns, 640);
    let (mut color, mut depth) = (frame.color.as_ref().clone(), frame.depth.as_deref().unwrap().clone());
    for y in 160..320 {
        // Another texture than in the rest and than before.
        let from = if has_object { y - 150 } else { y + 150 };
        let other = frame.color.row(from)[7..167].to_vec();
        color.row_mut(y)[240..400].copy_from_slice(&other);
        if has_object {
            depth.raw.row_mut(y)[240..400].fill(5000);
        }
    }
    (frame.color, frame.depth, frame.mask) = (Arc::new(color), Some(Arc::new(depth)), None);
    frame
}

#[test]
fn full_removes_the_landmarks_of_an_object_that_has_left_and_no_others() {
    for (method, removes) in [(Method::Full, true), (Method::None, false)] {
        let mut config = Config::default();
        config.dynamic.method = method;
        let mut slam = Slam::builder(camera()).config(config).build().unwrap();
        let mut track = |i: i64, has_object: bool| {
            assert!(slam.track(&with_object(i * 33_000_000, has_object)).unwrap().t_world_cam.is_some());
            let near = slam.map().landmarks().filter(|(_, l)| l.position.z < 1.2).count();
            (near, slam.map().landmarks().count())
        };
        let (before, all) = (0..5).map(|i| track(i, true)).last().unwrap();
        assert!(before > 30 && all > before + 200, "{before} {all}");
        let (left, others) = (5..25).map(|i| track(i, false)).last().unwrap();
        assert!((left == 0) == removes && others >= all - before, "{method:?}: {left} {others}");
    }
}

/// Returns a frame of a wall beside a screen with another image in each frame.
fn beside_screen(i: i64, is_person: bool) -> Frame {
    let mut frame = frame(i * 33_000_000, 640);
    let (mut color, mut depth) = (frame.color.as_ref().clone(), frame.depth.as_deref().unwrap().clone());
    for y in 0..480 {
        let other = (i as usize * 37 + y * 5) % 480;
        let shown: Vec<[u8; 3]> = frame.color.row(other)[..160].iter().rev().copied().collect();
        color.row_mut(y)[480..].copy_from_slice(&shown);
        depth.raw.row_mut(y)[480..].fill(15_000);
    }
    let bbox = BoundingBox { x_min: 0.0, y_min: 0.0, x_max: 480.0, y_max: 480.0 };
    let wall = is_person.then_some(Detection { class: 0, score: 0.9, bbox });
    frame.detections = Some(wall.into_iter().collect());
    (frame.color, frame.depth, frame.mask) = (Arc::new(color), Some(Arc::new(depth)), None);
    frame
}

#[test]
fn full_keeps_tracking_when_a_false_detection_covers_the_static_scene() {
    for (doubted_box_trust, is_lost) in [(0.0, true), (FullConfig::default().doubted_box_trust, false)] {
        let mut config = Config::default();
        config.dynamic.method = Method::Full;
        config.dynamic.full.doubted_box_trust = doubted_box_trust;
        let mut slam = Slam::builder(camera()).config(config).build().unwrap();
        let poses: Vec<_> = (0..10).map(|i| slam.track(&beside_screen(i, i >= 5)).unwrap().t_world_cam).collect();
        assert!(poses[..5].iter().all(Option::is_some));
        assert_eq!(poses[5..].iter().any(Option::is_none), is_lost, "{doubted_box_trust}: {poses:?}");
        let off_m = poses.iter().flatten().map(|pose| pose.translation.vector.norm()).fold(0.0, f64::max);
        assert!(off_m < 0.02, "{doubted_box_trust}: {off_m}");
        // The features of the wall stay where they are, so that the box is not believed for long.
        let features = &slam.features();
        let mut on_wall = features.iter().filter(|f| f.raw[0] < 460.0);
        assert!(is_lost || on_wall.clone().count() > 100 && on_wall.all(|f| f.trust >= 0.5));
    }
}
