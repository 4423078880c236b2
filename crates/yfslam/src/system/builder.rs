//! From a camera, a configuration and optional parts to a system that is ready for frames.

use std::sync::Arc;

use super::{
    DetectionDemand, FrameDetections, HealthCheck, Readout, ReadoutSearch, SavedMap, SetupError, Slam, Statistics,
};
use crate::backend::{Backend, MapOwner};
use crate::camera::Camera;
use crate::config::{Config, DenseConfig, DepthSource, ReadoutEstimation};
use crate::context::Context;
use crate::dense::{DenseMap, DenseMapper, MapFrame};
use crate::detect::Detector;
use crate::detect::detector_worker::DetectorWorker;
use crate::detect::roll_compensation::GravityDirection;
use crate::dynamic::{DynamicFilter, filter_for};
use crate::features::rolling_shutter::FrameTimes;
use crate::features::stereo_worker::{METRES_PER_UNIT, StereoWorker};
use crate::features::{Features, OrbExtractor};
use crate::image::{DepthImage, GrayImage, Image};
use crate::map::Map;
use crate::tracking::{Tracker, TrackingState, TwoViewInitialiser};
use crate::worker::Execution;

/// What a map from an earlier session is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapUse {
    /// It is extended and refined, once the camera has been recognised in it.
    Extend,
    /// It stays as it is; the camera is localised in it.
    Localise,
}

/// Collects the parts of a [`Slam`]; all but the camera are optional, and their order does not matter.
pub struct SlamBuilder {
    camera: Camera,
    config: Config,
    detector: Option<Box<dyn Detector>>,
    filter: Option<Box<dyn DynamicFilter>>,
    execution: Execution,
    map: Option<(SavedMap, MapUse)>,
    dense: Option<DenseConfig>,
}

impl Slam {
    /// Starts to build a system for one camera.
    pub fn builder(camera: Camera) -> SlamBuilder {
        SlamBuilder {
            camera,
            config: Config::default(),
            detector: None,
            filter: None,
            execution: Execution::default(),
            map: None,
            dense: None,
        }
    }
}

impl SlamBuilder {
    /// Sets the configuration; the default one is for RGB-D cameras.
    #[must_use]
    pub fn config(mut self, config: Config) -> Self {
        self.config = config;
        self
    }

    /// Sets the detector of people and other movable objects; it runs on a thread of its own. Without one, only the detections and masks
    /// that come with the frames tell where people are.
    #[must_use]
    pub fn detector(mut self, detector: impl Detector + 'static) -> Self {
        self.detector = Some(Box::new(detector));
        self
    }

    /// Sets a dynamic filter in the place of the one that `dynamic.method` names.
    #[must_use]
    pub fn filter(mut self, filter: impl DynamicFilter + 'static) -> Self {
        self.filter = Some(Box::new(filter));
        self
    }

    /// Sets where mapping, loop closing and the dense map run.
    #[must_use]
    pub fn execution(mut self, execution: Execution) -> Self {
        self.execution = execution;
        self
    }

    /// Starts in a map from an earlier session: the camera is lost until a frame is recognised.
    #[must_use]
    pub fn map(mut self, saved: SavedMap, map_use: MapUse) -> Self {
        self.map = Some((saved, map_use));
        self
    }

    /// Makes a dense map while tracking, from depth images. The dense map of a saved map that is extended is continued.
    #[must_use]
    pub fn dense(mut self, config: DenseConfig) -> Self {
        self.dense = Some(config);
        self
    }

    /// Builds the system and starts its threads.
    ///
    /// # Errors
    /// If no camera can have the calibration, the configuration holds a value out of range, the detector lacks a movable class, a stereo camera is not rectified, the saved
    /// map does not fit the camera or the configuration, a dense map is wanted without depth images, or a thread cannot be started.
    pub fn build(self) -> Result<Slam, SetupError> {
        let Self { camera, config, detector, filter, execution, map, dense } = self;
        camera.check()?;
        config.validate()?;
        let extractor = OrbExtractor::new(&config.features);
        let context = Arc::new(Context::new(&camera, &config, extractor.scale_factors()));
        let stereo = stereo_worker(&camera, &context)?;
        let (saved, map_use) = map.unzip();
        if let (Some(saved), Some(map_use)) = (&saved, map_use) {
            check_map(saved, map_use, &context)?;
        }
        let (map, earlier, saved_frame) =
            saved.map_or_else(Default::default, |saved| (saved.map, saved.dense, saved.frame));
        let first_keyframe = map.keyframes_ever();
        let needs_boxes = filter.as_ref().map_or(config.dynamic.method.needs_boxes(), |filter| filter.needs_boxes());
        // A filter that uses no boxes needs no detector.
        let detector = detector.filter(|_| needs_boxes);
        let detections = FrameDetections::new(&config.dynamic, detector.as_deref())?;
        let earlier = earlier.filter(|_| map_use == Some(MapUse::Extend));
        let frame = saved_frame.unwrap_or_default();
        let mut dense = dense_mapper(dense, &context, execution, &frame, earlier, &map)?;
        if let Some(dense) = dense.as_mut().filter(|_| detections.detects_static_classes()) {
            dense.name_classes(&detections.class_names);
        }
        let searches_readout = match config.tracking.estimate_readout {
            ReadoutEstimation::Never => false,
            ReadoutEstimation::Unknown => camera.readout_ms.is_none(),
            ReadoutEstimation::Always => true,
        };
        Ok(Slam {
            filter: filter.unwrap_or_else(|| filter_for(config.dynamic.method, config.dynamic.seed)),
            needs_boxes,
            detector: detector.map(DetectorWorker::spawn).transpose()?,
            detections,
            demand: DetectionDemand::default(),
            dense,
            saved_frame,
            last_timestamp_ns: None,
            unknown_frames: 0,
            map_use,
            first_keyframe,
            owner: MapOwner::new(Backend::new(context.clone(), map), execution)?,
            context,
            extractor,
            gray: GrayImage::default(),
            frame_times: FrameTimes::new(&camera),
            readout_search: searches_readout.then(ReadoutSearch::default),
            readout: Readout {
                in_use_ms: camera.readout_ms.unwrap_or(0.0),
                from_camera: camera.readout_ms.is_some(),
                ..Readout::default()
            },
            stereo,
            sparse_depth: Arc::new(DepthImage {
                raw: Image::new(camera.width, camera.height),
                metres_per_unit: METRES_PER_UNIT,
            }),
            extracted: Features::default(),
            tracker: Tracker::default(),
            initialiser: TwoViewInitialiser::default(),
            gravity: GravityDirection::default(),
            state: if map_use.is_some() { TrackingState::Lost } else { TrackingState::NotInitialized },
            anchors: Vec::new(),
            health: HealthCheck::default(),
            statistics: Statistics::default(),
        })
    }
}

/// The worker for right images, where depth comes from stereo.
fn stereo_worker(camera: &Camera, context: &Context) -> Result<Option<StereoWorker>, SetupError> {
    let Context { sensor, config } = context;
    match config.depth.source {
        DepthSource::Stereo if camera.is_distorted() => Err(SetupError::NotRectified(camera.distortion)),
        DepthSource::Stereo => {
            let (bf, fx) = (sensor.pinhole.bf, sensor.pinhole.fx);
            Ok(Some(StereoWorker::spawn(&config.features, &config.stereo, bf, fx)?))
        }
        DepthSource::Image | DepthSource::Motion => Ok(None),
    }
}

/// Refuses a map whose features or unit of length do not fit, or that another camera would extend.
fn check_map(saved: &SavedMap, map_use: MapUse, context: &Context) -> Result<(), SetupError> {
    let (found, wanted) = (&saved.features, &context.config.features);
    if (found.levels, found.scale_factor) != (wanted.levels, wanted.scale_factor) {
        return Err(SetupError::MapFeatures {
            found: found.levels,
            found_scale: found.scale_factor,
            wanted: wanted.levels,
            wanted_scale: wanted.scale_factor,
        });
    }
    // The features of a map are those of a global shutter, whatever the camera's is.
    let Camera { readout_ms, depth_readout_ms, depth_delay_ms, .. } = saved.camera;
    let camera = Camera { readout_ms, depth_readout_ms, depth_delay_ms, ..context.sensor.camera.clone() };
    if map_use == MapUse::Extend && saved.camera != camera {
        return Err(SetupError::MapCamera(saved.camera.width, saved.camera.fx));
    }
    if context.sensor.measures_depth && saved.map.keyframe_count() > 0 && !saved.map.has_depths() {
        return Err(SetupError::MapWithoutScale);
    }
    Ok(())
}

/// The dense map, where one is wanted.
fn dense_mapper(
    wanted: Option<DenseConfig>,
    context: &Context,
    execution: Execution,
    frame: &MapFrame,
    earlier: Option<DenseMap>,
    map: &Map,
) -> Result<Option<DenseMapper>, SetupError> {
    let Some(config) = wanted else { return Ok(None) };
    if context.config.depth.source != DepthSource::Image {
        return Err(SetupError::DenseWithoutDepth);
    }
    let mapper = DenseMapper::new(&config, &context.sensor.camera, execution, frame)?;
    Ok(Some(match earlier {
        Some(earlier) => mapper.with_earlier(earlier, map)?,
        None => mapper,
    }))
}
