//! Files of text.

use yfslam::Config;

use crate::File;

pub fn all() -> Vec<File> {
    let mut files: Vec<File> =
        TEXTS.iter().map(|(target, name, text)| (*target, *name, text.as_bytes().to_vec())).collect();
    let config = Config::default().to_commented_toml().unwrap();
    // Without its comments, all keys of the configuration fit into a small file.
    let keys: String = config
        .lines()
        .filter(|line| line.contains(" = "))
        .filter(|line| !line.starts_with('#'))
        .flat_map(|line| [line, "\n"])
        .collect();
    files.push(("config", "all-keys.toml", keys.into_bytes()));
    files
}

const TEXTS: &[(&str, &str, &str)] = &[
    (
        "camera",
        "own.toml",
        "# ours\nfx = 611.5\nfy = 612.25\ncx = 318.75\ncy = 243.5\nwidth = 640\nheight = 480\ndistortion = [0.11, -0.23, 0.0012, -0.0007, 0.05]\ndepth_factor = 5000.0\nfps = 25.0\nbf = 61.15\n",
    ),
    (
        "camera",
        "small.toml",
        "fx = 61.5\nfy = 61.25\ncx = 31.75\ncy = 24.5\nwidth = 64\nheight = 48\ndistortion = [0.11, -0.23, 0.0012, -0.0007, 0.05]\nrational = [0.02, -0.03, 0.004]\nreadout_ms = 20.0\n",
    ),
    (
        "camera",
        "orb2.yaml",
        "%YAML:1.0\n\nCamera.fx: 611.5\nCamera.fy: 612.25\nCamera.cx: 318.75\nCamera.cy: 243.5\nCamera.k1: 0.11\nCamera.k2: -0.23\nCamera.p1: 0.0012\nCamera.p2: -0.0007\nCamera.k3: 0.05\nCamera.width: 640\nCamera.height: 480\nCamera.fps: 25.0\nCamera.bf: 61.15\nCamera.RGB: 1\nDepthMapFactor: 5000.0\n",
    ),
    (
        "camera",
        "orb3.yaml",
        "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 611.5\nCamera1.fy: 612.25\nCamera1.cx: 318.75\nCamera1.cy: 243.5\nCamera.width: 640\nCamera.height: 480\nStereo.b: 0.1\nIMU.T_b_c1: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n   data: [1., 0., 0., 0.,\n          0., 1., 0., 0.,\n          0., 0., 1., 0.,\n          0., 0., 0., 1.]\n",
    ),
    (
        "camera",
        "stella.yaml",
        "Camera:\n  name: \"a camera\"\n  model: \"perspective\"\n  fx: 611.5\n  fy: 612.25\n  cx: 318.75\n  cy: 243.5\n  k1: 0.11\n  cols: 640\n  rows: 480\n  focal_x_baseline: 61.15\nPreprocessing:\n  depthmap_factor: 5000.0\nViewer:\n  colors:\n    [\n      1, 2,\n      3\n    ]\n",
    ),
    (
        "camera",
        "kalibr.yaml",
        "cam0:\n  T_cam_imu:\n  - - 1.0\n    - 0.0\n  - [0.0, 0.0]\n  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: radtan\n  intrinsics:\n    - 611.5\n    - 612.25\n    - 318.75\n    - 243.5\n  resolution: [640, 480]\ncam1:\n  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.1]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n  camera_model: pinhole\n  intrinsics: [611.5, 612.25, 318.75, 243.5]\n  resolution: [640, 480]\n",
    ),
    (
        "camera",
        "ros.yaml",
        "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [611.5, 0., 318.75, 0., 612.25, 243.5, 0., 0., 1.]\ndistortion_model: rational_polynomial\ndistortion_coefficients: {rows: 1, cols: 8, data: [0.11, -0.23, 0.0012, -0.0007, 0.05, 0.02, -0.03, 0.004]}\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: [611.5, 0., 318.75, 0., 0., 612.25, 243.5, 0., 0., 0., 1., 0.]\n",
    ),
    (
        "camera",
        "ros-message.yaml",
        "header:\n  stamp:\n    sec: 17\n    nanosec: 5\n  frame_id: camera\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\nd:\n- 0.11\n- -0.23\n- 0.0012\n- -0.0007\n- 0.05\nk: [611.5, 0., 318.75, 0., 612.25, 243.5, 0., 0., 1.]\nroi:\n  x_offset: 0\n---\n",
    ),
    (
        "camera",
        "open3d.json",
        "{\n \"width\" : 640,\n \"height\" : 480,\n \"depth_scale\":1000.0, \"intrinsic_matrix\" : [ 611.5, 0.0, 0.0, 0.0, 612.25, 0.0, 318.75, 243.5, 1.0 ]\n}",
    ),
    (
        "camera",
        "opencv.yml",
        "%YAML:1.0\n---\ncalibration_time: \"Mon 30 Nov 2026\"\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 6.115e+02, 0., 318.75, 0.,\n       612.25, 243.5, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ 0.11, -0.23, 0.0012, -0.0007, 0.05 ]\n",
    ),
    (
        "camera",
        "euroc.yaml",
        "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, -0.02,\n         1.0, 0.0, 0.0, -0.06,\n         0.0, 0.0, 1.0, 0.01,\n         0.0, 0.0, 0.0, 1.0]\nrate_hz: 25\nresolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [611.5, 612.25, 318.75, 243.5] #fu, fv, cu, cv\ndistortion_model: radial-tangential\ndistortion_coefficients: [0.11, -0.23, 0.0012, -0.0007]\n",
    ),
    (
        "camera",
        "vins.yaml",
        "%YAML:1.0\n---\nmodel_type: PINHOLE\nimage_width: 640\nimage_height: 480\ndistortion_parameters:\n   k1: 0.11\n   k2: -0.23\n   p1: 0.0012\n   p2: -0.0007\nprojection_parameters:\n   fx: 611.5\n   fy: 612.25\n   cx: 318.75\n   cy: 243.5\n",
    ),
    (
        "camera",
        "plain.yaml",
        "cam:\n  H: 480\n  W: 640\n  fx: 611.5\n  fy: 612.25\n  cx: 318.75\n  cy: 243.5\n  png_depth_scale: 5000.0\n",
    ),
    (
        "camera",
        "plain.json",
        "{\"camera\": {\"w\": 640, \"h\": 480, \"fx\": 611.5, \"fy\": 612.25, \"cx\": 318.75, \"cy\": 243.5, \"scale\": 6553.5}}",
    ),
    (
        "camera",
        "kitti.txt",
        "P0: 7e+02 0 6e+02 0 0 7e+02 2e+02 0 0 0 1 0\nP1: 7e+02 0 6e+02 -380 0 7e+02 2e+02 0 0 0 1 0\nP2: 6.115e+02 0.0 3.1875e+02 4.0e+01 0.0 6.1225e+02 2.435e+02 0.1 0 0 1 0.003\nP3: 6.115e+02 0.0 3.1875e+02 -2.115e+01 0.0 6.1225e+02 2.435e+02 0.1 0 0 1 0.003\n",
    ),
    ("camera", "eth3d.txt", "611.5 612.25 318.75 243.5\n"),
    ("camera", "matrix.txt", "611.5 0 318.75 0\n0 612.25 243.5 0\n0 0 1 0\n0 0 0 1\n"),
    ("camera", "numbers.txt", "611.5 612.25 318.75 243.5 0.11 -0.23 0.0012 -0.0007 0.05\n"),
    ("camera", "colmap.txt", "# Camera list\n1 OPENCV 640 480 611.5 612.25 319.25 244 0.11 -0.23 0.0012 -0.0007\n"),
    ("camera", "bad.xml", "<?xml version=\"1.0\"?>\n<opencv_storage>\n"),
    (
        "config",
        "few.toml",
        "dynamic.method = \"full\"\nfeatures.count = 500\n[tracking]\nestimate_readout = \"never\"\n",
    ),
    (
        "detections",
        "boxes.json",
        "{\"classes\": [\"person\", \"chair\"], \"frames\": [{\"timestamp_ns\": 5, \"boxes\": [{\"instance\": 1, \"class\": \"person\", \"bbox\": [1.0, 2.0, 30.5, 40.0]}]}, {\"timestamp_ns\": 9, \"boxes\": []}]}",
    ),
    (
        "detections",
        "bad-class.json",
        "{\"classes\": [], \"frames\": [{\"timestamp_ns\": 5, \"boxes\": [{\"instance\": 1, \"class\": \"person\", \"bbox\": [1.0, 2.0, 30.5, 40.0]}]}]}",
    ),
    (
        "trajectory",
        "tum.txt",
        "# timestamp tx ty tz qx qy qz qw\n1305031102.175304 1.3405 0.6266 1.6575 0.6574 0.6126 -0.2949 -0.3248\n1305031102.2 1.34 0.63 1.66 0.6574 0.6126 -0.2949 -0.3248\n",
    ),
    ("trajectory", "tum-commas.csv", "1.5, 0, 0, 0, 0, 0, 0, 1\n2.5, 1, 2, 3, 0, 0, 0, 1\n"),
    (
        "trajectory",
        "euroc.csv",
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n1403636580838555648,4.688319,-1.786938,0.783338,0.534108,-0.153029,-0.827383,-0.082152\n1403636580843555328,4.688177,-1.786770,0.787350,0.534640,-0.152990,-0.826976,-0.082863\n",
    ),
    ("trajectory", "kitti.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.1 0 1 0 0.2 0 0 1 1.5\n"),
    ("trajectory", "matrix.txt", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n1 0 0 0.1 0 1 0 0.2 0 0 1 1.5 0 0 0 1\n"),
    ("trajectory", "bad.txt", "1 2 3\n"),
    (
        "eval",
        "se3.txt",
        "A1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 1 1 0 0 0 0 1\n4 1 1 1 0 0 0 1\n=\n1 0 0 0 0 0 0 1\n2 1 0.1 0 0 0 0 1\n3 1 1 0.1 0 0 0 1\n4 1 1 1 0 0 0.1 1\n",
    ),
    (
        "eval",
        "seconds.txt",
        "I1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 1 1 0 0 0 0 1\n4 1 1 1 0 0 0 1\n=\n1.01 0 0 0 0 0 0 1\n2.01 1 0.1 0 0 0 0 1\n3 1 1 0.1 0 0 0 1\n4 1 1 1 0 0 0.1 1\n",
    ),
    ("lists", "times.txt", "0.000000e+00\n1.036224e-01\n2.072e-01\n"),
    ("lists", "kitti.txt", "1\n1.5\n1305031102.175304\n1305031102175304000\n"),
    (
        "sequence",
        "tum.txt",
        "@0\n# color images\n1.00 rgb/0.png\n1.05 rgb/1.png\n@1\n1.01 depth/0.png\n1.06 depth/1.png\n@4\n1.0 0 0 0 0 0 0 1\n1.1 0 0 0 0 0 0 1\n@5\n%YAML:1.0\nCamera.fx: 16\nCamera.fy: 16\nCamera.cx: 8\nCamera.cy: 6\nDepthMapFactor: 1000\n",
    ),
    ("sequence", "associations.txt", "@3\n1.00 rgb/0.png 1.01 depth/0.png\n1.05 rgb/1.png 1.06 depth/1.png\n"),
    ("sequence", "stereo.txt", "@0\n1.00 rgb/0.png\n@2\n1.0 right/0.png\n"),
    ("sequence", "eth3d.txt", "@0\n1.00 rgb/0.png\n@1\n1.0 depth/0.png\n@13\n16 16 8 6\n"),
    (
        "sequence",
        "openloris.txt",
        "@14\n1.00 color/0.png\n@15\n1.0 aligned_depth/0.png\n@4\n#Time px py pz qx qy qz qw\n1.0 0 0 0 0 0 0 1\n",
    ),
    (
        "sequence",
        "kitti.txt",
        "@11\n0.0\n@12\nP0: 16 0 8 0 0 16 6 0 0 0 1 0\nP1: 16 0 8 -8 0 16 6 0 0 0 1 0\nP2: 16 0 8 0 0 16 6 0 0 0 1 0\nP3: 16 0 8 -8 0 16 6 0 0 0 1 0\n",
    ),
    (
        "sequence",
        "euroc.txt",
        "@6\n#timestamp [ns],filename\n1403636580838555648,0.png\n@8\n#timestamp [ns],filename\n1403636580838555648,0.png\n@7\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [16, 12]\ncamera_model: pinhole\nintrinsics: [16, 16, 8, 6]\ndistortion_model: radial-tangential\ndistortion_coefficients: [-0.1, 0.01, 0.0002, 0.00002]\n@9\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.11, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [16, 12]\ncamera_model: pinhole\nintrinsics: [16, 16, 8, 6]\ndistortion_model: radial-tangential\ndistortion_coefficients: [-0.1, 0.01, 0.0002, 0.00002]\n@10\n#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z\n1403636580838555648,4.6,-1.7,0.7,0.53,-0.15,-0.82,-0.08\n",
    ),
    (
        "sequence",
        "vslam-lab.txt",
        "@16\nts_rgb_0 (ns),path_rgb_0,ts_depth_0 (ns),path_depth_0\n1000000000,rgb/0.png,1000000000,depth/0.png\n@17\ncameras:\n- cam_name: rgb_0\n  cam_model: pinhole\n  focal_length: [16.0, 16.0]\n  principal_point: [8.0, 6.0]\n  depth_factor: 1000.0\n  fps: 30.0\n",
    ),
    ("sequence", "replica.txt", "@18\n1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"),
    ("synth_spec", "a.txt", "synth:walking_xyz?seed=7&people=2&frames=300"),
    (
        "synth_spec",
        "b.txt",
        "synth:walking_xyz?width=160&height=120&readout=20&depth_readout=-5&carry=on&object=laptop&stereo=0.11&noise=off",
    ),
    ("synth_spec", "bad.txt", "synth:walking_xyz?people=8"),
    (
        "bag_folder",
        "metadata.yaml",
        "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - a.mcap\n  message_count: 0\n",
    ),
    ("bag_folder", "inline.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: [\"bag/a.mcap\", 'a.mcap']\n"),
    ("bag_folder", "bad.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: []\n"),
];
