//! `yfslam eval`, `ape`, `convert` and `run --groundtruth` with trajectories in bags: the errors are those of the same poses as text.

use std::fs;
use std::path::Path;

use crate::bag_writer::{CDR, Form, Message, NONE, ROS1, mcap_bag, ros1_bag};
use crate::common::{fails, record, succeeds};
use serde_json::Value;
use yfslam_io::message::types::Transform;
use yfslam_io::{StampedPose, TrajectoryFile, write_trajectory};

/// The poses of the ground truth as `PoseStamped`, and poses that differ from them as odometry.
fn messages(truth: &[StampedPose], estimate: &[StampedPose], form: Form) -> Vec<Message> {
    let mut all = Vec::new();
    for (truth, estimate) in truth.iter().zip(estimate) {
        let pose = |pose: &StampedPose| Transform {
            stamp_ns: pose.timestamp_ns,
            parent: "map".into(),
            child: "camera".into(),
            t_parent_child: pose.t_world_cam,
        };
        let (time, truth, estimate) = (truth.timestamp_ns, pose(truth), pose(estimate));
        all.push(form.message("/mocap", "geometry_msgs/PoseStamped", time, |to| truth.write_pose_stamped(to)));
        all.push(form.message("/odom", "nav_msgs/Odometry", time, |to| estimate.write_odometry(to)));
    }
    all
}

fn errors(folder: &Path, args: &[&str]) -> Value {
    serde_json::from_str(&succeeds(folder, &[&["eval", "--json"], args].concat()).stdout).unwrap()
}

#[test]
fn errors_of_topics_are_those_of_the_same_poses_in_files() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    record(&folder.join("seq"));
    let truth = TrajectoryFile::read(&folder.join("seq/groundtruth.txt")).unwrap().poses;
    let mut estimate = truth.clone();
    for (index, pose) in estimate.iter_mut().enumerate() {
        pose.t_world_cam.translation.x += 0.01 * (index as f64).sin();
    }
    write_trajectory(&folder.join("truth.txt"), &truth).unwrap();
    write_trajectory(&folder.join("estimate.txt"), &estimate).unwrap();
    fs::write(folder.join("a.bag"), ros1_bag(&messages(&truth, &estimate, ROS1), NONE, 5, true)).unwrap();
    fs::write(folder.join("a.mcap"), mcap_bag(&messages(&truth, &estimate, CDR), CDR, NONE, 5, true)).unwrap();
    let expected = errors(folder, &["truth.txt", "estimate.txt"]);
    let rmse = |errors: &Value| errors["estimate"]["ate"]["translation_m"]["rmse"].as_f64().unwrap();
    assert!(rmse(&expected) > 1e-3);
    for bag in ["a.bag", "a.mcap"] {
        for args in [
            &[bag, bag, "--truth-topic", "/mocap", "--topic", "/odom"][..],
            &["truth.txt", bag, "--topic", "/odom"],
            &[bag, "estimate.txt", "--truth-topic", "/mocap", "--versus", bag, "--versus-topic", "/mocap"],
        ] {
            let found = errors(folder, args);
            assert!((rmse(&found) - rmse(&expected)).abs() < 1e-8, "{args:?}: {found}");
        }
        fails(folder, &["eval", bag, "estimate.txt"], &["/mocap (geometry_msgs/", "/odom (nav_", "--truth-topic"]);
        fails(folder, &["eval", "truth.txt", bag], &["choose one with --topic"]);
        fails(folder, &["eval", "truth.txt", "estimate.txt", "--topic", "/odom"], &["estimate.txt", "is no bag"]);
        let named = succeeds(folder, &["eval", bag, "estimate.txt", "--truth-topic", "/mocap"]).stderr;
        assert!(named.contains("poses of /mocap (geometry_msgs/"), "{named}");
        let ape = |args: &[&str]| succeeds(folder, &[&["ape"], args, &["-a"]].concat()).stdout;
        assert_eq!(ape(&["bag", bag, "/mocap", "/odom"]), ape(&["tum", "truth.txt", "estimate.txt"]));
        fails(folder, &["ape", "bag", bag, "/mocap"], &["a file and two topics"]);
        succeeds(folder, &["convert", bag, "out.txt", "--to", "tum", "--topic", "/odom"]);
        let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
        assert_eq!(read("out.txt"), read("estimate.txt"));
    }
    let only: Vec<Message> = messages(&truth, &estimate, CDR).into_iter().filter(|m| m.topic == "/mocap").collect();
    fs::write(folder.join("truth.mcap"), mcap_bag(&only, CDR, NONE, 5, true)).unwrap();
    succeeds(folder, &["run", "seq", "--method", "none", "--end", "5", "--groundtruth", "truth.mcap", "--out", "out"]);
    let report = crate::common::report(&folder.join("out"));
    assert!(crate::common::ate_rmse(&report) < 0.01);
    fails(folder, &["run", "seq", "--groundtruth", "a.mcap"], &["several topics of poses", "yfslam convert"]);
}
