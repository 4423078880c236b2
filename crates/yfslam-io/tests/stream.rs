//! The stream of frames: order and errors as values, on generated and on real recordings.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may")]

mod common;

use std::fs;
use std::path::Path;

use common::{SIZE, camera, color_png, depth_png, real_data, write_sequence};
use yfslam::Camera;
use yfslam_io::stream::DEFAULT_LOOK_AHEAD;
use yfslam_io::{CameraSource, FrameStream, Sequence, SequenceOptions, check_recording, detect_camera};

fn stream(folder: &Path) -> FrameStream {
    let sequence = Sequence::open(folder, &SequenceOptions::default()).unwrap();
    FrameStream::open(&sequence, &camera(), DEFAULT_LOOK_AHEAD).unwrap()
}

#[test]
fn frames_arrive_in_order_with_their_own_images() {
    let folder = tempfile::tempdir().unwrap();
    write_sequence(folder.path(), 50);
    for look_ahead in [0, 1, 4, 100] {
        let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
        let frames = FrameStream::open(&sequence, &camera(), look_ahead).unwrap();
        assert_eq!(frames.len(), 50);
        for (i, frame) in frames.enumerate() {
            let frame = frame.unwrap();
            assert_eq!(frame.timestamp_ns, 100_000_000_000 + i as i64 * 100_000_000);
            assert_eq!(frame.color.get(3, 2), Some(&[i as u8; 3]));
            let expected_m = (5000 + i) as f32 / 5000.0;
            assert!((frame.depth.as_ref().unwrap().metres(3, 2).unwrap() - expected_m).abs() < 1e-6);
        }
    }
}

#[test]
fn bad_frames_are_values_that_name_file_and_cure_and_the_others_arrive() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_sequence(path, 10);
    fs::remove_file(path.join("rgb/0.png")).unwrap();
    fs::write(path.join("rgb/1.png"), &color_png(SIZE, 9)[..60]).unwrap();
    fs::write(path.join("rgb/2.png"), "RIFF....WEBP").unwrap();
    fs::write(path.join("rgb/3.png"), color_png((4, 4), 9)).unwrap();
    fs::write(path.join("depth/4.png"), color_png(SIZE, 9)).unwrap();
    fs::write(path.join("depth/5.png"), depth_png((4, 3), 9)).unwrap();
    fs::write(path.join("depth/6.png"), depth_png(SIZE, 0)).unwrap();
    fs::write(path.join("depth/7.png"), "").unwrap();
    fs::remove_file(path.join("depth/8.png")).unwrap();
    fs::create_dir(path.join("depth/8.png")).unwrap();
    let expected = [
        (0, "rgb/0.png: ", "check the path"),
        (1, "rgb/1.png is damaged", "record or unpack"),
        (2, "rgb/2.png is a WebP image", "convert it to PNG"),
        (3, "rgb/3.png has 4×4 pixels, but the camera has 8×6", "camera file"),
        (4, "depth/4.png is a PNG of 8-bit RGB", "16-bit grey PNG"),
        (5, "depth/5.png has 4×3 pixels, but the camera has 8×6", "register"),
        (6, "depth/6.png has no depth in any pixel", "sensor"),
        (7, "depth/7.png is an empty file", "convert"),
        (8, "depth/8.png: ", "inside this folder"),
    ];
    let frames: Vec<_> = stream(path).collect();
    assert_eq!(frames.len(), 10);
    for (index, fault, cure) in expected {
        let error = frames[index].as_ref().unwrap_err();
        let text = error.to_string();
        assert_eq!(error.index, index);
        assert!(text.starts_with(&format!("frame {index} (t = 100.{index}00000000): ")), "{text}");
        assert!(text.contains(fault) && text.contains(cure), "{text}");
    }
    assert_eq!(frames[9].as_ref().unwrap().color.get(0, 0), Some(&[9; 3]));
}

#[test]
fn the_development_recordings_decode_without_an_error() {
    for name in ["rgbd/tum_fr1_xyz_dev", "rgbd/bonn_crowd_dev"] {
        let Some(folder) = real_data(name) else { return };
        let camera = detect_camera(&folder).unwrap();
        let sequence = Sequence::open(&folder, &SequenceOptions::default()).unwrap();
        let mut frames = FrameStream::open(&sequence, &camera, DEFAULT_LOOK_AHEAD).unwrap();
        let count = frames.by_ref().map(|frame| frame.unwrap()).filter(|f| f.color.width() == 640).count();
        assert_eq!(count, sequence.entries.len());
        let times = frames.times();
        let ms = |time: std::time::Duration| time.as_secs_f64() * 1e3 / count as f64;
        println!(
            "{name}: {count} frames, ms a frame: colour {:.2}, depth {:.2}, waited {:.2}",
            ms(times.color),
            ms(times.paired_image),
            ms(times.waited)
        );
    }
}

#[test]
fn a_recording_is_checked_against_its_camera_before_it_is_played() {
    let folder = tempfile::tempdir().unwrap();
    write_sequence(folder.path(), 40);
    let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    let statistics = check_recording(&sequence, &camera()).unwrap().unwrap();
    assert!((statistics.median_m - 1.0004).abs() < 1e-9 && statistics.valid_share == 1.0, "{statistics:?}");

    let refusal = |camera: &CameraSource| check_recording(&sequence, camera).unwrap_err().to_string();
    let error = refusal(&CameraSource { depth_factor: 1e6, ..camera() });
    assert!(
        error.contains("depth factor 1000000") && error.contains("--depth-factor 5000 it would be 1.0 m"),
        "{error}"
    );
    let error = refusal(&CameraSource { camera: Camera::pinhole(640, 480, 8.0, 8.0, 4.0, 3.0), ..camera() });
    assert!(
        error.contains("none of the first 30 frames") && error.contains("8×6 pixels, but the camera has 640×480"),
        "{error}"
    );
    // Single bad frames at the start do not hide the good ones.
    fs::write(folder.path().join("rgb/0.png"), "").unwrap();
    check_recording(&sequence, &camera()).unwrap();
}
