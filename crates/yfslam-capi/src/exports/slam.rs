//! The system: create, track, finish, save.

use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use yfslam::config::DepthSource;
use yfslam::nalgebra::Matrix6;
use yfslam::{
    BoundingBox, Config, DepthImage, Detector, DetectorError, Execution, Frame, Image, MapUse, Method, RgbImage,
    SavedMap, Slam, TrackingState,
};
use yfslam_detect::{DetectorConfig, YoloFastestV2};
use yfslam_io::{StampedPose, read_file, write_atomically, write_trajectory};

use crate::error::{self, Failure, Result};
use crate::ffi::{DetectorCall, Handle, In, Out, OutHandle, Rows, Text, elements, export, guarded, guarded_value};
use crate::structs::{self, Camera, Options, Pose, Tracked};

/// Most detections that a function of C can return for one image.
const MAX_DETECTIONS: usize = 256;

/// A system behind a handle.
pub struct System {
    state: Mutex<State>,
    depth_scale: f64,
}

pub struct State {
    pub slam: Slam,
    reason: String,
}

impl System {
    /// Waits until no other thread uses the system.
    pub fn lock(&self) -> Result<MutexGuard<'_, State>> {
        self.state.lock().map_err(|_| {
            Failure::internal("an earlier call has failed in the middle; destroy this system and create another one")
        })
    }
}

export! {
    fn yfslam_create(camera: In<'_, Camera>, options: In<'_, Options<'_>>, slam: OutHandle<'_, System>) -> i32 {
        guarded(|| {
            slam.check("slam")?;
            let camera = camera.required("camera")?;
            let options = options.get("options")?.unwrap_or_default();
            let built = build(&camera, &options)?;
            let state = Mutex::new(State { slam: built, reason: String::new() });
            slam.set("slam", System { state, depth_scale: camera.depth_scale })
        })
    }

    fn yfslam_destroy(slam: Handle<'_, System>) {
        slam.free();
    }

    fn yfslam_track(slam: Handle<'_, System>, frame: In<'_, structs::Frame>, tracked: Out<'_, Tracked>) -> i32 {
        guarded(|| {
            tracked.check("tracked")?;
            let system = slam.required("slam")?;
            let frame = frame.required("frame")?.frame(system.depth_scale)?;
            let mut state = system.lock()?;
            let result = state.slam.track(&frame).map_err(Failure::frame)?;
            state.reason = result.lost_reason.map_or_else(String::new, |reason| reason.to_string());
            tracked.set("tracked", &Tracked::of(&result))
        })
    }

    fn yfslam_lost_reason(slam: Handle<'_, System>) -> *const std::ffi::c_char {
        let reason = guarded_value(|| slam.get().and_then(|system| Some(system.lock().ok()?.reason.clone())));
        error::keep_reason(&reason.flatten().unwrap_or_default())
    }

    fn yfslam_finish(slam: Handle<'_, System>) -> i32 {
        guarded(|| {
            slam.required("slam")?.lock()?.slam.finish_mapping();
            Ok(())
        })
    }

    fn yfslam_save_map(slam: Handle<'_, System>, path: Text<'_>) -> i32 {
        guarded(|| {
            let path = path.required("path")?;
            let mut state = slam.required("slam")?.lock()?;
            state.slam.finish_mapping();
            let bytes = state.slam.save_map().map_err(Failure::internal)?;
            write_atomically(Path::new(path), |file| file.write_all(&bytes)).map_err(Failure::file)
        })
    }

    fn yfslam_save_trajectory(slam: Handle<'_, System>, path: Text<'_>) -> i32 {
        guarded(|| {
            let path = path.required("path")?;
            let poses = slam.required("slam")?.lock()?.slam.trajectory();
            let poses: Vec<StampedPose> = poses.into_iter().map(|(stamp, pose)| StampedPose::new(stamp, pose)).collect();
            write_trajectory(Path::new(path), &poses).map_err(Failure::file)
        })
    }
}

/// Builds the system.
fn build(camera: &Camera, options: &Options<'_>) -> Result<Slam> {
    let source = camera.source()?;
    let config = configuration(options)?;
    if config.depth.source == DepthSource::Stereo && source.missing.baseline {
        return Err(Failure::setup("a stereo camera needs its baseline; set baseline_m of the camera"));
    }
    let mut builder = Slam::builder(source.camera).execution(if options.threaded == 0 {
        Execution::Inline
    } else {
        Execution::Threaded
    });
    if let Some(detector) = detector(options, &config)? {
        builder = builder.detector(detector);
    }
    let map_file = options.map_file.get("map_file")?;
    if map_file.is_none() && options.localise != 0 {
        return Err(Failure::argument("localise is set, but map_file is NULL; give a saved map"));
    }
    if let Some(path) = map_file {
        let bytes = read_file(Path::new(path)).map_err(Failure::file)?;
        let saved = SavedMap::from_bytes(&bytes).map_err(|error| Failure::setup(format!("{path}: {error}")))?;
        builder = builder.map(saved, if options.localise == 0 { MapUse::Extend } else { MapUse::Localise });
    }
    if options.dense != 0 {
        builder = builder.dense(config.dense.clone());
    }
    builder.config(config).build().map_err(Failure::setup)
}

fn configuration(options: &Options<'_>) -> Result<Config> {
    let text = options.config_toml.get("config_toml")?.unwrap_or_default();
    let mut config = Config::from_toml(text).map_err(Failure::setup)?;
    if let Some(name) = options.method.get("method")? {
        config.dynamic.method = match name {
            "none" => Method::None,
            "boxes" => Method::Boxes,
            "yf" => Method::YfSlam,
            "ds" => Method::DsSlam,
            "dyna" => Method::DynaSlam,
            "dms" => Method::DmsSlam,
            "full" => Method::Full,
            _ => {
                let text = format!("unknown method '{name}'; give one of none, boxes, yf, ds, dyna, dms, full");
                return Err(Failure::argument(text));
            }
        };
    }
    match options.sensor {
        // The settings may name another one.
        0 => {}
        1 => config.depth.source = DepthSource::Stereo,
        2 => config.depth.source = DepthSource::Motion,
        other => return Err(Failure::argument(format!("sensor is {other}; give YFSLAM_RGBD, _STEREO or _MONO"))),
    }
    Ok(config)
}

fn detector(options: &Options<'_>, config: &Config) -> Result<Option<Box<dyn Detector>>> {
    let settings = DetectorConfig::for_filter(config);
    Ok(match options.detector {
        0 => Some(Box::new(YoloFastestV2::embedded(&settings).map_err(Failure::setup)?)),
        1 => None,
        2 => {
            let file = options.detector_file.required("detector_file")?;
            let bytes = read_file(Path::new(file)).map_err(Failure::file)?;
            Some(yfslam_detect::load(file, &bytes, &settings).map_err(Failure::setup)?)
        }
        3 => {
            let missing = || Failure::argument("detector_function is NULL");
            let function = options.detector_function.ok_or_else(missing)?;
            let call = DetectorCall { function, user: options.detector_user };
            Some(Box::new(CDetector { call, class_names: vec!["person".into()] }))
        }
        other => return Err(Failure::argument(format!("detector is {other}; give YFSLAM_DETECTOR_…"))),
    })
}

/// A function of C as a detector.
struct CDetector {
    call: DetectorCall,
    class_names: Vec<String>,
}

impl Detector for CDetector {
    fn class_names(&self) -> &[String] {
        &self.class_names
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<yfslam::Detection>) -> std::result::Result<(), DetectorError> {
        out.clear();
        let size = [image.width(), image.height()].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
        let mut room = [structs::Detection::default(); MAX_DETECTIONS];
        let Some(found) = self.call.call(image.data().as_flattened(), size, &mut room) else {
            return Err(DetectorError("the detector function has failed".into()));
        };
        out.extend(found.iter().filter(|detection| detection.class_index == 0).map(structs::Detection::detection));
        out.sort_by(|a, b| b.score.total_cmp(&a.score));
        Ok(())
    }
}

impl structs::Detection {
    pub fn detection(&self) -> yfslam::Detection {
        let Self { x_min, y_min, x_max, y_max, score, class_index } = *self;
        yfslam::Detection { class: class_index as usize, score, bbox: BoundingBox { x_min, y_min, x_max, y_max } }
    }
}

impl structs::Frame {
    /// Copies the images.
    fn frame(&self, camera_scale: f64) -> Result<Frame> {
        let (width, height) = (self.width as usize, self.height as usize);
        let rows = |pointer, stride, channels| Rows { pointer, stride, width, height, channels };
        let color = |pointer: *const u8, stride, name: &str| -> Result<RgbImage> {
            let channels = if self.pixels == 2 { 1 } else { 3 };
            rows(pointer, stride, channels)
                .read(name, |data, step| match self.pixels {
                    0 => RgbImage::from_rgb8(data, width, height, step),
                    1 => RgbImage::from_bgr8(data, width, height, step),
                    _ => RgbImage::from_gray8(data, width, height, step),
                })?
                .map_err(Failure::argument_of)
        };
        if !(0..=2).contains(&self.pixels) {
            return Err(Failure::argument(format!("pixels is {}; give YFSLAM_RGB8, _BGR8 or _GRAY8", self.pixels)));
        }
        let mut frame = Frame::mono(self.timestamp_ns, color(self.color, self.color_stride, "color")?);
        if !self.depth_u16.is_null() {
            let scale = if self.depth_scale > 0.0 { self.depth_scale } else { camera_scale };
            if scale.is_nan() || scale <= 0.0 {
                let text = "the unit of depth_u16 is unknown; set depth_scale of the frame or of the camera";
                return Err(Failure::argument(text));
            }
            let plane = Rows { pointer: self.depth_u16, stride: self.depth_stride, width, height, channels: 1 };
            let depth =
                plane.read("depth_u16", |data, step| DepthImage::from_u16(data, width, height, step, scale as f32))?;
            frame.depth = Some(depth.map_err(Failure::argument_of)?.into());
        } else if !self.depth_m.is_null() {
            let plane = Rows { pointer: self.depth_m, stride: self.depth_stride, width, height, channels: 1 };
            let depth = plane.read("depth_m", |data, step| DepthImage::from_f32(data, width, height, step))?;
            frame.depth = Some(depth.map_err(Failure::argument_of)?.into());
        }
        if self.has_depth_timestamp != 0 {
            frame.depth_timestamp_ns = Some(self.depth_timestamp_ns).filter(|_| frame.depth.is_some());
        }
        if !self.right.is_null() {
            frame.right = Some(color(self.right, self.right_stride, "right")?.into());
        }
        if !self.mask.is_null() {
            let plane = Rows { pointer: self.mask, stride: self.mask_stride, width, height, channels: 1 };
            let pixels: Vec<u8> = plane.read("mask", |data, step| {
                data.chunks(step.max(1)).take(height).flat_map(|row| row.iter().take(width)).copied().collect()
            })?;
            frame.mask = Image::from_vec(width, height, pixels).map(Into::into);
        }
        if self.has_detections != 0 {
            let given = elements(self.detections, self.detection_count, "detections", &())?;
            frame.detections = Some(given.iter().map(structs::Detection::detection).collect());
        }
        Ok(frame)
    }
}

impl Failure {
    fn argument_of(error: yfslam::ImageError) -> Self {
        Self::argument(error.to_string())
    }
}

impl Pose {
    pub fn of(timestamp_ns: i64, pose: &yfslam::Pose) -> Self {
        let (t, q) = (&pose.translation.vector, pose.rotation.coords);
        Self { timestamp_ns, position_m: [t.x, t.y, t.z], quaternion: [q.x, q.y, q.z, q.w] }
    }
}

impl Tracked {
    fn of(tracked: &yfslam::Tracked) -> Self {
        let pose = tracked.t_world_cam.unwrap_or_default();
        // nalgebra keeps columns; the transposed matrices have the rows in this order.
        let matrix = pose.to_homogeneous().transpose();
        let covariance = tracked.covariance.unwrap_or_else(Matrix6::zeros).transpose();
        Self {
            struct_size: size_of::<Self>() as u32,
            state: match tracked.state {
                TrackingState::NotInitialized => 0,
                TrackingState::Tracking => 1,
                TrackingState::Lost => 2,
            },
            has_pose: i32::from(tracked.t_world_cam.is_some()),
            has_covariance: i32::from(tracked.covariance.is_some()),
            is_keyframe: i32::from(tracked.is_keyframe),
            closed_loop: i32::from(tracked.loop_closure.is_some()),
            inliers: tracked.inliers as u64,
            pose: Pose::of(tracked.timestamp_ns, &pose),
            matrix: std::array::from_fn(|index| matrix.as_slice().get(index).copied().unwrap_or_default()),
            covariance: std::array::from_fn(|index| covariance.as_slice().get(index).copied().unwrap_or_default()),
        }
    }
}

/// Returns the guard of a lock whose data cannot be half done.
pub fn unpoisoned<T>(lock: &Mutex<T>) -> MutexGuard<'_, T> {
    lock.lock().unwrap_or_else(PoisonError::into_inner)
}
