//! One camera, written in every dialect that is understood, is read with the same numbers; what is not supported is refused by its key.

#![allow(clippy::unwrap_used, reason = "a test may")]

use std::path::{Path, PathBuf};

use yfslam::Camera;
use yfslam::config::DepthSource;
use yfslam_io::camera::parse_camera;
use yfslam_io::{CameraSource, load_camera};

/// The camera that all files describe, where a dialect can.
fn camera() -> Camera {
    Camera::pinhole(640, 480, 611.5, 612.25, 318.75, 243.5).with_distortion([0.11, -0.23, 0.0012, -0.0007, 0.05])
}

fn parse(name: &str, text: &str) -> CameraSource {
    parse_camera(text, Path::new(name)).unwrap_or_else(|error| panic!("{name}: {error}\n{text}"))
}

fn refusal(name: &str, text: &str) -> String {
    match parse_camera(text, Path::new(name)) {
        Ok(source) => panic!("{name} was read: {source:?}"),
        Err(error) => error.to_string(),
    }
}

/// What a dialect can say besides fx, fy, cx and cy.
#[derive(Clone, Copy, Default)]
struct Says {
    size: bool,
    /// Number of coefficients.
    lens: usize,
    depth_factor: Option<f64>,
    fps: Option<f64>,
    /// Baseline, m.
    baseline_m: Option<f64>,
}

fn check(kind: &str, name: &str, text: &str, says: Says) {
    let source = parse(name, text);
    let (found, wanted) = (&source.camera, camera());
    assert_eq!(source.kind, kind, "{name}");
    let near = |what: &str, found: f64, wanted: f64| {
        assert!((found - wanted).abs() < 1e-9, "{name}: {what} {found}, not {wanted}")
    };
    near("fx", found.fx, wanted.fx);
    near("fy", found.fy, wanted.fy);
    near("cx", found.cx, wanted.cx);
    near("cy", found.cy, wanted.cy);
    for (at, (found, wanted)) in found.distortion.iter().zip(wanted.distortion).enumerate() {
        near("distortion", *found, if at < says.lens { wanted } else { 0.0 });
    }
    assert_eq!(source.missing.size, !says.size, "{name}");
    assert_eq!([found.width, found.height], if says.size { [640, 480] } else { [0, 0] }, "{name}");
    assert_eq!(source.missing.depth_factor, says.depth_factor.is_none(), "{name}");
    near("depth factor", source.depth_factor, says.depth_factor.unwrap_or(1.0));
    near("fps", found.fps, says.fps.unwrap_or(30.0));
    assert_eq!(source.missing.baseline, says.baseline_m.is_none(), "{name}");
    near("bf", found.bf, says.baseline_m.map_or(40.0, |baseline_m| baseline_m * wanted.fx));
    assert_eq!(source.missing.stereo_problem, None, "{name}");
}

const K: &str = "611.5, 0., 318.75, 0., 612.25, 243.5, 0., 0., 1.";
const D: &str = "0.11, -0.23, 0.0012, -0.0007, 0.05";

#[test]
fn a_camera_is_the_same_in_every_dialect() {
    let lens5 = Says { size: true, lens: 5, ..Says::default() };
    let lens4 = Says { lens: 4, ..lens5 };
    let toml = "# ours\nfx = 611.5\nfy = 612.25\ncx = 318.75\ncy = 243.5\nwidth = 640\nheight = 480\n\
        distortion = [0.11, -0.23, 0.0012, -0.0007, 0.05]\ndepth_factor = 5000.0\nfps = 25.0\nbf = 61.15\n";
    let all = Says { depth_factor: Some(5000.0), fps: Some(25.0), baseline_m: Some(0.1), ..lens5 };
    check("TOML", "a.toml", toml, all);
    check("TOML", "toml-by-content.txt", toml, all);
    check(
        "ORB-SLAM settings",
        "orb2.yaml",
        "%YAML:1.0\n\n# Camera of a robot\nCamera.fx: 611.5\nCamera.fy: 612.25\nCamera.cx: 318.75\nCamera.cy: 243.5\n\nCamera.k1: 0.11\n\
         Camera.k2: -0.23\nCamera.p1: 0.0012\nCamera.p2: -0.0007\nCamera.k3: 0.05\nCamera.width: 640\nCamera.height: 480\n\
         Camera.fps: 25.0\nCamera.bf: 61.15\nCamera.RGB: 1\nDepthMapFactor: 5000.0\nORBextractor.nFeatures: 1000\nViewer.PointSize:2\n",
        all,
    );
    check(
        "ORB-SLAM settings",
        "orb3.yaml",
        "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 611.5\nCamera1.fy: 612.25\nCamera1.cx: 318.75\n\
         Camera1.cy: 243.5\nCamera1.k1: 0.11\nCamera1.k2: -0.23\nCamera1.p1: 0.0012\nCamera1.p2: -0.0007\nCamera1.k3: 0.05\n\
         Camera.width: 640\nCamera.height: 480\nCamera.fps: 25\nStereo.b: 0.1\nRGBD.DepthMapFactor: 5000.0\n\
         IMU.T_b_c1: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n   data: [1., 0., 0., 0.,\n          0., 1., 0., 0.,\n\
         \x20         0., 0., 1., 0.,\n          0., 0., 0., 1.]\nIMU.NoiseGyro: 1.7e-4\n",
        all,
    );
    check(
        "ORB-SLAM settings",
        "orb3-rectified.yaml",
        "%YAML:1.0\nCamera.type: \"Rectified\"\nCamera1.fx: 611.5\nCamera1.fy: 612.25\nCamera1.cx: 318.75\nCamera1.cy: 243.5\n\
         Camera.width: 640\nCamera.height: 480\nStereo.ThDepth: 40.0\nStereo.b: 0.1\n",
        Says { size: true, baseline_m: Some(0.1), ..Says::default() },
    );
    check(
        "ORB-SLAM settings",
        "stella.yaml",
        "# stella_vslam\nCamera:\n  name: \"a camera\"\n  setup: \"RGBD\"\n  model: \"perspective\"\n  fx: 611.5\n  fy: 612.25\n  cx: 318.75\n\
         \x20 cy: 243.5\n  k1: 0.11\n  k2: -0.23\n  p1: 0.0012\n  p2: -0.0007\n  k3: 0.05\n  fps: 25.0\n  cols: 640\n  rows: 480\n\
         \x20 focal_x_baseline: 61.15\n  color_order: \"RGB\"\nPreprocessing:\n  min_size: 800\n  depthmap_factor: 5000.0\n\
         Viewer:\n  colors:\n    [\n      1, 2,\n      3\n    ]\n",
        all,
    );
    let kalibr = "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: [0.11, -0.23, 0.0012, -0.0007]\n\
        \x20 distortion_model: radtan\n  intrinsics: [611.5, 612.25, 318.75, 243.5]\n  resolution: [640, 480]\n  rostopic: /cam0/image_raw\n";
    check("Kalibr camchain", "kalibr.yaml", kalibr, lens4);
    check(
        "Kalibr camchain",
        "kalibr-block.yaml",
        "cam0:\n  T_cam_imu:\n  - - 1.0\n    - 0.0\n  - - 0.0\n    - 1.0\n  - [0.0, 0.0]\n  camera_model: pinhole\n  distortion_coeffs:\n  - 0.11\n\
         \x20 - -0.23\n  - 0.0012\n  - -0.0007\n  distortion_model: radtan\n  intrinsics:\n    - 611.5\n    - 612.25\n    - 318.75\n    - 243.5\n\
         \x20 resolution:\n  - 640\n  - 480\n",
        lens4,
    );
    let second = "cam1:\n  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.1]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n\
        \x20 camera_model: pinhole\n  intrinsics: [611.5, 612.25, 318.75, 243.5]\n  resolution: [640, 480]\n";
    let rectified =
        kalibr.replace("distortion_coeffs: [0.11, -0.23, 0.0012, -0.0007]", "distortion_coeffs: [0, 0, 0, 0]");
    check(
        "Kalibr camchain",
        "kalibr-pair.yaml",
        &format!("{rectified}{second}"),
        Says { size: true, baseline_m: Some(0.1), ..Says::default() },
    );
    check(
        "ROS camera_info",
        "ros.yaml",
        &format!(
            "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [{K}]\n\
             distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{D}]\nrectification_matrix:\n  rows: 3\n\
             \x20 cols: 3\n  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]\nprojection_matrix:\n  rows: 3\n  cols: 4\n\
             \x20 data: [611.5, 0., 318.75, 0., 0., 612.25, 243.5, 0., 0., 0., 1., 0.]\n"
        ),
        lens5,
    );
    check(
        "ROS camera_info",
        "ros-message.yaml",
        &format!(
            "header:\n  stamp:\n    sec: 17\n    nanosec: 5\n  frame_id: camera\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\nd:\n- 0.11\n\
             - -0.23\n- 0.0012\n- -0.0007\n- 0.05\nk: [{K}]\nr: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n\
             p: [611.5, 0., 318.75, 0., 0., 612.25, 243.5, 0., 0., 0., 1., 0.]\nbinning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n\
             \x20 width: 0\n  height: 0\n  do_rectify: false\n---\n"
        ),
        lens5,
    );
    let columns = "611.5, 0.0, 0.0, 0.0, 612.25, 0.0, 318.75, 243.5, 1.0";
    check(
        "Open3D camera",
        "open3d.json",
        &format!("{{\n \"width\" : 640,\n \"height\" : 480,\n \"intrinsic_matrix\" : [ {columns} ]\n}}"),
        Says { size: true, ..Says::default() },
    );
    check(
        "Open3D camera",
        "recorder.json",
        &format!(
            "{{\"color_format\":\"RGB8\",\"depth_scale\":1000.0,\"device_name\":\"a sensor\",\"fps\":25.0,\"height\":480,\
             \"intrinsic_matrix\":[{columns}],\"width\":640}}"
        ),
        Says { size: true, depth_factor: Some(1000.0), fps: Some(25.0), ..Says::default() },
    );
    check(
        "OpenCV calibration",
        "opencv.yml",
        &format!(
            "%YAML:1.0\n---\ncalibration_time: \"Mon 30 Nov 2026 10:00:00\"\nimage_width: 640\nimage_height: 480\nflags: 0\n\
             camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 6.1150000000000000e+02, 0., 318.75, 0.,\n\
             \x20      612.25, 243.5, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n\
             \x20  data: [ {D} ]\navg_reprojection_error: 0.2\n"
        ),
        lens5,
    );
    check("OpenCV calibration", "opencv-plain.yaml", &format!("K: [{K}]\nD: [{D}]\nimage_size: [640, 480]\n"), lens5);
    let euroc = "sensor_type: camera\ncomment: VI-Sensor cam0\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, -0.02,\n\
        \x20        1.0, 0.0, 0.0, -0.06,\n         0.0, 0.0, 1.0, 0.01,\n         0.0, 0.0, 0.0, 1.0]\nrate_hz: 25\nresolution: [640, 480]\n\
        camera_model: pinhole\nintrinsics: [611.5, 612.25, 318.75, 243.5] #fu, fv, cu, cv\ndistortion_model: radial-tangential\n\
        distortion_coefficients: [0.11, -0.23, 0.0012, -0.0007]\n";
    let rated = Says { fps: Some(25.0), ..lens4 };
    check("EuRoC sensor.yaml", "sensor.yaml", euroc, rated);
    check("EuRoC sensor.yaml", "sensor-radtan.yaml", &euroc.replace("radial-tangential", "radtan"), rated);
    check(
        "EuRoC sensor.yaml",
        "sensor-block.yaml",
        "rate_hz: 25\nresolution:\n- 640\n- 480\ncamera_model: pinhole\nintrinsics:\n- 611.5\n- 612.25\n- 318.75\n- 243.5\ndistortion_model: plumb_bob\n\
         distortion_coefficients:\n- 0.11\n- -0.23\n- 0.0012\n- -0.0007\n- 0.05\n",
        Says { fps: Some(25.0), ..lens5 },
    );
    check(
        "VINS camera",
        "vins.yaml",
        "%YAML:1.0\n---\nmodel_type: PINHOLE\ncamera_name: camera\nimage_width: 640\nimage_height: 480\ndistortion_parameters:\n   k1: 0.11\n\
         \x20  k2: -0.23\n   p1: 0.0012\n   p2: -0.0007\nprojection_parameters:\n   fx: 611.5\n   fy: 612.25\n   cx: 318.75\n   cy: 243.5\n",
        lens4,
    );
    check(
        "camera with plain keys",
        "plain-keys.yaml",
        "cam:\n  H: 480\n  W: 640\n  fx: 611.5\n  fy: 612.25\n  cx: 318.75\n  cy: 243.5\n  png_depth_scale: 5000.0\n  crop_edge: 0\n",
        Says { size: true, depth_factor: Some(5000.0), ..Says::default() },
    );
    check(
        "camera with plain keys",
        "cam_params.json",
        "{\"camera\": {\"w\": 640, \"h\": 480, \"fx\": 611.5, \"fy\": 612.25, \"cx\": 318.75, \"cy\": 243.5, \"scale\": 6553.5}}",
        Says { size: true, depth_factor: Some(6553.5), ..Says::default() },
    );
    check(
        "KITTI calibration",
        "calib.txt",
        "P0: 7e+02 0 6e+02 0 0 7e+02 2e+02 0 0 0 1 0\nP1: 7e+02 0 6e+02 -380 0 7e+02 2e+02 0 0 0 1 0\n\
         P2: 6.115e+02 0.0 3.1875e+02 4.0e+01 0.0 6.1225e+02 2.435e+02 0.1 0 0 1 0.003\n\
         P3: 6.115e+02 0.0 3.1875e+02 -2.115e+01 0.0 6.1225e+02 2.435e+02 0.1 0 0 1 0.003\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n",
        Says { baseline_m: Some(0.1), ..Says::default() },
    );
    check("ETH3D calibration.txt", "calibration.txt", "611.5 612.25 318.75 243.5\n", Says::default());
    check(
        "camera matrix",
        "intrinsic_color.txt",
        "611.5 0 318.75 0\n0 612.25 243.5 0\n0 0 1 0\n0 0 0 1\n",
        Says::default(),
    );
    check(
        "camera in one line of numbers",
        "numbers.txt",
        "611.5 612.25 318.75 243.5 0.11 -0.23 0.0012 -0.0007 0.05\n",
        Says { lens: 5, ..Says::default() },
    );
    check(
        "COLMAP cameras.txt",
        "cameras.txt",
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n\
         1 OPENCV 640 480 611.5 612.25 319.25 244 0.11 -0.23 0.0012 -0.0007\n2 OPENCV 640 480 611.5 612.25 319.25 244 0.11 -0.23 0.0012 -0.0007\n",
        lens4,
    );
}

#[test]
fn the_rational_model_is_read_from_the_dialects_that_have_it() {
    let eight = "0.11, -0.23, 0.0012, -0.0007, 0.05, 0.02, -0.03, 0.004";
    let ros = format!(
        "image_width: 640\nimage_height: 480\ncamera_matrix: {{rows: 3, cols: 3, data: [{K}]}}\ndistortion_model: rational_polynomial\n\
         distortion_coefficients: {{rows: 1, cols: 8, data: [{eight}]}}\n"
    );
    let colmap = format!("7 FULL_OPENCV 640 480 611.5 612.25 319.25 244 {}\n", eight.replace(',', ""));
    let mut wanted = camera();
    wanted.rational = [0.02, -0.03, 0.004];
    for (name, text) in [("ros.yaml", ros), ("cameras.txt", colmap)] {
        let source = parse(name, &text);
        assert_eq!((source.camera.distortion, source.camera.rational), (wanted.distortion, wanted.rational), "{name}");
        let toml = yfslam_io::camera::camera_toml(&source.camera, 1000.0, "again").unwrap();
        assert_eq!(parse("again.toml", &toml).camera, source.camera);
    }
}

#[test]
fn what_changes_the_image_is_refused_with_key_and_cure() {
    let orb = "Camera.fx: 611.5\nCamera.fy: 612.25\nCamera.cx: 318.75\nCamera.cy: 243.5\n";
    let ros =
        format!("image_width: 640\nimage_height: 480\ncamera_matrix:\n  data: [{K}]\ndistortion_model: plumb_bob\n");
    let kalibr = "cam0:\n  camera_model: pinhole\n  intrinsics: [611.5, 612.25, 318.75, 243.5]\n  distortion_coeffs: [0, 0, 0, 0]\n";
    for (name, text, words) in [
        (
            "a.yaml",
            format!("{orb}Camera.type: \"KannalaBrandt8\"\n"),
            ["a.yaml:5", "Camera.type is 'KannalaBrandt8'", "undistort"],
        ),
        ("a.yaml", format!("{orb}Camera.model: fisheye\n"), ["a.yaml:5", "Camera.model is 'fisheye'", "undistort"]),
        ("a.yaml", orb.replace("fy:", "gy:"), ["a.yaml", "the key Camera.fy is missing", "calibration"]),
        ("a.yaml", format!("{orb}Camera.fx: 600\n"), ["a.yaml:5", "'Camera.fx' is given on line 1 already", "remove"]),
        (
            "k.yaml",
            format!("{kalibr}  distortion_model: equidistant\n"),
            ["k.yaml:5", "cam0.distortion_model is 'equidistant'", "undistort"],
        ),
        ("k.yaml", kalibr.replace("pinhole", "omni"), ["k.yaml:2", "cam0.camera_model is 'omni'", "undistort"]),
        ("k.yaml", kalibr.replace(", 243.5", ""), ["k.yaml:3", "cam0.intrinsics has 3 numbers, not 4", "4 numbers"]),
        (
            "r.yaml",
            ros.replace("plumb_bob", "equidistant"),
            ["r.yaml:5", "distortion_model is 'equidistant'", "undistort"],
        ),
        (
            "r.yaml",
            format!("{ros}distortion_coefficients: [{D}, 0, 0, 0, 0.1, 0, 0, 0]\n"),
            ["r.yaml:6", "thin prism", "undistort"],
        ),
        (
            "r.yaml",
            format!("{ros}distortion_coefficients: [1, 2, 3]\n"),
            ["r.yaml:6", "distortion_coefficients has 3 numbers", "k1, k2"],
        ),
        ("r.yaml", format!("{ros}binning_x: 2\n"), ["r.yaml:6", "binning_x", "without binning"]),
        ("r.yaml", ros.replace("318.75, 0.", "318.75, 3."), ["r.yaml:4", "camera_matrix is not [fx 0 cx", "skew"]),
        (
            "v.yaml",
            "%YAML:1.0\nmodel_type: MEI\nimage_width: 640\n".into(),
            ["v.yaml:2", "model_type is 'MEI'", "undistort"],
        ),
        ("v.yaml", "imu: 1\ncam0_calib: \"cam0.yaml\"\n".into(), ["v.yaml:2", "cam0_calib", "give the camera file"]),
        ("c.txt", "1 OPENCV_FISHEYE 640 480 1 1 1 1 0 0 0 0\n".into(), ["c.txt:1", "OPENCV_FISHEYE", "undistort"]),
        (
            "c.txt",
            "1 PINHOLE 640 480 1 1 1 1\n2 PINHOLE 640 480 2 2 1 1\n".into(),
            ["c.txt:2", "several cameras", "keep"],
        ),
        ("n.txt", "1 2 3 4 5\n".into(), ["n.txt", "5 numbers", "fx fy cx cy"]),
        ("d.txt", "0.5 0.7 0.5 0.5 0.9\n640 480\ncrop\n640 480\n".into(), ["d.txt", "begins with numbers", "relative"]),
        (
            "t.json",
            "{\"fl_x\": 600.0, \"camera_model\": \"OPENCV_FISHEYE\"}".into(),
            ["t.json", "OPENCV_FISHEYE", "undistort"],
        ),
        ("x.xml", "<?xml version=\"1.0\"?>\n<opencv_storage/>\n".into(), ["x.xml", "XML", "YAML"]),
        ("o.ini", "# oST version 5.0 parameters\n[image]\n\nwidth\n640\n".into(), ["o.ini", "[image]", "YAML"]),
        ("j.json", "{\"width\": 640,\n \"height\" 480}".into(), ["j.json:2", "JSON", "repair"]),
        ("y.yaml", "a: 1\nb: [1,\n 2\n".into(), ["y.yaml:2", "bracket", "close"]),
        ("y.yaml", "one: 1\ntwo: 2\n".into(), ["y.yaml", "one, two", "Kalibr"]),
    ] {
        let error = refusal(name, &text);
        assert!(words.iter().all(|word| error.contains(word)), "{error}\n  has not all of {words:?}");
    }
}

/// Writes a file and returns its path, beside the folder that removes it.
fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn load(name: &str, bytes: &[u8]) -> yfslam_io::Result<CameraSource> {
    let (_folder, path) = file(name, bytes);
    load_camera(path.to_str().unwrap(), None)
}

const ORB: &str = "%YAML:1.0\nCamera.fx: 611.5\nCamera.fy: 612.25\nCamera.cx: 318.75\nCamera.cy: 243.5\nCamera.width: 640\nCamera.height: 480\n";

#[test]
fn encodings_comments_and_equal_lines_are_borne() {
    let with_comment = format!("{ORB}# Gr\u{f6}\u{df}e in px\n");
    let utf16 = |order: fn(u16) -> [u8; 2]| {
        let units = std::iter::once(0xfeff).chain(with_comment.encode_utf16());
        units.flat_map(order).collect::<Vec<u8>>()
    };
    let latin1: Vec<u8> = with_comment.chars().map(|c| c as u8).collect();
    let mark = format!("\u{feff}{}", with_comment.replace('\n', "\r\n"));
    for bytes in [mark.into_bytes(), latin1, utf16(u16::to_le_bytes), utf16(u16::to_be_bytes)] {
        assert_eq!(load("cam.yaml", &bytes).unwrap().camera.fx, 611.5);
    }
    let twice = load("cam.yaml", format!("{ORB}Camera.width: 640.0\n").as_bytes()).unwrap();
    assert!(
        twice.notes[0].contains("Camera.width is given twice") && twice.notes[0].contains("lines 6 and 8"),
        "{:?}",
        twice.notes
    );
    assert!(load("cam.yaml", b"\0\0\0\0").unwrap_err().to_string().contains("is no text"));
}

#[test]
fn what_a_file_lacks_comes_from_the_recording_or_is_asked_for() {
    let source = || load("cam.yaml", ORB.replace("Camera.width: 640\nCamera.height: 480\n", "").as_bytes()).unwrap();
    let size = || Ok([640, 480]);
    let complete = |depth_source, source: &mut CameraSource| {
        source.complete(depth_source, size).map_err(|error| error.to_string())
    };

    let error = complete(DepthSource::Image, &mut source()).unwrap_err();
    assert!(error.contains("depth factor is missing") && error.contains("--depth-factor"), "{error}");
    let error = complete(DepthSource::Stereo, &mut source()).unwrap_err();
    assert!(error.contains("baseline") && error.contains("Stereo.b"), "{error}");

    let mut mono = source();
    complete(DepthSource::Motion, &mut mono).unwrap();
    assert_eq!([mono.camera.width, mono.camera.height], [640, 480]);
    assert!(mono.notes[0].contains("640×480"), "{:?}", mono.notes);
    let mut rgbd = source();
    rgbd.set_depth_factor(1000.0);
    complete(DepthSource::Image, &mut rgbd).unwrap();

    let stereo = format!("{ORB}Camera.bf: 61.15\n");
    let mut stereo = load("cam.yaml", stereo.as_bytes()).unwrap();
    complete(DepthSource::Stereo, &mut stereo).unwrap();
    let mut small = source();
    let error = small.complete(DepthSource::Motion, || Ok([64, 48])).unwrap_err().to_string();
    assert!(error.contains("cx is 318.75") && error.contains("64×48"), "{error}");
}

#[test]
fn a_second_camera_gives_the_baseline_only_if_the_images_are_rectified() {
    let pair = |motion: &str| {
        let second = ORB.replace("%YAML:1.0\n", "").replace("Camera.", "Camera2.");
        let text = format!(
            "{ORB}{second}Stereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n  data: [{motion}]\n"
        );
        let mut source = parse("pair.yaml", &text);
        let result = source.complete(DepthSource::Stereo, || Ok([640, 480])).map_err(|error| error.to_string());
        result.map(|()| source.camera.bf / source.camera.fx)
    };
    let beside = "1.0, 0.0, 0.0, 0.11, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0";
    assert!((pair(beside).unwrap() - 0.11).abs() < 1e-12);
    let error = pair(&beside.replacen("1.0, 0.0, 0.0, 0.11", "0.9998, 0.02, 0.0, 0.11", 1)).unwrap_err();
    assert!(error.contains("Camera2.fx") && error.contains("rectify"), "{error}");
}

#[test]
fn values_that_no_camera_has_are_refused_with_the_value() {
    let tum = "Camera.fx: 517.3\nCamera.fy: 516.5\nCamera.cx: 318.6\nCamera.cy: 255.3\nCamera.width: 640\nCamera.height: 480\n\
        Camera.fps: 30.0\nCamera.bf: 40.0\nDepthMapFactor: 5000.0\n";
    load("cam.yaml", tum.as_bytes()).unwrap();
    for (from, to, word) in [
        ("bf: 40.0", "bf: 1e-300", "bf is"),
        ("bf: 40.0", "bf: 1e300", "bf is"),
        ("cx: 318.6", "cx: 318643.04", "cx is 318643.04"),
        ("cx: 318.6", "cx: -1e9", "cx is -1000000000"),
        ("fps: 30.0", "fps: 1e-300", "fps is"),
        ("fx: 517.3", "fx: 1e-300", "fx is"),
        ("fx: 517.3", "fx: 1e300", "fx is"),
        ("fx: 517.3", "fx: 5.173", "fx is 5.173"),
        ("fx: 517.3", "fx: 517306.4", "fx is 517306.4"),
    ] {
        let error = load("cam.yaml", tum.replace(from, to).as_bytes()).unwrap_err().to_string();
        assert!(error.contains("cam.yaml") && error.contains(word), "{to}: {error}");
    }
}
