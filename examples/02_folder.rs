//! A recording in a folder (TUM RGB-D, Bonn, EuRoC or KITTI layout), with the embedded person detector; the trajectory goes to a file.
//!
//! `cargo run --release -p yfslam-examples --example 02_folder -- FOLDER [CAMERA]`
//!
//! CAMERA is a preset (tum1, tum2, tum3, bonn) or a camera file; without it, a camera file in the folder is used. Without FOLDER, a
//! small recording is rendered first.
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::path::{Path, PathBuf};

use yfslam::{Config, Slam};
use yfslam_detect::{DetectorConfig, YoloFastestV2};
use yfslam_io::stream::DEFAULT_LOOK_AHEAD;
use yfslam_io::write::{ListedStamps, RecordingWriter};
use yfslam_io::{
    FrameStream, Sequence, SequenceOptions, StampedPose, complete_camera, detect_camera, load_camera, write_trajectory,
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().map_or_else(render_recording, |folder| Ok(PathBuf::from(folder)))?;
    let mut camera = match arguments.next() {
        Some(spec) => load_camera(&spec, Some(&folder))?,
        None => detect_camera(&folder)?,
    };
    let sequence = Sequence::open(&folder, &SequenceOptions::default())?;
    complete_camera(&mut camera, &sequence)?;

    let mut config = Config::default();
    config.depth.source = sequence.depth_source;
    let detector = YoloFastestV2::embedded(&DetectorConfig::default())?;
    let mut slam = Slam::builder(camera.camera.clone()).config(config).detector(detector).build()?;

    let mut lost = 0;
    for frame in FrameStream::open(&sequence, &camera, DEFAULT_LOOK_AHEAD)? {
        match frame {
            Ok(frame) => lost += usize::from(slam.track(&frame)?.t_world_cam.is_none()),
            Err(error) => println!("skipped: {error}"),
        }
    }
    let stamped = |(timestamp_ns, pose)| StampedPose::new(timestamp_ns, pose);
    let trajectory: Vec<StampedPose> = slam.trajectory().into_iter().map(stamped).collect();
    write_trajectory(Path::new("trajectory.txt"), &trajectory)?;
    println!("trajectory.txt: {} poses; {lost} frames without a pose", trajectory.len());
    Ok(())
}

/// Renders a recording of a second into a temporary folder.
fn render_recording() -> Result<PathBuf, Box<dyn Error>> {
    let folder = std::env::temp_dir().join("yfslam-example-recording");
    let (camera, frames) = yfslam_examples::rendered("walking_xyz?frames=30")?;
    let mut writer = RecordingWriter::create(&folder, false, true)?;
    for (number, frame) in frames.iter().enumerate() {
        writer.write_images(number, frame)?;
        writer.list(number, ListedStamps { color_ns: Some(frame.timestamp_ns), paired_ns: Some(frame.timestamp_ns) });
    }
    writer.finish(&camera, 5000.0, &[], &Default::default())?;
    Ok(folder)
}
