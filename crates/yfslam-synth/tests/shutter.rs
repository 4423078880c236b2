//! Checks that each row of a rolling image shows the world as it is at the time of that row.
#![allow(clippy::unwrap_used, reason = "a test may")]

use nalgebra::{Isometry3, Point3};
use yfslam::Image;
use yfslam_synth::{SensorConfig, SynthFrame, World, WorldConfig, parse};

/// Returns a small world with a perfect sensor, except for its shutter.
fn config(spec: &str, readout_ms: f64) -> WorldConfig {
    let mut config = parse(&format!("{spec}&width=160&height=120")).unwrap();
    config.light.shadow_rays = 0;
    config.sensor = SensorConfig { readout_ms, ..SensorConfig::perfect() };
    config
}

fn world(spec: &str, readout_ms: f64) -> World {
    World::new(&config(spec, readout_ms)).unwrap()
}

fn same(a: &SynthFrame, b: &SynthFrame) -> bool {
    a.frame.color == b.frame.color
        && a.frame.depth == b.frame.depth
        && a.frame.right == b.frame.right
        && a.instances == b.instances
        && a.exact_depth == b.exact_depth
        && a.boxes == b.boxes
        && a.t_world_cam == b.t_world_cam
}

#[test]
fn a_readout_of_zero_is_the_global_shutter() {
    let (plain, zero) = (world("walking_xyz?seed=2", 0.0), world("walking_xyz?seed=2&readout=0", 0.0));
    assert!(same(&plain.frame(20), &zero.frame(20)));
    let rolling = world("walking_rpy?seed=2&people=2", 30.0);
    assert!(same(&rolling.frame(40), &rolling.frame(40)), "the same frame has the same bits");
    assert!(rolling.frame(40).frame.color != world("walking_rpy?seed=2&people=2", 0.0).frame(40).frame.color);
    assert_eq!(rolling.frame(40).frame.depth_timestamp_ns, Some(rolling.timestamp_ns(40)));
}

/// Returns how many pixels of the static world agree with the surface in `global` within a millimetre, and how many lie elsewhere,
/// if row y of `rolling` has the pose `pose(y)`.
fn compare(
    config: &WorldConfig,
    rolling: &SynthFrame,
    global: &SynthFrame,
    pose: impl Fn(f64) -> Isometry3<f64>,
) -> (usize, usize) {
    let camera = &config.camera;
    let inverse = |x: usize, y: usize| {
        let z = f64::from(*global.exact_depth.get(x, y)?);
        (z > 0.0 && global.instances.get(x, y) == Some(&0)).then(|| 1.0 / z)
    };
    let (mut agree, mut differ) = (0, 0);
    for (x, y) in (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y))) {
        let z = f64::from(*rolling.exact_depth.get(x, y).unwrap());
        if z <= 0.0 || rolling.instances.get(x, y) != Some(&0) {
            continue;
        }
        let [nx, ny] = camera.undistort(x as f64, y as f64);
        let p = global.t_world_cam.inverse() * (pose(y as f64) * Point3::new(nx * z, ny * z, z));
        let [u, v] = camera.distort(p.x / p.z, p.y / p.z);
        if u < 1.0 || v < 1.0 {
            continue;
        }
        let (i, j, fu, fv) = (u as usize, v as usize, u.fract(), v.fract());
        // Inverse depth is linear over a plane; other places are at an edge.
        let around =
            [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1), (i - 1, j), (i, j - 1)].map(|(x, y)| inverse(x, y));
        let [Some(a), Some(b), Some(c), Some(d), Some(left), Some(above)] = around else { continue };
        let bends = [a + d - b - c, left + b - 2.0 * a, above + c - 2.0 * a];
        if bends.iter().any(|bend| bend.abs() > 3e-6) {
            continue;
        }
        let surface = 1.0 / ((a * (1.0 - fu) + b * fu) * (1.0 - fv) + (c * (1.0 - fu) + d * fu) * fv);
        if (surface - p.z).abs() < 0.001 { agree += 1 } else { differ += 1 }
    }
    (agree, differ)
}

#[test]
fn depth_back_projected_with_the_pose_of_its_row_lies_on_the_surfaces_of_the_global_image() {
    for (spec, distortion) in [
        ("walking_rpy?seed=5&people=1", [0.0; 5]),
        ("walking_rpy?seed=6&people=1", [0.2624, -0.9531, -0.0054, 0.0026, 1.1633]),
    ] {
        for readout_ms in [40.0, -40.0] {
            let mut settings = config(spec, readout_ms);
            settings.camera.distortion = distortion;
            let rolling = World::new(&settings).unwrap();
            settings.sensor.readout_ms = 0.0;
            let global = World::new(&settings).unwrap().frame(50);
            let shot = rolling.frame(50);
            assert_eq!(shot.t_world_cam, global.t_world_cam);
            let (agree, differ) = compare(&settings, &shot, &global, |row| rolling.row_pose(50, row));
            // At an edge another surface may be visible.
            assert!(agree > 3_000 && differ * 50 < agree, "{spec}: {agree} agree, {differ} differ");
            let (_, wrong) = compare(&settings, &shot, &global, |_| shot.t_world_cam);
            assert!(wrong > 4 * differ + 1_000, "{spec}: only {wrong} differ with one pose for all rows");
        }
    }
}

/// Returns a row of an image.
fn row<T: Copy + Default>(image: &Image<T>, y: usize) -> Vec<T> {
    (0..image.width()).map(|x| *image.get(x, y).unwrap()).collect()
}

/// Returns how many values differ by more than `most`.
fn count<T: Copy>(a: &[T], b: &[T], differ: impl Fn(T, T) -> bool) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| differ(**a, **b)).count()
}

#[test]
fn a_readout_of_two_frames_has_its_ends_in_the_frames_before_and_after_also_of_people_stereo_and_depth() {
    let two_frames_ms = 2e3 / 30.0;
    let last = 119;
    for (spec, instances) in
        [("walking_static?seed=1&people=3&share=0.5", true), ("walking_xyz?stereo=0.11&seed=2&people=2", false)]
    {
        let global = world(spec, 0.0);
        let [before, now, after] = [39, 40, 41].map(|index| global.frame(index));
        let mut people = 0;
        for sign in [1.0, -1.0] {
            let shot = world(spec, sign * two_frames_ms).frame(40);
            let [first, end] = if sign > 0.0 { [&before, &after] } else { [&after, &before] };
            for (frame, y) in [(first, 0), (end, last)] {
                let masks = [&shot, frame, &now].map(|shot| row(&shot.instances, y));
                people += masks[0].iter().filter(|&&k| k > 0).count();
                assert!(count(&masks[0], &masks[1], |a, b| a != b) <= 1, "{spec}: row {y}");
                let depths = [&shot, frame, &now].map(|shot| row(&shot.exact_depth, y));
                assert!(count(&depths[0], &depths[1], |a, b| (a - b).abs() > 1e-3) <= 1, "{spec}: row {y}");
                let unlike = |a: [u8; 3], b: [u8; 3]| (0..3).any(|k| a[k].abs_diff(b[k]) > 2);
                let colors = [&shot, frame, &now].map(|shot| row(&shot.frame.color, y));
                assert!(count(&colors[0], &colors[1], unlike) <= 2, "{spec}: row {y}");
                assert!(
                    count(&colors[0], &colors[2], unlike) > 5,
                    "{spec}: row {y} is that of the middle of the image"
                );
                if let (Some(a), Some(b)) = (&shot.frame.right, &frame.frame.right) {
                    assert!(count(&row(a, y), &row(b, y), unlike) <= 2, "{spec}: row {y} of the right image");
                }
                if let (Some(a), Some(b)) = (&shot.frame.depth, &frame.frame.depth) {
                    assert!(
                        count(&row(&a.raw, y), &row(&b.raw, y), |a, b| a.abs_diff(b) > 1) <= 1,
                        "{spec}: row {y} of depth"
                    );
                }
            }
        }
        assert!(people > 20 || !instances, "{people} pixels of people at the ends");
    }
}

#[test]
fn depth_has_its_own_readout_about_its_own_stamp_and_a_second_view_the_readout_of_the_first() {
    let spec = "walking_rpy?seed=3&people=2";
    let mut settings = config(spec, 0.0);
    let global = World::new(&settings).unwrap();
    // From frame 40 to frame 42: the middle of the depth image is that of frame 41.
    settings.sensor.depth_offset_s = 1.0 / 30.0;
    settings.sensor.depth_readout_ms = Some(2e3 / 30.0);
    let own = World::new(&settings).unwrap();
    let shot = own.frame(40);
    assert_eq!(shot.frame.color, global.frame(40).frame.color);
    assert_eq!(shot.frame.depth_timestamp_ns, Some(global.timestamp_ns(41)));
    let raw = |shot: &SynthFrame, y| row(&shot.frame.depth.clone().unwrap().raw, y);
    for (index, y) in [(40, 0), (42, 119)] {
        assert!(count(&raw(&shot, y), &raw(&global.frame(index), y), |a, b| a.abs_diff(b) > 1) <= 1, "row {y}");
        let moved = own.depth_row_pose(40, y as f64).inverse() * global.pose(index);
        assert!(moved.translation.vector.norm() < 1e-9 && moved.rotation.angle() < 1e-7);
    }
    // Half as many rows within the same time.
    let (camera, mount) =
        (yfslam::Camera::pinhole(80, 60, 70.0, 70.0, 40.0, 30.0), Isometry3::translation(0.05, 0.0, 0.0));
    let rolling = world(spec, 2e3 / 30.0);
    let view = rolling.second_view(41, &camera, &mount);
    let unlike = |a: [u8; 3], b: [u8; 3]| (0..3).any(|k| a[k].abs_diff(b[k]) > 2);
    for (index, y) in [(40, 0), (42, 59)] {
        let wanted = global.second_view(index, &camera, &mount);
        assert!(count(&row(&view, y), &row(&wanted, y), unlike) <= 2, "row {y}");
    }
}
