//! Checks the ground truth of the synthetic world: geometry, masks, boxes, repeatability.
#![allow(clippy::unwrap_used, reason = "a test may")]

use nalgebra::Point3;
use yfslam::Camera;
use yfslam_synth::{CameraMotion, SceneKind, SensorConfig, SynthFrame, World, WorldConfig, parse};

/// Returns a small, noise-free world without baked shadows, which take most of the set-up time.
fn config(spec: &str) -> WorldConfig {
    let mut config = parse(&format!("{spec}&width=320&height=240")).unwrap();
    config.light.shadow_rays = 0;
    config.sensor = SensorConfig::perfect();
    config
}

fn world(spec: &str) -> World {
    World::new(&config(spec)).unwrap()
}

fn same(a: &SynthFrame, b: &SynthFrame) -> bool {
    a.frame.color == b.frame.color
        && a.frame.depth == b.frame.depth
        && a.instances == b.instances
        && a.exact_depth == b.exact_depth
        && a.boxes == b.boxes
        && a.t_world_cam == b.t_world_cam
}

/// Returns the point of the world at pixel (x, y) of `shot`.
fn back_project(camera: &Camera, shot: &SynthFrame, x: usize, y: usize) -> Option<Point3<f64>> {
    let z = f64::from(*shot.exact_depth.get(x, y)?);
    let [nx, ny] = camera.undistort(x as f64, y as f64);
    (z > 0.0).then(|| shot.t_world_cam * Point3::new(nx * z, ny * z, z))
}

/// Returns the depth of `shot` at a position between pixels, if the 4 × 4 pixels around it lie on one plane.
fn depth_between(shot: &SynthFrame, u: f64, v: f64) -> Option<f64> {
    let (x, y) = (u.floor(), v.floor());
    if x < 1.0 || y < 1.0 {
        return None;
    }
    let (x, y, fx, fy) = (x as usize, y as usize, u - x, v - y);
    // Inverse depth is linear over the image of a plane.
    let w = |dx: usize, dy: usize| -> Option<f64> {
        let z = f64::from(*shot.exact_depth.get(x + dx - 1, y + dy - 1)?);
        (z > 0.0).then(|| 1.0 / z)
    };
    for k in 0..4 {
        for i in 0..2 {
            let across = w(i, k)? - 2.0 * w(i + 1, k)? + w(i + 2, k)?;
            let down = w(k, i)? - 2.0 * w(k, i + 1)? + w(k, i + 2)?;
            if across.abs().max(down.abs()) > 3e-6 {
                return None;
            }
        }
    }
    let top = w(1, 1)? * (1.0 - fx) + w(2, 1)? * fx;
    let bottom = w(1, 2)? * (1.0 - fx) + w(2, 2)? * fx;
    Some(1.0 / (top * (1.0 - fy) + bottom * fy))
}

/// Returns the numbers of compared pixels: those that agree within a millimetre, that are hidden in the second frame, and that lie
/// behind its surface.
fn compare(camera: &Camera, a: &SynthFrame, b: &SynthFrame) -> (usize, usize, usize) {
    let (mut agree, mut hidden, mut through) = (0, 0, 0);
    for (x, y) in (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y))) {
        if a.instances.get(x, y) != Some(&0) {
            continue;
        }
        let Some(point) = back_project(camera, a, x, y) else { continue };
        let p = b.t_world_cam.inverse() * point;
        if p.z < 0.1 {
            continue;
        }
        let [u, v] = camera.distort(p.x / p.z, p.y / p.z);
        let Some(z) = depth_between(b, u, v) else { continue };
        if b.instances.get(u.round() as usize, v.round() as usize) != Some(&0) {
            continue;
        }
        match z - p.z {
            d if d.abs() < 0.001 => agree += 1,
            d if d < 0.0 => hidden += 1,
            _ => through += 1,
        }
    }
    (agree, hidden, through)
}

fn static_pixels_agree(config: &WorldConfig) {
    let world = World::new(config).unwrap();
    let shots: Vec<SynthFrame> = [0, 40, 95, 150].into_iter().map(|i| world.frame(i)).collect();
    for (i, a) in shots.iter().enumerate() {
        for b in shots.iter().skip(i + 1) {
            let (agree, hidden, through) = compare(&config.camera, a, b);
            assert!(agree > 10_000, "only {agree} pixels compared");
            assert!(hidden < agree / 5, "{hidden} hidden of {agree}");
            assert_eq!(through, 0, "pixels lie behind the surface of the other frame");
        }
    }
}

#[test]
fn exact_depth_of_static_pixels_agrees_between_frames_within_a_millimetre() {
    static_pixels_agree(&config("walking_xyz?seed=4&people=2"));
    static_pixels_agree(&config("walking_rpy?seed=5&people=3"));
}

#[test]
fn exact_depth_agrees_through_a_distorting_lens_too() {
    let mut config = config("walking_xyz?seed=6&people=1");
    // The lens of freiburg1: strong, with all five coefficients.
    config.camera.distortion = [0.2624, -0.9531, -0.0054, 0.0026, 1.1633];
    static_pixels_agree(&config);
}

/// Returns views of the empty `scene` at three moments of every motion.
fn views_of(scene: &str) -> Vec<(WorldConfig, Vec<SynthFrame>)> {
    let shoot = |(motion, _): &(&str, CameraMotion)| {
        let config = config(&format!("sitting_xyz?seed=3&people=0&frames=1300&scene={scene}&motion={motion}"));
        let world = World::new(&config).unwrap();
        let shots = [310, 318, 345].into_iter().map(|i| world.frame(i)).collect();
        (config, shots)
    };
    CameraMotion::ALL.iter().map(shoot).collect()
}

#[test]
fn exact_depth_agrees_between_frames_in_every_scene_and_motion() {
    for (scene, _) in SceneKind::ALL {
        for (config, shots) in views_of(scene) {
            for (a, b) in [(0, 1), (1, 0), (0, 2), (2, 1)] {
                let (agree, hidden, through) = compare(&config.camera, &shots[a], &shots[b]);
                let what = format!("{scene} {:?}, shots {a} and {b}: {agree}, {hidden}, {through}", config.motion);
                assert!(agree > 8_000, "too few compared: {what}");
                assert!(hidden < agree / 5, "too many hidden: {what}");
                // A rod thinner than a pixel may be visible in one frame and missing in the other.
                assert!(through * 1000 <= agree, "seen through: {what}");
            }
        }
    }
}

#[test]
fn a_pose_error_of_three_millimetres_would_be_detected() {
    let config = config("walking_xyz?seed=4&people=0");
    let world = World::new(&config).unwrap();
    let (a, mut b) = (world.frame(0), world.frame(40));
    b.t_world_cam.translation.y += 0.003;
    let (agree, _, through) = compare(&config.camera, &a, &b);
    assert!(through > agree, "{agree} agree, {through} do not");
}

#[test]
fn every_scene_is_closed_and_the_path_of_the_camera_is_free() {
    for (scene, _) in SceneKind::ALL {
        for motion in ["drive", "loop", "xyz", "halfsphere"] {
            let spec = format!("sitting_xyz?people=0&frames=1300&scene={scene}&motion={motion}&width=64&height=48");
            let mut config = parse(&spec).unwrap();
            config.light.shadow_rays = 0;
            let world = World::new(&config).unwrap();
            for index in (0..1300).step_by(26) {
                let shot = world.frame(index);
                let nearest = shot.exact_depth.data().iter().copied().fold(f32::INFINITY, f32::min);
                assert!(nearest > 0.25, "{scene} {motion}, frame {index}: {nearest} m");
                assert!(shot.exact_depth.data().iter().all(|z| z.is_finite()));
            }
        }
    }
}

/// Returns the first frame after which a tour passes its first pose again, its distance and angle from it, and the length of the
/// path until then.
fn lap(world: &World) -> (usize, f64, f64, f64) {
    let first = world.pose(0);
    let away = |i: usize| first.inverse() * world.pose(i);
    let left = (1..).find(|&i| away(i).translation.vector.norm() > 1.0).unwrap();
    let back = (left..left + 4000).find(|&i| {
        let [here, next] = [away(i), away(i + 1)].map(|t| t.translation.vector.norm());
        here < 0.2 && next > here
    });
    let back = back.unwrap();
    let step = |i: usize| (world.pose(i).translation.vector - world.pose(i + 1).translation.vector).norm();
    (back, away(back).translation.vector.norm(), away(back).rotation.angle(), (0..back).map(step).sum())
}

#[test]
fn a_loop_passes_its_start_again_in_the_same_direction() {
    for (scene, _) in SceneKind::ALL {
        for motion in ["loop", "drive"] {
            let world = world(&format!("sitting_xyz?people=0&frames=1300&shake=0&scene={scene}&motion={motion}"));
            let (frames, distance, angle, way) = lap(&world);
            let what = format!("{scene} {motion}: {way:.1} m in {frames} frames");
            assert!(distance < 0.03 && angle < 0.03, "{what}: {distance} m and {angle} rad off");
        }
    }
}

#[test]
fn the_corridor_is_over_forty_metres_around_and_fits_into_1300_frames() {
    let (frames, _, _, way) = lap(&world("sitting_xyz?people=0&frames=1300&scene=corridor&motion=loop&shake=0"));
    assert!(way > 40.0, "{way} m");
    assert!((1150..1270).contains(&frames), "{frames} frames");
    let rushed = lap(&world("sitting_xyz?people=0&frames=300&scene=corridor&motion=loop&shake=0"));
    assert!(rushed.0 > 1000, "{} frames for {way} m are too few", rushed.0);
}

#[test]
fn flickering_light_changes_the_image_and_nothing_else() {
    let bright = |shot: &SynthFrame| {
        shot.frame.color.data().iter().map(|p| f64::from(p[1])).sum::<f64>() / shot.frame.color.data().len() as f64
    };
    let steady = world("walking_static?seed=5&people=1&scene=rescue");
    let changing = world("walking_static?seed=5&people=1&scene=rescue&flicker=0.8");
    let mut ratios = Vec::new();
    for index in (0..300).step_by(30) {
        let (a, b) = (steady.frame(index), changing.frame(index));
        assert!(a.exact_depth == b.exact_depth && a.instances == b.instances && a.boxes == b.boxes);
        ratios.push(bright(&b) / bright(&a));
    }
    let (low, high) = ratios.iter().fold((f64::INFINITY, 0.0f64), |(l, h), &r| (l.min(r), h.max(r)));
    assert!(low > 0.4 && high < 1.2 && high - low > 0.05, "{ratios:?}");
}

#[test]
fn people_are_the_only_difference_to_the_empty_world() {
    let (full, empty) = (world("walking_xyz?seed=8&people=3&share=0.3"), world("walking_xyz?seed=8&people=0"));
    let mut seen = 0;
    for index in [0, 77, 160, 250] {
        let (with, without) = (full.frame(index), empty.frame(index));
        assert_eq!(with.t_world_cam, without.t_world_cam);
        assert!(without.instances.data().iter().all(|&k| k == 0) && without.boxes.is_empty());
        let depths = with.exact_depth.data().iter().zip(without.exact_depth.data());
        for ((z, background), &instance) in depths.zip(with.instances.data()) {
            if instance == 0 {
                assert_eq!(z, background);
            } else {
                assert!(z < background, "person {instance} at {z} m is behind the room at {background} m");
                seen += 1;
            }
        }
    }
    assert!(seen > 10_000, "{seen} pixels of people make no test");
}

#[test]
fn boxes_are_the_tight_bounds_of_the_masks_and_detections_repeat_them() {
    let world = world("walking_xyz?seed=9&people=4&share=0.3&boxes=on");
    let least = world.config().min_person_px as f64 / 4.0;
    let mut boxes = 0;
    for index in (0..300).step_by(50) {
        let shot = world.frame(index);
        for person in 1..=4u8 {
            let pixels: Vec<(f32, f32)> = (0..240)
                .flat_map(|y| (0..320).map(move |x| (x, y)))
                .filter(|&(x, y)| shot.instances.get(x, y) == Some(&person))
                .map(|(x, y)| (x as f32, y as f32))
                .collect();
            let found = shot.boxes.iter().find(|(k, ..)| *k == person);
            assert_eq!(found.is_some(), pixels.len() as f64 >= least, "person {person}: {} pixels", pixels.len());
            if let Some((_, _, bbox)) = found {
                boxes += 1;
                assert!(pixels.iter().all(|&(x, y)| bbox.contains(x, y)));
                for (edge, reached) in [
                    (bbox.x_min, pixels.iter().map(|p| p.0).fold(f32::INFINITY, f32::min)),
                    (bbox.y_min, pixels.iter().map(|p| p.1).fold(f32::INFINITY, f32::min)),
                    (bbox.x_max, pixels.iter().map(|p| p.0 + 1.0).fold(0.0, f32::max)),
                    (bbox.y_max, pixels.iter().map(|p| p.1 + 1.0).fold(0.0, f32::max)),
                ] {
                    assert_eq!(edge, reached);
                }
            }
        }
        let detections = shot.frame.detections.unwrap();
        assert_eq!(detections.len(), shot.boxes.len());
        for (detection, (_, _, bbox)) in detections.iter().zip(&shot.boxes) {
            assert_eq!((detection.class, detection.score, detection.bbox), (0, 1.0, *bbox));
        }
    }
    assert!(boxes >= 6, "{boxes} boxes make no test");
    assert!(self::world("walking_xyz?seed=9&boxes=off").frame(0).frame.detections.is_none());
}

#[test]
fn the_same_seed_gives_the_same_bits_in_any_order_and_another_seed_does_not() {
    let spec = "sitting_halfsphere?seed=11&people=3";
    let mut noisy = config(spec);
    noisy.sensor = SensorConfig::default();
    let (first, second) = (World::new(&noisy).unwrap(), World::new(&noisy).unwrap());
    let forward: Vec<SynthFrame> = [3, 60, 200].into_iter().map(|i| first.frame(i)).collect();
    for (index, shot) in [200, 60, 3].into_iter().zip(forward.iter().rev()) {
        assert!(same(&second.frame(index), shot), "frame {index} differs");
    }
    let other = World::new(&WorldConfig { seed: 12, ..noisy }).unwrap();
    assert!(!same(&other.frame(3), &forward[0]));
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let mut config = config("walking_halfsphere?seed=13&people=4&robots=1&chair=on&carry=on&moved=on");
    config.sensor = SensorConfig::default();
    config.light.shadow_rays = 1;
    let render = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| World::new(&config).unwrap().frame(42))
    };
    let one = render(1);
    assert!(same(&one, &render(2)) && same(&one, &render(5)));
}

#[test]
fn a_surface_keeps_its_colour_while_the_camera_moves() {
    let config = config("walking_xyz?seed=14&people=0");
    let world = World::new(&config).unwrap();
    let (a, b) = (world.frame(0), world.frame(20));
    let mut differences = Vec::new();
    for (x, y) in (0..240).flat_map(|y| (0..320).map(move |x| (x, y))) {
        let Some(point) = back_project(&config.camera, &a, x, y) else { continue };
        let p = b.t_world_cam.inverse() * point;
        let [u, v] = config.camera.distort(p.x / p.z, p.y / p.z);
        let Some(z) = depth_between(&b, u, v) else { continue };
        let (column, row) = (u.round() as usize, v.round() as usize);
        if let (true, Some(ca), Some(cb)) =
            ((z - p.z).abs() < 0.001, a.frame.color.get(x, y), b.frame.color.get(column, row))
        {
            differences.push(ca[1].abs_diff(cb[1]));
        }
    }
    assert!(differences.len() > 20_000, "only {} pixels compared", differences.len());
    differences.sort_unstable();
    // This includes half a pixel of rounding.
    let median = differences[differences.len() / 2];
    assert!(median <= 5, "median difference {median}");
}

#[test]
fn people_cover_the_requested_share_of_the_view() {
    for (people, wanted) in [(2, 0.1), (2, 0.2), (4, 0.3)] {
        let world = world(&format!("walking_xyz?seed=15&people={people}&share={wanted}"));
        let shares = (0..300).step_by(10).map(|i| {
            let shot = world.frame(i);
            shot.instances.data().iter().filter(|&&k| k > 0).count() as f64 / (320.0 * 240.0)
        });
        let mean = shares.sum::<f64>() / 30.0;
        assert!((mean - wanted).abs() < 0.03, "{mean} instead of {wanted}");
        assert!((mean - world.person_share()).abs() < 0.03, "{mean} is not the reported {}", world.person_share());
    }
}

#[test]
fn timestamps_follow_the_frame_rate() {
    let world = world("walking_static?seed=1&people=0&fps=30&frames=4");
    let times: Vec<i64> = (0..world.len()).map(|i| world.frame(i).frame.timestamp_ns).collect();
    assert_eq!(times, [0, 33_333_333, 66_666_667, 100_000_000]);
}

/// Returns whether nine neighbours in a row on the circle of radius 3 are all brighter or all darker by 20 (FAST-9).
fn is_corner(grey: &dyn Fn(usize, usize) -> i32, x: usize, y: usize) -> bool {
    const CIRCLE: [(i32, i32); 16] = [
        (0, -3),
        (1, -3),
        (2, -2),
        (3, -1),
        (3, 0),
        (3, 1),
        (2, 2),
        (1, 3),
        (0, 3),
        (-1, 3),
        (-2, 2),
        (-3, 1),
        (-3, 0),
        (-3, -1),
        (-2, -2),
        (-1, -3),
    ];
    let center = grey(x, y);
    let differences = CIRCLE.map(|(dx, dy)| grey((x as i32 + dx) as usize, (y as i32 + dy) as usize) - center);
    [1, -1].into_iter().any(|sign| (0..16).any(|start| (0..9).all(|k| sign * differences[(start + k) % 16] > 20)))
}

#[test]
fn corners_cover_the_image_at_several_scales() {
    for seed in [1, 2, 3, 16] {
        let mut config = config(&format!("walking_xyz?seed={seed}&people=0"));
        config.light.shadow_rays = 2;
        config.sensor.color_noise = 1.5;
        let image = World::new(&config).unwrap().frame(30).frame.color;
        for shrink in [1, 2, 3] {
            // Box-filtered to 1/shrink of the size.
            let grey = |x: usize, y: usize| -> i32 {
                let block =
                    (0..shrink * shrink).filter_map(|i| image.get(x * shrink + i % shrink, y * shrink + i / shrink));
                block.map(|p| i32::from(p[1])).sum::<i32>() / (shrink * shrink) as i32
            };
            let (width, height) = (320 / shrink, 240 / shrink);
            let mut rows = [[false; 8]; 6];
            for (x, y) in (3..height - 3).flat_map(|y| (3..width - 3).map(move |x| (x, y))) {
                rows[y * 6 / height][x * 8 / width] |= is_corner(&grey, x, y);
            }
            let filled = |rows: &[[bool; 8]]| rows.as_flattened().iter().filter(|&&filled| filled).count();
            // The first row shows the ceiling, whose fine holes are blurred at smaller sizes; the last one carpet and shadows.
            let (all, below) = (filled(&rows), filled(&rows[1..]));
            assert!(below >= 35, "seed {seed}: at 1/{shrink} of the size {below} of 40 cells have a corner: {rows:?}");
            assert!(shrink > 1 || all >= 40, "seed {seed}: at full size {all} of 48 cells have a corner: {rows:?}");
        }
    }
}

#[test]
fn depth_with_an_offset_of_one_frame_is_the_depth_of_the_next_frame_with_its_stamp() {
    let now = config("walking_xyz?seed=17&people=2&share=0.2");
    let mut lagging = now.clone();
    lagging.sensor.depth_offset_s = 1.0 / 30.0;
    let (now, lagging) = (World::new(&now).unwrap(), World::new(&lagging).unwrap());
    let (first, second, lagged) = (now.frame(40), now.frame(41), lagging.frame(40));
    assert!((lagged.depth_timestamp_ns - second.frame.timestamp_ns).abs() <= 1);
    assert_eq!(lagged.frame.color, first.frame.color);
    assert_eq!(lagged.exact_depth, first.exact_depth);
    let raw = |shot: &SynthFrame| shot.frame.depth.clone().unwrap().raw.data().to_vec();
    let depths = raw(&lagged).into_iter().zip(raw(&second));
    // A pose that differs in the last digit may move a pixel over an edge.
    let differ = depths.filter(|(a, b)| a.abs_diff(*b) > 1).count();
    assert!(differ < 20, "{differ} pixels differ");
}

/// Returns the bilinear grey level at a position between pixels.
fn grey_between(image: &yfslam::RgbImage, u: f64, y: usize) -> Option<f64> {
    let grey = |x: usize| Some(image.get(x, y)?.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0);
    let x = u.floor();
    (x >= 0.0).then(|| Some(grey(x as usize)? * (1.0 - u + x) + grey(x as usize + 1)? * (u - x)))?
}

#[test]
fn a_point_in_the_right_image_is_shifted_by_the_disparity_of_baseline_and_depth() {
    let config = config("walking_xyz?people=1&stereo=0.11");
    let bf = 0.11 * config.camera.fx;
    let shot = World::new(&config).unwrap().frame(40);
    let right = shot.frame.right.as_ref().unwrap();
    assert!(shot.frame.depth.is_none(), "a stereo camera has no depth image");
    // Sum of squared differences of the images shifted against each other by the disparity and slightly more.
    let differ = |more: f64| {
        let (mut sum, mut count) = (0.0, 0);
        for y in 0..240 {
            for x in 60..319 {
                // Only within surfaces: at their edges one camera may see a surface that is hidden from the other.
                let Some(z) = depth_between(&shot, x as f64, y as f64) else { continue };
                let there = grey_between(right, x as f64 - bf / z + more, y);
                let Some((here, there)) = grey_between(&shot.frame.color, x as f64, y).zip(there) else { continue };
                if (here - there).abs() < 20.0 {
                    (sum, count) = (sum + (here - there).powi(2), count + 1);
                }
            }
        }
        assert!(count > 20_000, "{count} pixels");
        sum / f64::from(count)
    };
    let [less, exact, more] = [-0.5, 0.0, 0.5].map(differ);
    let best = 0.25 * (less - more) / (less - 2.0 * exact + more);
    assert!(exact < 0.5 * less.min(more) && best.abs() < 0.05, "{less} {exact} {more}: {best} px off");
}
