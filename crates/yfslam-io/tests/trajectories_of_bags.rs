//! Trajectories from the messages of bags: every type, chains of transforms, and what is refused.
#![allow(clippy::unwrap_used, reason = "a test may")]

#[path = "common/bags.rs"]
mod bags;

use std::fs;
use std::path::Path;

use bags::{CDR, CDR_BIG, Form, Message, NONE, ROS1, mcap_bag, ros1_bag};
use nalgebra::{Isometry3, Vector3};
use yfslam_io::message::types::Transform;
use yfslam_io::{TrajectoryFile, read_trajectory};

/// A body that moves and turns steadily, at a time in ms.
fn motion(ms: i64) -> Isometry3<f64> {
    let s = ms as f64 / 1e3;
    Isometry3::new(Vector3::new(s, -0.5 * s, 0.25), Vector3::new(0.0, 0.0, 0.4 * s))
}

fn transform(ms: i64, parent: &str, child: &str, t_parent_child: Isometry3<f64>) -> Transform {
    Transform { stamp_ns: 1_000_000_000 + ms * 1_000_000, parent: parent.into(), child: child.into(), t_parent_child }
}

/// One topic of each type, each 50 ms, with the offset of its number along x.
fn all_types(form: Form) -> Vec<Message> {
    let mut all = Vec::new();
    for ms in (0..500).step_by(50) {
        let pose = |offset: f64| transform(ms, "map", "base", Isometry3::translation(offset, 0.0, 0.0) * motion(ms));
        let received_ns = 2_000_000_000 + ms * 1_000_000;
        all.push(
            form.message("/pose", "geometry_msgs/PoseStamped", received_ns, |to| pose(1.0).write_pose_stamped(to)),
        );
        all.push(form.message("/amcl", "geometry_msgs/PoseWithCovarianceStamped", received_ns, |to| {
            pose(2.0).write_pose_stamped(to);
            to.f64s(&[0.5; 36]);
        }));
        all.push(form.message("/odom", "nav_msgs/Odometry", received_ns, |to| pose(3.0).write_odometry(to)));
        all.push(form.message("/vicon", "geometry_msgs/TransformStamped", received_ns, |to| {
            pose(4.0).write_transform_stamped(to);
        }));
        all.push(form.tf("/tf", &[pose(5.0)]));
    }
    all
}

/// map → odom each 200 ms, odom → base each 50 ms from 100 ms on, base → mast → camera fixed, and a frame apart.
fn robot(form: Form) -> Vec<Message> {
    let [mast, camera] = mounts();
    let fixed = [transform(0, "base", "mast", mast), transform(0, "mast", "/camera", camera)];
    let mut all = vec![form.tf("/tf_static", &fixed), form.tf("/tf", &[transform(0, "a", "b", motion(0))])];
    for ms in (0..=1000).step_by(50) {
        if ms % 200 == 0 {
            all.push(form.tf("/tf", &[transform(ms, "map", "odom", drift(ms))]));
        }
        if ms >= 100 {
            all.push(form.tf("/tf", &[transform(ms, "odom", "base", motion(ms))]));
        }
    }
    all
}

fn mounts() -> [Isometry3<f64>; 2] {
    let mast = Isometry3::new(Vector3::new(0.1, 0.0, 0.5), Vector3::new(0.0, 0.0, 0.3));
    [mast, Isometry3::new(Vector3::new(0.0, 0.2, 0.0), Vector3::new(-1.2, 0.3, 0.0))]
}

/// Steady, so that what is interpolated is exact.
fn drift(ms: i64) -> Isometry3<f64> {
    let s = ms as f64 / 1e3;
    Isometry3::new(Vector3::new(0.02 * s, 0.01, 0.0), Vector3::new(0.0, 0.0, 0.05 * s))
}

/// Writes a bag of ROS 1 and two MCAP files; returns their names.
fn write(folder: &Path, messages: impl Fn(Form) -> Vec<Message>) -> [std::path::PathBuf; 3] {
    let [old, new, big] = ["a.bag", "a.mcap", "big.mcap"].map(|name| folder.join(name));
    fs::write(&old, ros1_bag(&messages(ROS1), NONE, 7, true)).unwrap();
    fs::write(&new, mcap_bag(&messages(CDR), CDR, NONE, 7, true)).unwrap();
    fs::write(&big, mcap_bag(&messages(CDR_BIG), CDR_BIG, NONE, 0, false)).unwrap();
    [old, new, big]
}

fn expect(file: &TrajectoryFile, expected: &[(i64, Isometry3<f64>)]) {
    assert_eq!(file.poses.len(), expected.len(), "{:?}", file.source);
    for (pose, (ms, expected)) in file.poses.iter().zip(expected) {
        assert_eq!(pose.timestamp_ns, 1_000_000_000 + ms * 1_000_000);
        let apart = expected.inverse() * pose.t_world_cam;
        assert!(apart.translation.vector.norm() < 1e-12 && apart.rotation.angle() < 1e-7, "{ms} ms: {apart}");
    }
}

#[test]
fn every_type_gives_its_poses_with_the_times_of_the_headers() {
    let folder = tempfile::tempdir().unwrap();
    for path in write(folder.path(), all_types) {
        for (offset, topic) in [(1.0, "/pose"), (2.0, "/amcl"), (3.0, "/odom"), (4.0, "/vicon"), (5.0, "/tf")] {
            for topic in [topic.to_owned(), format!("{topic}:map.base")] {
                // A pose alone does not name its body.
                if ["/pose:map.base", "/amcl:map.base"].contains(&topic.as_str()) {
                    continue;
                }
                let file = read_trajectory(&path, Some(&topic), "--topic").unwrap();
                let expected = (0..500).step_by(50);
                let expected = expected.map(|ms| (ms, Isometry3::translation(offset, 0.0, 0.0) * motion(ms)));
                expect(&file, &expected.collect::<Vec<_>>());
                assert!(file.source.unwrap().starts_with(&topic));
            }
        }
        let back = read_trajectory(&path, Some("/tf:base.map"), "--topic").unwrap();
        let expected = (0..500).step_by(50);
        let expected = expected.map(|ms| (ms, (Isometry3::translation(5.0, 0.0, 0.0) * motion(ms)).inverse()));
        expect(&back, &expected.collect::<Vec<_>>());
    }
}

#[test]
fn the_only_topic_of_poses_is_found_and_several_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let only = |topic: &'static str| {
        move |form| all_types(form).into_iter().filter(|message| message.topic == topic).collect::<Vec<_>>()
    };
    for topic in ["/pose", "/amcl", "/odom", "/vicon", "/tf"] {
        for path in write(folder.path(), only(topic)) {
            let file = TrajectoryFile::read(&path).unwrap();
            assert!(file.poses.len() == 10 && file.source.unwrap().starts_with(topic));
        }
    }
    let refusal = |path: &Path, topic: Option<&str>| read_trajectory(path, topic, "--topic").unwrap_err().to_string();
    for path in write(folder.path(), all_types) {
        let error = refusal(&path, None);
        for words in ["/pose (geometry_msgs/", "/odom (nav_msgs/", "10 messages", "choose one with --topic"] {
            assert!(error.contains(words), "{words}: {error}");
        }
        let error = refusal(&path, Some("/nothing"));
        assert!(error.contains("no topic '/nothing'") && error.contains("/vicon"), "{error}");
        let error = refusal(&path, Some("/tf:map.wheel"));
        assert!(error.contains("'map.wheel'") && error.contains("its frames are map, base"), "{error}");
    }
    let text = folder.path().join("poses.txt");
    fs::write(&text, "1 0 0 0 0 0 0 1\n").unwrap();
    assert!(refusal(&text, Some("/odom")).contains("is no bag and has no topic '/odom'; leave out --topic"));
    let images = |form: Form| vec![form.image("/image", 0, [1, 1], "rgb8", &[0; 3])];
    for path in write(folder.path(), images) {
        let error = TrajectoryFile::read(&path).unwrap_err().to_string();
        assert!(error.contains("no topic of poses, only /image (sensor_msgs/"), "{error}");
    }
}

#[test]
fn transforms_are_composed_at_the_times_of_the_one_that_is_sent_most_often() {
    let folder = tempfile::tempdir().unwrap();
    let [mast, camera] = mounts();
    for path in write(folder.path(), robot) {
        let read = |frames: &str| read_trajectory(&path, Some(&format!("/tf:{frames}")), "--topic");
        let expected: Vec<_> =
            (100..=1000).step_by(50).map(|ms| (ms, drift(ms) * motion(ms) * mast * camera)).collect();
        let file = read("map.camera").unwrap();
        expect(&file, &expected);
        assert!(file.source.unwrap().contains("4 transforms, of which 2 change"));
        let expected: Vec<_> = (100..=1000).step_by(50).map(|ms| (ms, (motion(ms) * mast).inverse())).collect();
        expect(&read("mast.odom").unwrap(), &expected);
        let refusal = |frames: &str| read(frames).unwrap_err().to_string();
        assert!(refusal("map.b").contains("no transforms lead from 'map' to 'b'"), "{}", refusal("map.b"));
        assert!(refusal("base.camera").contains("from 'base' to 'camera' never change"));
        let error = read_trajectory(&path, None, "--topic").unwrap_err().to_string();
        assert!(error.contains("map.odom, mast.camera, odom.base") && error.contains("--topic /tf:"), "{error}");
    }
}

#[test]
fn times_outside_of_a_transform_are_left_out_and_poses_that_are_no_numbers_too() {
    let folder = tempfile::tempdir().unwrap();
    let late = |form: Form| {
        let mut all = robot(form);
        all.retain(|message| message.topic != "/tf" || message.received_ns < 1_850_000_000);
        all.push(form.tf("/tf", &[transform(1300, "odom", "base", motion(1300))]));
        all.push(form.tf("/tf", &[transform(500, "odom", "base", Isometry3::translation(f64::NAN, 0.0, 0.0))]));
        all.push(form.tf("/tf", &[transform(525, "odom", "base", Isometry3::translation(0.0, f64::INFINITY, 0.0))]));
        all
    };
    for path in write(folder.path(), late) {
        let file = read_trajectory(&path, Some("/tf:map.base"), "--topic").unwrap();
        // 850 to 1300 ms is beyond the last of map → odom at 800 ms; the second sample at 500 ms repeats its time.
        let expected: Vec<_> = (100..=800).step_by(50).map(|ms| (ms, drift(ms) * motion(ms))).collect();
        expect(&file, &expected);
        assert!(file.source.as_ref().unwrap().contains("outside"), "{:?}", file.source);
        assert!(file.notes.iter().any(|note| note.contains("1 poses of /tf are left out")), "{:?}", file.notes);
    }
}

#[test]
fn a_truncated_bag_gives_the_poses_before_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let [old, new, _] = write(folder.path(), all_types);
    for path in [old, new] {
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() * 2 / 3]).unwrap();
        let file = read_trajectory(&path, Some("/odom"), "--topic").unwrap();
        assert!((2..10).contains(&file.poses.len()), "{}", file.poses.len());
        assert!(file.notes.iter().any(|note| note.contains("no index")), "{:?}", file.notes);
    }
}
