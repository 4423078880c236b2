//! Recordings in the layouts of data sets and recorders: each gives the trajectory of the same frames in the layout of TUM.

use std::fs;
use std::path::Path;

use crate::common::layouts::Shots;
use crate::common::{ate_rmse, edit_lines, fails, real_data, report, succeeds, yfslam};
use yfslam::Image;
use yfslam_io::write::write_depth_png;

/// Runs a sequence and returns its trajectory; all 12 frames must be tracked.
#[track_caller]
fn trajectory(folder: &Path, sequence: &str, more: &[&str]) -> Vec<u8> {
    let args = [&["run", sequence, "--method", "none", "--out", "out", "-q"], more].concat();
    succeeds(folder, &args);
    assert_eq!(report(&folder.join("out"))["frames"]["tracked"], 12, "{sequence}");
    fs::read(folder.join("out/trajectory.txt")).unwrap()
}

/// Writes the world in a layout and in that of TUM: both give the same bytes, and the ground truth of the layout fits.
#[track_caller]
fn assert_same(factor: f64, name: &str, has_truth: bool, write: impl Fn(&Shots, &Path)) {
    let folder = tempfile::tempdir().unwrap();
    let shots = Shots::render(factor);
    shots.write_tum(&folder.path().join("tum"));
    write(&shots, &folder.path().join("other"));
    let expected = trajectory(folder.path(), "tum", &[]);
    let found = trajectory(folder.path(), "other", &[]);
    assert!(found == expected, "{}", String::from_utf8_lossy(&found));
    let report = report(&folder.path().join("out"));
    if has_truth {
        assert_eq!(report["evaluation"]["matches"], 12, "{name}");
        assert!(ate_rmse(&report) < 0.010, "{name}: {}", ate_rmse(&report));
    }
    let info = succeeds(folder.path(), &["info", "other"]).stdout;
    assert!(info.contains(&format!("kind          {name}, RGB-D")) && info.contains("recognised: "), "{info}");
    let said = succeeds(folder.path(), &["run", "other", "--method", "none", "--out", "out"]).stderr;
    assert!(said.contains(&format!("note: other: {name}, RGB-D, 12 frames; camera: ")), "{said}");
}

#[test]
fn folders_of_open3d_and_realsense_recorders_are_read() {
    for file in ["camera_intrinsic.json", "intrinsic.json"] {
        assert_same(1000.0, "folders of images", false, |shots, folder| shots.write_open3d(folder, file));
    }
}

#[test]
fn seven_scenes_is_read_with_its_poses() {
    assert_same(1000.0, "7-Scenes", true, Shots::write_seven_scenes);
}

#[test]
fn replica_is_read_with_its_scale_and_its_poses() {
    assert_same(6553.5, "Replica", true, Shots::write_replica);
}

#[test]
fn icl_nuim_is_read_with_frame_numbers_and_mirrored_poses() {
    assert_same(5000.0, "ICL-NUIM", true, Shots::write_icl_nuim);
    // Settings files for this data set have a negative fy.
    assert_same(5000.0, "ICL-NUIM", true, |shots, folder| {
        shots.write_icl_nuim(folder);
        fs::remove_file(folder.join("camera.toml")).unwrap();
        fs::write(folder.join("camera.yaml"), shots.orb_slam_settings(-1.0)).unwrap();
    });
}

#[test]
fn scannet_is_read_with_its_poses() {
    assert_same(1000.0, "ScanNet", true, |shots, folder| shots.write_scannet(folder, 1));
}

#[test]
fn eth3d_is_read_with_its_calibration() {
    assert_same(5000.0, "ETH3D SLAM", true, Shots::write_eth3d);
}

#[test]
fn openloris_is_read_with_its_calibration() {
    assert_same(1000.0, "OpenLORIS-Scene", true, Shots::write_openloris);
}

#[test]
fn vslam_lab_is_read_with_nanoseconds_and_its_poses() {
    assert_same(5000.0, "VSLAM-LAB", true, Shots::write_vslam_lab);
}

#[test]
fn depth_of_another_size_is_resampled_in_scannet_and_a_frame_without_a_pose_is_no_truth() {
    let folder = tempfile::tempdir().unwrap();
    let seq = folder.path().join("seq");
    Shots::render(1000.0).write_scannet(&seq, 2);
    fs::write(seq.join("pose/3.txt"), "-inf -inf -inf -inf\n".repeat(4)).unwrap();
    let said = succeeds(folder.path(), &["run", "seq", "--method", "none", "--out", "out"]).stderr;
    assert!(said.contains("depth images have 160×120 px and colour images 320×240"), "{said}");
    let report = report(&folder.path().join("out"));
    assert_eq!((&report["frames"]["tracked"], &report["evaluation"]["matches"]), (&12.into(), &11.into()));
    assert!(ate_rmse(&report) < 0.012, "{}", ate_rmse(&report));
    fails(folder.path(), &["run", "seq", "--camera", "tum1", "--method", "none"], &["320×240", "640×480"]);
    fs::remove_dir_all(seq.join("intrinsic")).unwrap();
    fails(folder.path(), &["run", "seq"], &["intrinsic/intrinsic_color.txt", "--camera"]);
}

#[test]
fn two_folders_of_any_name_are_read_at_a_given_rate() {
    let folder = tempfile::tempdir().unwrap();
    let shots = Shots::render(5000.0);
    shots.write_tum(&folder.path().join("tum"));
    let expected = trajectory(folder.path(), "tum", &[]);
    let seq = folder.path().join("seq");
    shots.write_images(&seq, |k| format!("left_eye/c_{k}.png"), |k| format!("range/d_{k}.png"));
    shots.write_camera(&seq);
    let found = trajectory(folder.path(), "seq", &["--color", "left_eye", "--depth", "range"]);
    assert!(found == expected);
    let said =
        succeeds(folder.path(), &["info", "seq", "--color", "left_eye", "--depth", "range", "--fps", "15"]).stdout;
    assert!(said.contains("15 frames per second, from --fps") && said.contains("15.00 Hz"), "{said}");
    let flags = ["run", "--color", "seq/left_eye", "--depth", "seq/range", "--camera", "seq/camera.toml"];
    succeeds(folder.path(), &[&flags[..], &["--method", "none", "--out", "bare"]].concat());
    assert!(fs::read(folder.path().join("bare/trajectory.txt")).unwrap() == expected);
    fails(
        folder.path(),
        &["run", "seq", "--color", "left_eye"],
        &["no folder of depth images", "--depth", "--sensor mono"],
    );
    fails(folder.path(), &["run", "seq", "--color", "nowhere", "--depth", "range"], &["nowhere", "check the path"]);
    fails(folder.path(), &["run", "seq"], &["--color DIR --depth DIR", "stamp file"]);
    fails(
        folder.path(),
        &["run", "seq", "--color", "left_eye", "--depth", "range", "--fps", "0"],
        &["0 frames per second"],
    );
    // Images without a partner are left out; without common numbers the order counts, if the counts agree.
    fs::remove_file(seq.join("range/d_11.png")).unwrap();
    let info = succeeds(folder.path(), &["info", "seq", "--color", "left_eye", "--depth", "range"]).stdout;
    assert!(info.contains("12 colour, 11 depth images; 11 pairs"), "{info}");
}

#[test]
fn images_that_are_named_by_their_time_keep_it() {
    let folder = tempfile::tempdir().unwrap();
    let shots = Shots::render(5000.0);
    shots.write_tum(&folder.path().join("tum"));
    let expected = trajectory(folder.path(), "tum", &[]);
    let name = |k: usize| yfslam_io::time::format_stamp(shots.shots[k].stamp_ns);
    let seq = folder.path().join("seq");
    shots.write_images(&seq, |k| format!("rgb/{}.png", name(k)), |k| format!("depth/{}.png", name(k)));
    shots.write_camera(&seq);
    assert!(trajectory(folder.path(), "seq", &[]) == expected);
}

#[test]
fn a_list_of_another_name_is_found_if_it_is_the_only_one() {
    let folder = tempfile::tempdir().unwrap();
    let shots = Shots::render(5000.0);
    let seq = folder.path().join("seq");
    shots.write_tum(&seq);
    let expected = trajectory(folder.path(), "seq", &[]);
    let stamp = |k: usize| yfslam_io::time::format_stamp(shots.shots[k].stamp_ns);
    let pairs = shots.lines(|k, _| format!("{0} rgb/{k}.png {0} depth/{k}.png", stamp(k)));
    fs::write(folder.path().join("pairs.txt"), &pairs).unwrap();
    let said = yfslam(
        folder.path(),
        &[
            "run",
            "seq",
            "--method",
            "none",
            "--out",
            "o",
            "--associations",
            "pairs.txt",
            "--association-tolerance",
            "5",
        ],
    );
    assert!(said.stderr.contains("--association-tolerance has no effect"), "{}", said.stderr);
    assert!(fs::read(folder.path().join("o/trajectory.txt")).unwrap() == expected);
    for list in ["rgb.txt", "depth.txt"] {
        fs::remove_file(seq.join(list)).unwrap();
    }
    for name in ["association.txt", "associate.txt", "fr3_walking_xyz.txt"] {
        fs::write(seq.join(name), &pairs).unwrap();
        let info = succeeds(folder.path(), &["info", "seq"]).stdout;
        assert!(info.contains(&format!("recognised: it holds {name}")), "{info}");
        assert!(trajectory(folder.path(), "seq", &[]) == expected, "{name}");
        fs::remove_file(seq.join(name)).unwrap();
    }
    fs::write(seq.join("a.txt"), &pairs).unwrap();
    fs::write(seq.join("b.txt"), &pairs).unwrap();
    fails(folder.path(), &["run", "seq"], &["a.txt, b.txt", "--associations"]);
}

#[test]
fn the_layout_can_be_chosen_and_an_unknown_one_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let seq = folder.path().join("seq");
    Shots::render(5000.0).write_tum(&seq);
    let info = succeeds(folder.path(), &["info", "seq", "--layout", "folders"]).stdout;
    assert!(info.contains("kind          folders of images") && info.contains("recognised: --layout"), "{info}");
    fails(folder.path(), &["info", "seq", "--layout", "freiburg"], &["freiburg", "7scenes", "scannet"]);
    fails(folder.path(), &["info", "seq", "--layout", "openloris"], &["aligned_depth.txt"]);
}

#[test]
fn a_folder_with_colour_alone_is_told_to_use_one_camera() {
    let folder = tempfile::tempdir().unwrap();
    let seq = folder.path().join("seq");
    Shots::render(5000.0).write_tum(&seq);
    fs::remove_file(seq.join("depth.txt")).unwrap();
    fails(folder.path(), &["run", "seq"], &["colour images (rgb.txt)", "--sensor mono"]);
    // It is no video, and with or without ffmpeg the error names it and the program.
    fs::write(folder.path().join("walk.mp4"), "video").unwrap();
    fails(folder.path(), &["run", "walk.mp4"], &["walk.mp4", "ffmpeg"]);
}

/// Returns a grey PGM of 16 bits.
fn pgm(depth: &Image<u16>) -> Vec<u8> {
    let header = format!("P5\n# depth\n{} {}\n65535\n", depth.width(), depth.height());
    header.into_bytes().into_iter().chain(depth.data().iter().flat_map(|raw| raw.to_be_bytes())).collect()
}

/// Returns a NumPy array of type `kind` with the values `bytes`.
fn npy(depth: &Image<u16>, kind: &str, bytes: impl Fn(u16) -> Vec<u8>) -> Vec<u8> {
    let (height, width) = (depth.height(), depth.width());
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({height}, {width}), }}\n");
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((header.len() as u16).to_le_bytes());
    file.extend(header.into_bytes());
    file.extend(depth.data().iter().flat_map(|&raw| bytes(raw)));
    file
}

#[test]
fn depth_as_pgm_and_as_an_array_gives_the_same_bytes_and_metres_nearly_the_same_poses() {
    let folder = tempfile::tempdir().unwrap();
    let shots = Shots::render(5000.0);
    let seq = folder.path().join("seq");
    shots.write_tum(&seq);
    let expected = trajectory(folder.path(), "seq", &[]);
    let rewrite = |encode: &dyn Fn(&Image<u16>) -> Vec<u8>| {
        for (k, shot) in shots.shots.iter().enumerate() {
            fs::write(seq.join(format!("depth/{k}.png")), encode(&shot.depth)).unwrap();
        }
    };
    rewrite(&pgm);
    assert!(trajectory(folder.path(), "seq", &[]) == expected, "pgm");
    rewrite(&|depth| npy(depth, "<u2", |raw| raw.to_le_bytes().to_vec()));
    assert!(trajectory(folder.path(), "seq", &[]) == expected, "npy");
    rewrite(&|depth| npy(depth, ">i4", |raw| i32::from(raw).to_be_bytes().to_vec()));
    assert!(trajectory(folder.path(), "seq", &[]) == expected, "npy, big endian");
    // Metres: the camera has one unit a metre, and NaN is no measurement.
    let metres = |raw: u16| if raw == 0 { f32::NAN } else { f32::from(raw) / 5000.0 };
    rewrite(&|depth| npy(depth, "<f4", |raw| metres(raw).to_le_bytes().to_vec()));
    trajectory(folder.path(), "seq", &["--depth-factor", "1"]);
    assert!(ate_rmse(&report(&folder.path().join("out"))) < 0.010);
    fails(folder.path(), &["run", "seq", "--method", "none"], &["depth factor 5000", "--depth-factor 1 it would be"]);
}

#[test]
fn the_depth_65535_is_no_measurement() {
    let folder = tempfile::tempdir().unwrap();
    let shots = Shots::render(5000.0);
    let seq = folder.path().join("seq");
    shots.write_tum(&seq);
    let mark = |value: u16| {
        for (k, shot) in shots.shots.iter().enumerate() {
            let mut depth = shot.depth.clone();
            for (i, raw) in depth.data_mut().iter_mut().enumerate() {
                if i % 5 == 0 {
                    *raw = value;
                }
            }
            write_depth_png(&seq.join(format!("depth/{k}.png")), &depth).unwrap();
        }
        trajectory(folder.path(), "seq", &[])
    };
    assert!(mark(0) == mark(65535), "65535 counts as a depth");
}

#[test]
fn a_depth_factor_that_makes_the_depth_unusual_is_a_warning_with_both_figures() {
    let folder = tempfile::tempdir().unwrap();
    Shots::render(5000.0).write_tum(&folder.path().join("seq"));
    let run =
        |factor: &str| yfslam(folder.path(), &["run", "seq", "--method", "none", "--depth-factor", factor]).stderr;
    let said = run("1000");
    assert!(said.contains("warning: with the depth factor 1000 the median depth is 1"), "{said}");
    assert!(said.contains("with --depth-factor 5000 it would be 3."), "{said}");
    assert_eq!(said.matches("warning: with the depth factor").count(), 1, "{said}");
    assert!(!run("5000").contains("warning"), "{}", run("5000"));
}

#[test]
fn the_camera_of_the_user_replaces_that_of_the_folder_and_this_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let shots = Shots::render(1000.0);
    shots.write_open3d(&folder.path().join("seq"), "camera_intrinsic.json");
    let other = folder.path().join("other");
    fs::create_dir(&other).unwrap();
    shots.write_camera(&other);
    fs::write(folder.path().join("seq/camera_intrinsic.json"), "broken").unwrap();
    fails(folder.path(), &["run", "seq", "--method", "none"], &["camera_intrinsic.json", "broken"]);
    let args = ["run", "seq", "--method", "none", "--camera", "other/camera.toml", "--out", "out"];
    let said = succeeds(folder.path(), &args).stderr;
    assert!(said.contains("--camera other/camera.toml is used; seq/camera_intrinsic.json is not read"), "{said}");
}

#[test]
fn a_folder_in_euroc_layout_is_read_with_the_camera_of_the_user() {
    let folder = tempfile::tempdir().unwrap();
    let shots = Shots::render(5000.0);
    let cam0 = folder.path().join("seq/mav0/cam0");
    shots.write_images(&cam0, |k| format!("data/{k}.png"), |k| format!("depth/{k}.png"));
    fs::write(
        cam0.join("data.csv"),
        "#timestamp [ns],filename\n".to_owned() + &shots.lines(|k, shot| format!("{},{k}.png", shot.stamp_ns)),
    )
    .unwrap();
    // A fisheye, or by hand: it is not read.
    fs::write(cam0.join("sensor.yaml"), "distortion_model: equidistant\n").unwrap();
    shots.write_camera(folder.path());
    fails(folder.path(), &["run", "seq", "--sensor", "mono"], &["equidistant", "give --camera"]);
    let mono = ["--sensor", "mono", "--camera", "camera.toml"];
    let info = succeeds(folder.path(), &[&["info", "seq"], &mono[..]].concat()).stdout;
    assert!(info.contains("camera        camera.toml") && info.contains("EuRoC (ASL), monocular"), "{info}");
    let said = yfslam(folder.path(), &[&["run", "seq", "--method", "none"], &mono[..]].concat()).stderr;
    assert!(said.contains("seq/mav0/cam0/sensor.yaml is not read"), "{said}");
    fs::remove_file(cam0.join("sensor.yaml")).unwrap();
    fs::create_dir(folder.path().join("seq/mav0/mocap0")).unwrap();
    fails(folder.path(), &["run", "seq", "--sensor", "mono"], &["TUM-VI", "fisheye", "undistort", "--camera"]);
    succeeds(folder.path(), &[&["info", "seq"], &mono[..]].concat());
}

#[test]
fn kitti_is_read_with_jpeg_names_and_with_the_camera_of_the_user() {
    let folder = tempfile::tempdir().unwrap();
    let shots = Shots::render(5000.0);
    let seq = folder.path().join("seq");
    shots.write_images(&seq, |k| format!("image_0/{k:06}.jpg"), |k| format!("depth/{k}.png"));
    fs::write(seq.join("times.txt"), shots.lines(|_, shot| format!("{:e}", shot.stamp_ns as f64 * 1e-9))).unwrap();
    let projection = "267.7 0 159.8 0 0 269.6 123.6 0 0 0 1 0";
    fs::write(seq.join("calib.txt"), format!("P0: {projection}\nP1: {projection}\n")).unwrap();
    shots.write_camera(&seq);
    let info = succeeds(folder.path(), &["info", "seq", "--sensor", "mono", "--camera", "seq/camera.toml"]).stdout;
    assert!(info.contains("KITTI odometry, monocular") && info.contains("colour 320×240"), "{info}");
    fs::remove_file(seq.join("calib.txt")).unwrap();
    succeeds(folder.path(), &["info", "seq", "--sensor", "mono", "--camera", "seq/camera.toml"]);
}

#[test]
fn real_recordings_of_realsense_cameras_run_as_they_are() {
    for (name, frames) in [("rgbd/realsense_d435", 90), ("rgbd/realsense_open3d", 80)] {
        let Some(path) = real_data(name) else { return };
        let folder = tempfile::tempdir().unwrap();
        let output = succeeds(folder.path(), &["run", path.to_str().unwrap(), "--method", "none", "--out", "out"]);
        assert!(output.stderr.contains("30 frames per second are assumed"), "{}", output.stderr);
        assert!(!output.stderr.contains("warning"), "{}", output.stderr);
        let tracked = report(&folder.path().join("out"))["frames"]["tracked"].as_u64().unwrap();
        assert!(tracked >= frames * 9 / 10, "{name}: {tracked} of {frames}");
    }
    // A list that is broken names its line also in other layouts.
    let folder = tempfile::tempdir().unwrap();
    let seq = folder.path().join("seq");
    Shots::render(5000.0).write_vslam_lab(&seq);
    edit_lines(&seq.join("rgb.csv"), |i, line| Some(if i == 3 { format!("soon{line}") } else { line.to_owned() }));
    fails(folder.path(), &["run", "seq"], &["rgb.csv:4", "soon"]);
}

#[test]
fn the_result_for_vslam_lab_is_the_keyframes_and_none_is_left_of_an_earlier_run() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    Shots::render(5000.0).write_vslam_lab(&folder.join("seq"));
    let run = ["run", "seq", "--method", "none", "--out", "out", "--vslam-lab"];
    fs::create_dir(folder.join("exp")).unwrap();
    fs::write(folder.join("exp/00002_KeyFrameTrajectory.csv"), "another run").unwrap();
    succeeds(folder, &[&run[..], &["exp/00003"]].concat());
    let result = folder.join("exp/00003_KeyFrameTrajectory.csv");
    let text = fs::read_to_string(&result).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    assert_eq!(header, "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw");
    let first: Vec<&str> = rows.lines().next().unwrap().split(',').collect();
    assert!(first.len() == 8 && first[0].parse::<i64>().is_ok(), "{first:?}");
    assert_eq!(first[1..4], ["0.000000000"; 3], "the first keyframe is the world");
    succeeds(folder, &["convert", "out/keyframes.txt", "converted.csv", "--to", "vslam-lab"]);
    assert_eq!(fs::read_to_string(folder.join("converted.csv")).unwrap(), text);
    for (id, words) in [("exp", ["no number of the run", "exp/00000"]), ("exp/", ["no number of the run", "exp/00000"])]
    {
        fails(folder, &[&run[..], &[id]].concat(), &words);
    }
    let several = ["run", "seq", "--method", "none,boxes", "--vslam-lab", "exp/1"];
    fails(folder, &several, &["--vslam-lab", "one --method"]);
    assert!(result.is_file());
    // A run without a trajectory leaves no result of the run before.
    fails(folder, &[&run[..], &["exp/00003", "--sensor", "mono"]].concat(), &["no trajectory"]);
    assert!(!result.exists());
    assert_eq!(fs::read_to_string(folder.join("exp/00002_KeyFrameTrajectory.csv")).unwrap(), "another run");
}
