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

/// Writes the cameras of EuRoC as files of Kalibr, ORB-SLAM3 and OpenCV; returns their names. `reversed` exchanges the direction of the pose.
fn write_pairs(folder: &Path, reversed: bool) -> [&'static str; 3] {
    let [(left, _), (right, t_left_right)] = euroc_cameras();
    let numbers = |pose: &Isometry3<f64>| {
        let rows = pose.to_homogeneous().transpose();
        rows.as_slice().iter().map(|value| format!("{value:?}")).collect::<Vec<_>>()
    };
    let (forth, back) = (numbers(&t_left_right), numbers(&t_left_right.inverse()));
    let (of_right, of_left) = if reversed { (back, forth) } else { (forth, back) };
    let rows: Vec<String> = of_left.chunks(4).map(|row| format!("  - [{}]\n", row.join(", "))).collect();
    let kalibr = |name: &str, c: &Camera, motion: &str| {
        let [k1, k2, p1, p2, _] = c.distortion;
        let Camera { fx, fy, cx, cy, .. } = c;
        format!(
            "{name}:\n{motion}  camera_model: pinhole\n  intrinsics: [{fx}, {fy}, {cx}, {cy}]\n  distortion_model: radtan\n\
             \x20 distortion_coeffs: [{k1}, {k2}, {p1}, {p2}]\n  resolution: [376, 240]\n"
        )
    };
    let motion = format!("  T_cn_cnm1:\n{}", rows.concat());
    fs::write(folder.join("kalibr.yaml"), kalibr("cam0", &left, "") + &kalibr("cam1", &right, &motion)).unwrap();
    let mut orb =
        "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.width: 376\nCamera.height: 240\nCamera.fps: 20\n".to_owned();
    let mut opencv = "%YAML:1.0\n---\nimage_width: 376\nimage_height: 240\nfps: 20\n".to_owned();
    let matrix = |key: &str, [rows, cols]: [usize; 2], data: &str| {
        format!("{key}: !!opencv-matrix\n  rows: {rows}\n  cols: {cols}\n  dt: d\n  data: [{data}]\n")
    };
    for (number, c) in [(1, &left), (2, &right)] {
        let [k1, k2, p1, p2, _] = c.distortion;
        for (name, value) in
            [("fx", c.fx), ("fy", c.fy), ("cx", c.cx), ("cy", c.cy), ("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2)]
        {
            writeln!(orb, "Camera{number}.{name}: {value:?}").unwrap();
        }
        opencv +=
            &matrix(&format!("M{number}"), [3, 3], &format!("{}, 0, {}, 0, {}, {}, 0, 0, 1", c.fx, c.cx, c.fy, c.cy));
        opencv += &matrix(&format!("D{number}"), [1, 5], &format!("{k1}, {k2}, {p1}, {p2}, 0"));
    }
    orb += &matrix("Stereo.T_c1_c2", [4, 4], &of_right.join(", "));
    let (r, t): (Vec<_>, Vec<_>) = of_left[..12].iter().enumerate().partition(|(index, _)| index % 4 < 3);
    let joined = |values: Vec<(usize, &String)>| {
        values.into_iter().map(|(_, value)| value.as_str()).collect::<Vec<_>>().join(", ")
    };
    opencv += &(matrix("R", [3, 3], &joined(r)) + &matrix("T", [3, 1], &joined(t)));
    fs::write(folder.join("orb3.yaml"), orb).unwrap();
    fs::write(folder.join("opencv.yaml"), opencv).unwrap();
    ["kalibr.yaml", "orb3.yaml", "opencv.yaml"]
}

#[test]
fn pairs_that_are_not_rectified_are_rectified_by_the_camera_files_of_kalibr_orb_slam3_and_opencv() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    write_euroc(&folder.join("MH"));
    let own = tracked(folder, "MH", &["--method", "none"]);
    let positions = || -> Vec<Vector3<f64>> {
        let read = yfslam_io::TrajectoryFile::read(&folder.join("out/trajectory.txt")).unwrap();
        read.poses.iter().map(|pose| pose.t_world_cam.translation.vector).collect()
    };
    let expected = positions();
    let check = |report: &Value| {
        let [bf, own_bf] = [report, &own].map(|report| report["camera"]["bf"].as_f64().unwrap());
        assert!((bf / own_bf - 1.0).abs() < 1e-9, "{bf} and {own_bf}");
        let apart = positions().iter().zip(&expected).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        println!("{}: {apart} m from the trajectory with sensor.yaml", report["camera_origin"]);
        // Kalibr's files have no rate, on which the spacing of keyframes depends.
        assert!(apart < 1e-4 || report["camera"]["fps"] != 20.0, "{apart} m");
    };
    for file in write_pairs(folder, false) {
        let report = tracked(folder, "MH", &["--method", "none", "--camera", file]);
        assert!(ate_rmse(&report) < MAX_ATE_M, "{file}");
        check(&report);
        let origin = report["camera_origin"].as_str().unwrap();
        assert!(origin.contains("rectified with"), "{origin}");
        let printed = succeeds(folder, &["camera", file]).stdout;
        assert!(printed.contains("rectified when they are read"), "{printed}");
    }
    // The same images as lists of pairs, with the camera file beside them.
    fs::create_dir(folder.join("pairs")).unwrap();
    fs::copy(folder.join("orb3.yaml"), folder.join("pairs/camera.yaml")).unwrap();
    for (name, camera) in [("rgb.txt", "cam0"), ("right.txt", "cam1")] {
        let list = fs::read_to_string(folder.join(format!("MH/mav0/{camera}/data.csv"))).unwrap();
        let stamps = list.lines().skip(1).map(|line| line.split_once(',').unwrap().0);
        let line = |stamp: &str| format!("{}.{} ../MH/mav0/{camera}/data/{stamp}.png\n", &stamp[..10], &stamp[10..]);
        fs::write(folder.join("pairs").join(name), stamps.map(line).collect::<String>()).unwrap();
    }
    succeeds(folder, &["run", "pairs", "--method", "none", "--out", "out"]);
    check(&report(&folder.join("out")));
    let args = ["calibrate", "pairs", "--out", "readout.toml"];
    fails(folder, &args, &["rectified with Camera2.fx", "leave out --out"]);
    for file in write_pairs(folder, true) {
        fails(
            folder,
            &["run", "MH", "--method", "none", "--camera", file],
            &[file, "not to its right", "order of the cameras"],
        );
    }
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
