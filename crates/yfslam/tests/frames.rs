//! What comes with a frame besides its picture: masks of movable objects, and depth that may be left unused.
#![allow(clippy::unwrap_used, reason = "a test may")]

use std::sync::Arc;

use yfslam::camera::Camera;
use yfslam::config::DepthSource;
use yfslam::dynamic::Method;
use yfslam::image::{DepthImage, Image, RgbImage};
use yfslam::system::FrameRejected;
use yfslam::{Config, RgbdFrame, Slam};

/// A grained picture of a wall, with a mask of the given width.
fn frame(timestamp_ns: i64, mask_width: usize) -> RgbdFrame {
    let grain = |i: usize| (((i / 640 / 6 * 31 + i % 640 / 6 * 17) * 2_654_435_761) >> 7) as u8;
    let mut raw = Image::new(640, 480);
    raw.data_mut().fill(9000u16);
    let mut mask = Image::new(mask_width, 480);
    (100..400).for_each(|y| mask.row_mut(y)[..mask_width / 2].fill(1));
    RgbdFrame {
        timestamp_ns,
        color: Arc::new(RgbImage::from_vec(640, 480, (0..640 * 480).map(|i| [grain(i); 3]).collect()).unwrap()),
        depth: Arc::new(DepthImage { raw, metres_per_unit: 1.0 / 5000.0 }),
        right: None,
        detections: Some(Vec::new()),
        mask: Some(Arc::new(mask)),
    }
}

fn camera() -> Camera {
    let (fx, fy, cx, cy) = (520.0, 520.0, 320.0, 240.0);
    Camera { width: 640, height: 480, fx, fy, cx, cy, distortion: [0.0; 5], depth_factor: 5000.0, fps: 30.0, bf: 40.0 }
}

#[test]
fn features_on_a_mask_are_distrusted_and_a_mask_of_another_size_is_refused() {
    let mut config = Config::default();
    config.dynamic.method = Method::Full;
    let mut slam = Slam::new(config, &camera(), None).unwrap();
    slam.track(&frame(0, 640)).unwrap();
    let masked = |x: f32, y: f32| x < 320.0 && (100.0..400.0).contains(&y);
    let features = &slam.last_frame().features.features;
    let on = features.iter().filter(|f| masked(f.raw[0], f.raw[1]));
    assert!(on.clone().count() > 50 && on.clone().all(|f| f.trust == 0.0));
    assert!(features.iter().filter(|f| f.raw[0] > 400.0).all(|f| f.trust > 0.0));
    let refused = slam.track(&frame(1, 320)).unwrap_err();
    assert!(matches!(refused, FrameRejected::Size { image: "mask", width: 320, .. }), "{refused}");
}

#[test]
fn depth_is_used_only_where_it_is_to_come_from_an_image() {
    for (source, tracks) in [(DepthSource::Image, true), (DepthSource::Motion, false)] {
        let mut config = Config::default();
        config.depth.source = source;
        config.dynamic.method = Method::None;
        let mut slam = Slam::new(config, &camera(), None).unwrap();
        let tracked = slam.track(&frame(0, 640)).unwrap();
        assert_eq!(tracked.t_world_cam.is_some(), tracks, "{source:?}");
        assert!(slam.last_frame().features.features.iter().all(|f| f.depth_m.is_some() == tracks), "{source:?}");
    }
}

#[test]
fn a_frame_without_a_right_picture_is_refused_where_depth_is_to_come_from_one() {
    let mut config = Config::default();
    config.depth.source = DepthSource::Stereo;
    let mut slam = Slam::new(config, &camera(), None).unwrap();
    assert_eq!(slam.track(&frame(0, 640)).unwrap_err(), FrameRejected::NoRightPicture);
}
