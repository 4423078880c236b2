use super::*;
use crate::camera::Camera;
use crate::config::Config;
use crate::image::Image;

const SIDES: [usize; 2] = [160, 120];
const FX: f64 = 150.0;
const FRAME_NS: i64 = 33_000_000;

/// Grey levels without structure in fields of 4 px, moved to the left by `shift` px.
fn texture(shift: usize) -> GrayImage {
    let value = |i: usize| {
        let (x, y) = ((i % SIDES[0] + shift) / 4, i / SIDES[0] / 4);
        let mixed = (x as u32 * 7919 + y as u32 * 104_729).wrapping_mul(2_654_435_761);
        ((mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 24) as u8
    };
    Image::from_vec(SIDES[0], SIDES[1], (0..SIDES[0] * SIDES[1]).map(value).collect()).unwrap()
}

/// Depths of a step in the middle of the image, 2 m and 4 m, changed by `change`, in millimetres.
fn step(change: impl Fn(usize, u16) -> u16) -> DepthImage {
    let value =
        |i: usize| change(i, if i / SIDES[0] < SIDES[1] / 2 { 4000 + (i % 7) as u16 } else { 2000 - (i % 3) as u16 });
    let raw = Image::from_vec(SIDES[0], SIDES[1], (0..SIDES[0] * SIDES[1]).map(value).collect()).unwrap();
    DepthImage { raw, metres_per_unit: 0.001 }
}

/// Frames of a camera that moves to the right by `motion_m` at each of them.
fn checked(images: &[(i64, GrayImage, DepthImage)], motion_m: f64) -> Vec<FrameHealth> {
    let camera = Camera::pinhole(SIDES[0], SIDES[1], FX, FX, 80.0, 60.0);
    let sensor = SensorModel::new(&camera, &Config::default(), &[1.0]);
    let mut check = HealthCheck::default();
    let mut pose = Pose::identity();
    let frame = |(timestamp_ns, gray, depth): &(i64, GrayImage, DepthImage)| {
        pose.translation.vector.x -= motion_m;
        let (timestamp_ns, depth, t_cam_world) = (*timestamp_ns, Some(depth), Some(pose));
        let evidence = Evidence { timestamp_ns, gray, depth, t_cam_world, map_moved: false, contradicted: [10, 100] };
        check.check(&sensor, &evidence)
    };
    images.iter().map(frame).collect()
}

/// A moving camera: the image moves by `shift` px a frame, as at a depth of 4 m.
fn moving(frames: usize, shift: usize) -> Vec<(i64, GrayImage, DepthImage)> {
    let frame = |k: usize| (k as i64 * FRAME_NS, texture(shift * k), step(|_, mm| mm));
    (0..frames).map(frame).collect()
}

fn same_depth(change: impl Fn(usize, u16) -> u16) -> FrameHealth {
    let mut frames = moving(2, 4);
    frames[1].2 = step(change);
    checked(&frames, 4.0 * 4.0 / FX)[1]
}

#[test]
fn a_moving_camera_with_good_depth_shows_no_sign() {
    for health in checked(&moving(5, 4), 4.0 * 4.0 / FX) {
        assert_eq!(health, FrameHealth::default());
    }
}

#[test]
fn depth_that_is_missing_saturated_or_noise_is_found() {
    assert!(same_depth(|i, mm| if i % 16 == 0 { mm } else { 0 }).depth_missing);
    assert!(same_depth(|i, mm| if i / SIDES[0] < 40 { u16::MAX } else { mm }).depth_saturated);
    let noise = |i: usize, mm: u16| {
        let bits = (i as u32).wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(0x85eb_ca6b) >> 16;
        (f64::from(mm) * (0.8 + 0.4 * f64::from(bits) / 65536.0)) as u16
    };
    let health = same_depth(noise);
    assert!(health.depth_noisy && !health.depth_missing && !health.depth_saturated, "{health:?}");
}

#[test]
fn depth_of_another_scale_contradicts_the_frame_before() {
    assert!(same_depth(|_, mm| mm / 2).depth_contradicts);
    assert!(!same_depth(|_, mm| mm + mm / 50).depth_contradicts, "within the noise");
}

#[test]
fn features_whose_depth_contradicts_their_position_are_a_sign() {
    let sensor = SensorModel::new(&Camera::pinhole(SIDES[0], SIDES[1], FX, FX, 80.0, 60.0), &Config::default(), &[1.0]);
    let of = |contradicted| {
        let gray = texture(0);
        let now =
            Evidence { timestamp_ns: 0, gray: &gray, depth: None, t_cam_world: None, map_moved: false, contradicted };
        HealthCheck::default().check(&sensor, &now).depth_contradicts
    };
    assert!(of([60, 100]) && !of([30, 100]) && !of([20, 30]));
}

#[test]
fn an_image_that_stands_still_while_the_pose_moves_is_found() {
    let mut frames = moving(2, 0);
    frames[1].1.data_mut()[0] ^= 1;
    assert!(checked(&frames, 0.1)[1].stands_still);
    assert!(!checked(&frames, 0.0)[1].stands_still, "the pose stands still, too");
}

#[test]
fn a_plane_that_fills_the_view_a_repeated_image_and_a_gap_are_found() {
    // Inverse depth is an affine function of the column on a slanted wall.
    let wall = |i: usize, _: u16| (1000.0 / (0.3 + 0.002 * (i % SIDES[0]) as f64)) as u16;
    assert!(same_depth(wall).plane_fills_view && !same_depth(|_, mm| mm).plane_fills_view);
    let repeated = checked(&moving(2, 0), 0.0);
    assert!(!repeated[0].image_repeated && repeated[1].image_repeated);
    let mut frames = moving(7, 4);
    frames[5].0 += 400_000_000;
    frames[6].0 += 400_000_000;
    let gaps: Vec<bool> = checked(&frames, 4.0 * 4.0 / FX).iter().map(|health| health.time_gap).collect();
    assert_eq!(gaps, [false, false, false, false, false, true, false]);
}
