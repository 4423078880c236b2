//! Recordings: folders and bags, frame by frame.

use std::path::Path;
use std::sync::Mutex;

use yfslam::Frame;
use yfslam::config::DepthSource;
use yfslam_io::stream::DEFAULT_LOOK_AHEAD;
use yfslam_io::{
    CameraSource, FrameStream, Sequence, SequenceOptions, check_recording, complete_camera, detect_camera, load_camera,
};

use super::slam::unpoisoned;
use crate::error::Failure;
use crate::ffi::{Handle, Out, OutHandle, Text, export, guarded, guarded_value};
use crate::structs::{self, Camera};

/// A recording behind a handle.
pub struct Recording {
    camera: CameraSource,
    sensor: i32,
    playing: Mutex<Playing>,
}

struct Playing {
    stream: FrameStream,
    /// The frame whose images C may read.
    current: Option<Frame>,
}

export! {
    fn yfslam_recording_open(path: Text<'_>, camera: Text<'_>, recording: OutHandle<'_, Recording>) -> i32 {
        guarded(|| {
            recording.check("recording")?;
            let opened = open(Path::new(path.required("path")?), camera.get("camera")?).map_err(Failure::file)?;
            recording.set("recording", opened)
        })
    }

    fn yfslam_recording_camera(recording: Handle<'_, Recording>, camera: Out<'_, Camera>) -> i32 {
        guarded(|| camera.set("camera", &Camera::of(&recording.required("recording")?.camera)))
    }

    fn yfslam_recording_sensor(recording: Handle<'_, Recording>) -> i32 {
        recording.get().map_or(0, |recording| recording.sensor)
    }

    fn yfslam_recording_next(recording: Handle<'_, Recording>, frame: Out<'_, structs::Frame>) -> i32 {
        guarded(|| {
            frame.check("frame")?;
            let mut playing = unpoisoned(&recording.required("recording")?.playing);
            playing.current = None;
            let next = playing.stream.next().ok_or_else(Failure::end)?.map_err(Failure::frame)?;
            frame.set("frame", &structs::Frame::of(playing.current.insert(next)))
        })
    }

    fn yfslam_recording_close(recording: Handle<'_, Recording>) {
        let _ = guarded_value(|| recording.free());
    }
}

fn open(path: &Path, camera: Option<&str>) -> yfslam_io::Result<Recording> {
    let options = SequenceOptions { read_calibration: camera.is_none(), ..SequenceOptions::default() };
    let sequence = Sequence::open(path, &options)?;
    let mut camera = match (camera, &sequence.calibration) {
        (Some(spec), _) => load_camera(spec, Some(path))?,
        (None, Some(calibration)) => calibration.camera.clone(),
        (None, None) => detect_camera(path)?,
    };
    complete_camera(&mut camera, &sequence)?;
    check_recording(&sequence, &camera)?;
    let stream = FrameStream::open(&sequence, &camera, DEFAULT_LOOK_AHEAD)?;
    let sensor = match sequence.depth_source {
        DepthSource::Image => 0,
        DepthSource::Stereo => 1,
        DepthSource::Motion => 2,
    };
    Ok(Recording { camera, sensor, playing: Mutex::new(Playing { stream, current: None }) })
}

impl structs::Frame {
    /// Returns pointers to the images of a frame, which must outlive them.
    fn of(frame: &Frame) -> Self {
        let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
        let color = |image: &yfslam::RgbImage| image.data().as_flattened().as_ptr();
        let depth = frame.depth.as_deref();
        Self {
            timestamp_ns: frame.timestamp_ns,
            width: side(frame.color.width()),
            height: side(frame.color.height()),
            color: color(&frame.color),
            depth_u16: depth.map_or(std::ptr::null(), |depth| depth.raw.data().as_ptr()),
            depth_scale: depth.map_or(0.0, |depth| f64::from(depth.metres_per_unit)),
            has_depth_timestamp: i32::from(frame.depth_timestamp_ns.is_some()),
            depth_timestamp_ns: frame.depth_timestamp_ns.unwrap_or_default(),
            right: frame.right.as_deref().map_or(std::ptr::null(), color),
            ..Self::default()
        }
    }
}
