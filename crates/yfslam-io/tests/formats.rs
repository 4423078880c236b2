//! Files of other programs: the cameras and trajectories of the development data.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may")]

mod common;

use common::real_data;
use yfslam_io::camera::preset;
use yfslam_io::trajectory::mirror_trajectory;
use yfslam_io::{Sequence, SequenceOptions, TrajectoryFile, detect_camera};

#[test]
fn the_settings_files_of_the_recordings_equal_the_presets() {
    for (folder, name) in [("rgbd/tum_fr1_xyz_dev", "tum1"), ("rgbd/bonn_crowd_dev", "bonn")] {
        let Some(folder) = real_data(folder) else { return };
        let mut source = detect_camera(&folder).unwrap();
        // The format of these files has no key for the readout time.
        assert_eq!(source.camera.readout_ms.take(), None);
        let mut camera = preset(name).unwrap().camera;
        assert!(camera.readout_ms.take().is_some());
        assert_eq!(source.camera, camera);
        assert!(source.unused_keys.contains(&"ThDepth".to_owned()), "{:?}", source.unused_keys);
    }
}

#[test]
fn published_trajectories_are_read_completely() {
    for (name, poses, duplicates) in
        [("fr2_desk_groundtruth", 20_956, 1), ("fr2_desk_ORB", 2_893, 0), ("fr3_sitting_xyz_groundtruth", 4_251, 0)]
    {
        let Some(path) = real_data(&format!("trajectories/{name}.txt")) else { return };
        let file = TrajectoryFile::read(&path).unwrap();
        assert_eq!(
            (file.poses.len(), file.duplicates_skipped, file.backward_skipped),
            (poses, duplicates, 0),
            "{name}"
        );
    }
}

#[test]
fn mirrored_ground_truth_has_the_same_pose_for_the_same_image() {
    let Some(folder) = real_data("rgbd/tum_fr1_xyz_dev") else { return };
    let truth = TrajectoryFile::read(&folder.join("groundtruth.txt")).unwrap().poses;
    let part = SequenceOptions { start: 50, end: Some(250), ..Default::default() };
    let forward = Sequence::open(&folder, &part).unwrap();
    let backward = Sequence::open(&folder, &SequenceOptions { reverse: true, ..part }).unwrap();
    let mirrored = mirror_trajectory(&truth, backward.mirror.unwrap());
    let nearest = |poses: &[yfslam_io::StampedPose], stamp_ns: i64| {
        poses.iter().min_by_key(|pose| pose.timestamp_ns.abs_diff(stamp_ns)).unwrap().t_world_cam
    };
    for (frame, again) in forward.entries.iter().zip(backward.entries.iter().rev()) {
        assert_eq!(frame.color, again.color);
        assert_eq!(nearest(&truth, frame.timestamp_ns), nearest(&mirrored, again.timestamp_ns));
    }
}
