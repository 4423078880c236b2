//! `yfslam run` and `yfslam info` with bags: the same frames give the same trajectory as a folder, to the byte.

use std::fs;
use std::path::Path;

use crate::bag_writer::{CDR, COLOR, DEPTH, FRAME, Form, INFO, Message, NONE, ROS1, camera_info, mcap_bag, ros1_bag};
use crate::common::{ate_rmse, fails, record, report, succeeds};
use yfslam_io::message::types::Transform;
use yfslam_io::{CameraSource, FrameStream, Sequence, SequenceOptions, detect_camera};

/// Returns the recording of [`record`] as messages: images, calibration, and the ground truth as poses of `base_link`.
fn messages(folder: &Path, form: Form) -> (Vec<Message>, CameraSource) {
    let camera = detect_camera(folder).unwrap();
    let sequence = Sequence::open(folder, &SequenceOptions::default()).unwrap();
    let c = &camera.camera;
    let size = [c.width as u32, c.height as u32];
    let mut info = camera_info(size, [c.fx, c.fy, c.cx, c.cy]);
    info.d = c.distortion[..5].to_vec();
    let mut all = Vec::new();
    for frame in FrameStream::open(&sequence, &camera, 2).unwrap() {
        let frame = frame.unwrap();
        let depth = frame.depth.unwrap();
        let units: Vec<u8> = depth.raw.data().iter().flat_map(|raw| raw.to_le_bytes()).collect();
        all.push(form.info(INFO, frame.timestamp_ns, &info));
        all.push(form.image(COLOR, frame.timestamp_ns, size, "rgb8", frame.color.data().as_flattened()));
        all.push(form.image(DEPTH, frame.depth_timestamp_ns.unwrap(), size, "16UC1", &units));
    }
    let reader = &sequence.ground_truth;
    let mut mount = Transform {
        stamp_ns: 0,
        parent: "base_link".into(),
        child: FRAME.into(),
        t_parent_child: nalgebra::Isometry3::translation(0.1, 0.2, 0.3),
    };
    mount.t_parent_child.rotation = nalgebra::UnitQuaternion::from_euler_angles(0.4, 0.5, 0.6);
    for pose in reader.read(reader.path().unwrap()).unwrap().poses {
        let body = Transform {
            stamp_ns: pose.timestamp_ns,
            parent: "map".into(),
            child: "base_link".into(),
            t_parent_child: pose.t_world_cam * mount.t_parent_child.inverse(),
        };
        all.push(form.tf("/tf", std::slice::from_ref(&body)));
    }
    all.insert(5, form.tf("/tf_static", &[mount]));
    (all, camera)
}

#[test]
fn a_bag_gives_the_trajectory_of_a_folder_and_its_own_camera_and_ground_truth() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("tum"));
    let (old, camera) = messages(&folder.path().join("tum"), ROS1);
    let (new, _) = messages(&folder.path().join("tum"), CDR);
    fs::write(folder.path().join("a.bag"), ros1_bag(&old, NONE, 5, true)).unwrap();
    fs::write(folder.path().join("a.mcap"), mcap_bag(&new, CDR, NONE, 5, true)).unwrap();
    let camera_file = ["camera.toml", "camera.yaml"].map(|name| folder.path().join("tum").join(name));
    let camera_file = camera_file.iter().find(|path| path.is_file()).unwrap().to_str().unwrap();
    let run = |sequence: &str, more: &[&str]| {
        succeeds(folder.path(), &[&["run", sequence, "--method", "none", "--out", "out"], more].concat());
        fs::read(folder.path().join("out/trajectory.txt")).unwrap()
    };
    let expected = run("tum", &[]);
    for bag in ["a.bag", "a.mcap"] {
        assert!(run(bag, &["--camera", camera_file]) == expected, "{bag}");
        let factor = camera.depth_factor.to_string();
        run(bag, &["--depth-factor", &factor, "--truth-topic", "/tf"]);
        let report = report(&folder.path().join("out"));
        assert_eq!(report["frames"]["tracked"], 12);
        assert!(ate_rmse(&report) < 0.010, "{bag}: {}", ate_rmse(&report));
        let topics = serde_json::json!({ "color": COLOR, "depth": DEPTH, "right": null, "ground_truth": "/tf" });
        assert_eq!(report["topics"], topics, "{bag}");
        // The same ground truth as chains of transforms, to the body and to the camera.
        for chain in ["/tf:map.base_link".to_owned(), format!("/tf:map.{FRAME}")] {
            run(bag, &["--depth-factor", &factor, "--truth-topic", &chain]);
            let of_chain = crate::common::report(&folder.path().join("out"));
            assert!((ate_rmse(&of_chain) - ate_rmse(&report)).abs() < 1e-9, "{bag}: {}", ate_rmse(&of_chain));
            assert_eq!(of_chain["topics"]["ground_truth"], chain);
        }
    }
    let backward = ["--camera", camera_file, "--reverse", "--start", "2", "--end", "9"];
    assert!(run("a.bag", &backward) == run("tum", &backward[2..]));
    assert!(report(&folder.path().join("out"))["topics"].is_null(), "a folder has no topics");
    for sequence in ["tum", "synth:walking_xyz"] {
        fails(folder.path(), &["run", sequence, "--color-topic", "/x"], &["no topics", "--color-topic"]);
    }
}

#[test]
fn info_lists_the_topics_of_a_bag_also_where_it_has_no_frames() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("tum"));
    let (all, _) = messages(&folder.path().join("tum"), CDR);
    fs::write(folder.path().join("a.mcap"), mcap_bag(&all, CDR, NONE, 5, true)).unwrap();
    let text = succeeds(folder.path(), &["info", "a.mcap", "--depth-factor", "5000"]).stdout;
    for words in [
        "/camera/color/image_raw: sensor_msgs/msg/Image, 12 messages, rgb8 320×240",
        "/tf_static: tf2_msgs/msg/TFMessage, 1 messages",
        "kind          bag, RGB-D",
        "topics: colour /camera/color/image_raw (rgb8), depth /camera/aligned_depth_to_color/image_raw (16UC1)",
        "in base_link: x 0.1000 y 0.2000 z 0.3000 m",
        "camera        a.mcap /camera/color/camera_info",
    ] {
        assert!(text.contains(words), "'{words}' is missing: {text}");
    }
    let poses: Vec<Message> = all.into_iter().filter(|message| message.topic == "/tf").collect();
    fs::write(folder.path().join("poses.mcap"), mcap_bag(&poses, CDR, NONE, 5, true)).unwrap();
    let text = succeeds(folder.path(), &["info", "poses.mcap"]).stdout;
    assert!(text.contains("topic         /tf: ") && text.contains("frames        none: "), "{text}");
    fails(folder.path(), &["run", "poses.mcap"], &["no topic of depth images", "/tf (tf2_msgs/msg/TFMessage"]);
}
