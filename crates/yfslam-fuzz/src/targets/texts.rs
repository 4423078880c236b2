//! Files of text: cameras, configurations, trajectories, detections, specifications of synthetic sequences.

use std::path::Path;

use yfslam::{Config, Slam};
use yfslam_io::camera::{camera_toml, check_camera, parse_camera};
use yfslam_io::{BoxList, TrajectoryFile};

use crate::scratch::with_file;

/// A camera file of any dialect. What is accepted can be written as TOML, and read back to the same camera.
pub fn camera(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Ok(source) = parse_camera(text, Path::new("camera.yaml")) else { return false };
    if check_camera(&source).is_err() {
        return false;
    }
    if !source.missing.size {
        let again = camera_toml(&source.camera, source.depth_factor, "again").map(|toml| {
            parse_camera(&toml, Path::new("again.toml")).map(|again| again.camera).map_err(|error| error.to_string())
        });
        let Ok(Ok(again)) = again else { panic!("a camera that was read is refused after it was written: {again:?}") };
        assert_eq!(again, source.camera, "a camera differs after it was written and read");
    }
    let camera = source.camera;
    if camera.width * camera.height > 0 && camera.width * camera.height <= 1 << 14 {
        let built = Slam::builder(camera).build();
        assert!(built.is_ok(), "a camera that was accepted cannot be used: {:?}", built.err());
    }
    true
}

/// A configuration in TOML. What is accepted is the same after it was written and read.
pub fn config(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Ok(config) = Config::from_toml(text) else { return false };
    if config.validate().is_err() {
        return false;
    }
    let written = config.to_commented_toml().map(|toml| Config::from_toml(&toml));
    let Ok(Ok(again)) = written else { panic!("a configuration that was read cannot be written: {written:?}") };
    assert_eq!(again, config, "a configuration differs after it was written and read");
    true
}

/// A trajectory in the formats of TUM, KITTI or EuRoC. The stamps of what is accepted ascend, and its numbers are finite.
pub fn trajectory(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Ok(file) = TrajectoryFile::parse(text, Path::new("trajectory.txt")) else { return false };
    assert!(file.poses.windows(2).all(|pair| pair[0].timestamp_ns < pair[1].timestamp_ns), "stamps do not ascend");
    let finite = |pose: &yfslam_io::StampedPose| {
        let pose = &pose.t_world_cam;
        pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|number| number.is_finite())
    };
    assert!(!file.poses.is_empty() && file.poses.iter().all(finite), "a pose is not finite");
    true
}

/// A detections file.
pub fn detections(bytes: &[u8]) -> bool {
    let boxes = with_file("boxes.json", bytes, BoxList::read);
    let Some(Ok(boxes)) = boxes else { return false };
    let _ = boxes.detections(&boxes.classes);
    let _ = boxes.detections(&["person".to_owned()]);
    true
}

/// The specification of a synthetic sequence, as the program takes it for an input.
pub fn synth_spec(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let _ = yfslam_synth::split(text);
    yfslam_synth::is_spec(text) && yfslam_synth::parse(text).is_ok()
}
