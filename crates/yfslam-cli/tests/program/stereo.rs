//! Stereo cameras: rendered, recorded, and in the layouts of the EuRoC and KITTI benchmarks.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::common::{ate_rmse, fails, report, succeeds};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use yfslam::{Camera, Image, RgbImage};
use yfslam_io::write::{write_color_png, write_mask_png};
use yfslam_synth::World;

/// A small room without people.
const ROOM: &str = "walking_xyz?people=0&width=376&height=240&frames=30";

/// Largest error of a run of [`ROOM`], m. At 3 m, the depth of the room, a tenth of a pixel of disparity is 3 cm at this size; hundreds
/// of points average that to a few millimetres. A wrong baseline, row, lever arm or time stamp causes centimetres.
const MAX_ATE_M: f64 = 0.008;

fn world(spec: &str) -> World {
    World::new(&yfslam_synth::parse(spec).unwrap()).unwrap()
}

/// Runs `sequence` and expects all frames to be tracked; returns its report.
#[track_caller]
fn tracked(folder: &Path, sequence: &str, more: &[&str]) -> Value {
    let out = folder.join("out");
    let args = [&["run", sequence, "--out", "out"], more].concat();
    succeeds(folder, &args);
    let report = report(&out);
    let frames = &report["frames"];
    println!("{sequence} {more:?}: ATE {:.4} m", ate_rmse(&report));
    assert_eq!((&frames["tracked"], &frames["skipped"]), (&frames["read"], &0.into()), "{frames}");
    report
}

#[test]
fn a_rendered_and_a_recorded_stereo_camera_give_the_same_correct_trajectory() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let spec = &format!("{ROOM}&stereo=0.11");
    succeeds(folder.path(), &["synth", spec, "--out", "pairs"]);
    assert!(at("pairs/right/000029.png").is_file() && !at("pairs/depth").exists());
    let recorded = tracked(folder.path(), "pairs", &["--method", "none"]);
    assert!(ate_rmse(&recorded) < MAX_ATE_M);
    let first = fs::read(at("out/trajectory.txt")).unwrap();
    tracked(folder.path(), &format!("synth:{spec}"), &["--method", "none"]);
    assert!(first == fs::read(at("out/trajectory.txt")).unwrap(), "the trajectories differ");
    let info = succeeds(folder.path(), &["info", "pairs"]).stdout;
    assert!(info.contains("TUM RGB-D, stereo") && info.contains("30 left, 30 right images"), "{info}");
    fails(folder.path(), &["run", "pairs", "--sensor", "rgbd"], &["pairs", "has no depth images", "--sensor"]);
    fails(folder.path(), &["run", "pairs", "--dense"], &["--dense needs depth images"]);
    fails(folder.path(), &["run", "pairs", "--sensor", "mono", "--method", "none", "--end", "2"], &["no trajectory"]);
}

#[test]
fn every_method_with_boxes_or_segmentation_drops_people() {
    let folder = tempfile::tempdir().unwrap();
    let crowd = "synth:walking_xyz?people=3&share=0.5&width=320&height=240&frames=60&stereo=0.2";
    succeeds(folder.path(), &["run", crowd, "--method", "none,boxes,yf,full", "--out", "out"]);
    let of = |method: &str| report(&folder.path().join("out").join(method));
    let unfiltered_m = ate_rmse(&of("none"));
    for method in ["boxes", "yf", "full"] {
        let report = of(method);
        let ate_m = ate_rmse(&report);
        println!("{method}: ATE {ate_m:.4} m, unfiltered {unfiltered_m:.4} m");
        assert_eq!(report["frames"]["tracked"], 60, "{method}");
        // With the filters of today it is a tenth.
        assert!(ate_m < unfiltered_m / 3.0, "{method}: {ate_m} m of {unfiltered_m} m");
    }
}

/// The cameras of EuRoC at half their size with their poses relative to the left one, turned by some degrees as real cameras are.
fn euroc_cameras() -> [(Camera, Isometry3<f64>); 2] {
    let camera = |f: f64, cx: f64, cy: f64, k1: f64, k2: f64| {
        Camera::pinhole(376, 240, f, f - 0.7, cx, cy).with_distortion([k1, k2, 2e-4, 2e-5, 0.0]).with_fps(20.0)
    };
    let turn = UnitQuaternion::from_euler_angles(0.014, -0.02, 0.012);
    let mount = Isometry3::from_parts(Translation3::new(0.11, 0.0004, -0.0008), turn);
    [
        (camera(229.3, 183.6, 124.2, -0.283, 0.074), Isometry3::identity()),
        (camera(228.8, 189.9, 127.6, -0.284, 0.075), mount),
    ]
}

fn grey(image: &RgbImage) -> Image<u8> {
    let grey = |[r, g, b]: &[u8; 3]| ((u16::from(*r) + 2 * u16::from(*g) + u16::from(*b)) / 4) as u8;
    Image::from_vec(image.width(), image.height(), image.data().iter().map(grey).collect()).unwrap()
}

/// Writes [`ROOM`] in the layout of EuRoC: grey, distorted, with the ground truth of a body that is not the camera.
fn write_euroc(folder: &Path) {
    let world = world(ROOM);
    let t_body_left = Isometry3::new(Vector3::new(-0.0216, -0.0647, 0.0098), Vector3::new(0.1, -0.2, 1.5));
    let start_ns = 1_403_636_579_763_555_584;
    for (k, (camera, mount)) in euroc_cameras().iter().enumerate() {
        let of_camera = folder.join(format!("mav0/cam{k}"));
        fs::create_dir_all(of_camera.join("data")).unwrap();
        let mut list = "#timestamp [ns],filename\r\n".to_owned();
        for index in 0..world.len() {
            let stamp = start_ns + world.timestamp_ns(index);
            write_mask_png(
                &of_camera.join(format!("data/{stamp}.png")),
                &grey(&world.second_view(index, camera, mount)),
            )
            .unwrap();
            write!(list, "{stamp},{stamp}.png\r\n").unwrap();
        }
        fs::write(of_camera.join("data.csv"), list).unwrap();
        let pose = (t_body_left * mount).to_homogeneous().transpose();
        let rows: Vec<String> = pose.as_slice().iter().map(f64::to_string).collect();
        let [k1, k2, p1, p2, _] = camera.distortion;
        let yaml = format!(
            "#Default values\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{},\n    {}]\nrate_hz: 20\nresolution: [376, \
             240]\ncamera_model: pinhole\nintrinsics: [{}, {}, {}, {}] #fu, fv, cu, cv\ndistortion_model: radial-tangential\n\
             distortion_coefficients: [{k1}, {k2}, {p1}, {p2}]\n",
            rows[..8].join(", "),
            rows[8..].join(", "),
            camera.fx,
            camera.fy,
            camera.cx,
            camera.cy
        );
        fs::write(of_camera.join("sensor.yaml"), yaml).unwrap();
    }
    let mut truth = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], and so on\n".to_owned();
    for index in 0..world.len() {
        let body = world.pose(index) * t_body_left.inverse();
        let (t, q) = (body.translation, body.rotation);
        let stamp = start_ns + world.timestamp_ns(index);
        writeln!(truth, "{stamp},{},{},{},{},{},{},{},0.0,0.0,0.0", t.x, t.y, t.z, q.w, q.i, q.j, q.k).unwrap();
    }
    let of_truth = folder.join("mav0/state_groundtruth_estimate0");
    fs::create_dir_all(&of_truth).unwrap();
    fs::write(of_truth.join("data.csv"), truth).unwrap();
}

#[test]
fn a_euroc_folder_is_rectified_and_evaluated_with_the_ground_truth_of_its_body() {
    let folder = tempfile::tempdir().unwrap();
    write_euroc(&folder.path().join("MH"));
    let info = succeeds(folder.path(), &["info", "MH"]).stdout;
    assert!(info.contains("EuRoC (ASL), stereo") && info.contains("rectified with cam1"), "{info}");
    for sequence in ["MH", "MH/mav0"] {
        let report = tracked(folder.path(), sequence, &["--method", "none"]);
        assert!(ate_rmse(&report) < MAX_ATE_M);
    }
    let yaml = folder.path().join("MH/mav0/cam1/sensor.yaml");
    let text = fs::read_to_string(&yaml).unwrap();
    fs::write(&yaml, text.replace("radial-tangential", "equidistant")).unwrap();
    fails(folder.path(), &["run", "MH"], &["cam1/sensor.yaml", "'equidistant'", "undistort"]);
    fs::remove_file(&yaml).unwrap();
    fails(folder.path(), &["run", "MH"], &["cam1/sensor.yaml", "check the path"]);
}

#[test]
fn a_kitti_folder_is_evaluated_with_the_poses_of_camera_0() {
    let folder = tempfile::tempdir().unwrap();
    let sequence = folder.path().join("sequences/07");
    let world = world(&format!("{ROOM}&stereo=0.2"));
    let (mut times, mut poses) = (String::new(), String::new());
    // The colour cameras stand 6 cm to the left of camera 0.
    let t_cam0_cam2 = Isometry3::translation(-0.06, 0.0, 0.0);
    for index in 0..world.len() {
        let shot = world.frame(index).frame;
        for (camera, image) in [(2, &shot.color), (3, shot.right.as_ref().unwrap())] {
            let of_camera = sequence.join(format!("image_{camera}"));
            fs::create_dir_all(&of_camera).unwrap();
            write_color_png(&of_camera.join(format!("{index:06}.png")), image).unwrap();
        }
        writeln!(times, "{:.6e}", world.timestamp_ns(index) as f64 * 1e-9).unwrap();
        let pose = (world.pose(index) * t_cam0_cam2.inverse()).to_homogeneous().transpose();
        let rows: Vec<String> = pose.as_slice()[..12].iter().map(|v| format!("{v:.9e}")).collect();
        writeln!(poses, "{}", rows.join(" ")).unwrap();
    }
    let c = &world.config().camera;
    let row =
        |k: usize, x: f64| format!("P{k}: {:e} 0 {:e} {:e} 0 {:e} {:e} 0 0 0 1 0\n", c.fx, c.cx, -x * c.fx, c.fy, c.cy);
    let calib: String = [0.0, 0.2, -0.06, 0.14].iter().enumerate().map(|(k, x)| row(k, *x)).collect();
    fs::write(sequence.join("times.txt"), times).unwrap();
    fs::write(sequence.join("calib.txt"), calib).unwrap();
    fs::write(folder.path().join("poses.txt"), &poses).unwrap();
    let evaluated_with = ["--method", "none", "--groundtruth", "poses.txt"];
    let report = tracked(folder.path(), "sequences/07", &evaluated_with);
    assert!(ate_rmse(&report) < MAX_ATE_M);
    let bf = report["camera"]["bf"].as_f64().unwrap();
    assert!((bf / c.bf - 1.0).abs() < 1e-9, "{bf}");
    let info = succeeds(folder.path(), &["info", "sequences/07"]).stdout;
    assert!(info.contains("KITTI odometry, stereo"), "{info}");
    // In the folder of the benchmark they are found without an option.
    fs::create_dir(folder.path().join("poses")).unwrap();
    fs::write(folder.path().join("poses/07.txt"), &poses).unwrap();
    assert!(ate_rmse(&tracked(folder.path(), "sequences/07", &["--method", "none"])) < MAX_ATE_M);
    fs::remove_file(sequence.join("calib.txt")).unwrap();
    fails(folder.path(), &["run", "sequences/07"], &["calib.txt", "check the path"]);
}
