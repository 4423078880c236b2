//! The whole path from a frame to its pose, on one page.

mod begin;
mod errors;
mod found;
mod results;
mod times;

use std::sync::{Arc, PoisonError};

use nalgebra::Point3;

use crate::backend::{Backend, Execution, MapOwner};
use crate::camera::Camera;
use crate::config::{Config, DepthSource};
use crate::detection::Detector;
use crate::detector_thread::DetectorThread;
use crate::dynamic::{DynamicFilter, Evidence, FirstPose, Method};
use crate::features::{Features, OrbExtractor};
use crate::frame::RgbdFrame;
use crate::geometry::Pose;
use crate::image::{DepthImage, GrayImage, Image, gray_from_rgb};
use crate::loops::{LoopClosed, Reach, relocalise};
use crate::map::persist::SavedMap;
use crate::map::{KeyFrameId, Map};
use crate::right_eye::{METRES_PER_UNIT, RightEye};
use crate::sensor::SensorModel;
use crate::tracking::{Initialiser, TrackedFrame, Tracker, TrackingState};
use crate::upright::Down;
pub use errors::{FrameRejected, SetupError};
use found::Found;
pub use times::StageTimes;
use times::Stopwatch;

/// What became of one frame.
#[derive(Clone, Debug)]
pub struct Tracked {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// Whether the pose is known.
    pub state: TrackingState,
    /// Pose of the camera in the world as known now; `None` unless tracking.
    pub t_world_cam: Option<Pose>,
    /// Whether the frame became a keyframe, or was handed over to become one.
    pub is_keyframe: bool,
    /// Landmarks that fit the pose.
    pub inliers: usize,
    /// The loop that a keyframe closed, this one or, if mapping has a thread of its own, an earlier one: all poses may have changed.
    pub loop_closed: Option<LoopClosed>,
    /// Where the time went.
    pub times: StageTimes,
}

/// What becomes of a map from an earlier session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapUse {
    /// It grows and is refined, once the camera has recognised where it is.
    Extend,
    /// It stays as it is; the camera is localised in it.
    Localise,
}

/// Where a tracked frame hangs in the map.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    timestamp_ns: i64,
    reference: KeyFrameId,
    t_cam_reference: Pose,
}

/// RGB-D SLAM: frames in, poses out.
pub struct Slam {
    config: Arc<Config>,
    sensor: Arc<SensorModel>,
    extractor: OrbExtractor,
    gray: GrayImage,
    /// Looks at right pictures, where depth comes from those.
    right_eye: Option<RightEye>,
    /// The depth image of a camera that has none, or whose depth is not to be used: zero, but around features that have a depth from
    /// stereo.
    own_depth: Arc<DepthImage>,
    extracted: Features,
    tracker: Tracker,
    initialiser: Initialiser,
    down: Down,
    owner: MapOwner,
    execution: Execution,
    state: TrackingState,
    anchors: Vec<Anchor>,
    filter: Box<dyn DynamicFilter>,
    detector: Option<DetectorThread>,
    found: Found,
    detector_failures: usize,
    /// Frames that were not refused.
    frames_seen: usize,
    last_timestamp_ns: Option<i64>,
    resets: usize,
    /// Frames since the camera was lost that showed enough for a map and were not recognised.
    unknown_frames: usize,
    /// Frames that were worth keeping when mapping was busy.
    passed_over: usize,
    /// How a map from an earlier session is used; `None` if the map is all of this one.
    map_use: Option<MapUse>,
    /// Sequence number of the first keyframe of this session.
    first_keyframe: u64,
}

impl Slam {
    /// A system without a map, for one camera. Without a detector, boxes can still come with the frames.
    ///
    /// # Errors
    /// If the configuration holds a value that cannot work, the detector does not know a movable class, or its thread cannot be started.
    pub fn new(config: Config, camera: &Camera, detector: Option<Box<dyn Detector>>) -> Result<Self, SetupError> {
        config.validate()?;
        let extractor = OrbExtractor::new(&config.features);
        let sensor = Arc::new(SensorModel::new(camera, &config, extractor.scale_factors()));
        let right_eye = match config.depth.source {
            DepthSource::Stereo if camera.distortion != [0.0; 5] => {
                return Err(SetupError::NotRectified(camera.distortion));
            }
            DepthSource::Stereo => Some(RightEye::open(&config, &sensor)?),
            DepthSource::Image | DepthSource::Motion => None,
        };
        let config = Arc::new(config.for_sensor());
        let backend = Backend::new(sensor.clone(), config.clone(), Map::default());
        // A method that asks for no boxes needs no detector.
        let detector = detector.filter(|_| config.dynamic.method.needs_boxes());
        let found = Found::new(&config.dynamic, detector.as_deref())?;
        Ok(Self {
            filter: config.dynamic.method.filter(config.dynamic.seed),
            detector: detector.map(DetectorThread::spawn).transpose()?,
            found,
            detector_failures: 0,
            frames_seen: 0,
            last_timestamp_ns: None,
            resets: 0,
            unknown_frames: 0,
            passed_over: 0,
            map_use: None,
            first_keyframe: 0,
            owner: MapOwner::new(backend, Execution::Inline)?,
            execution: Execution::Inline,
            sensor,
            config,
            extractor,
            gray: GrayImage::default(),
            right_eye,
            own_depth: Arc::new(DepthImage {
                raw: Image::new(camera.width, camera.height),
                metres_per_unit: METRES_PER_UNIT,
            }),
            extracted: Features::default(),
            tracker: Tracker::default(),
            initialiser: Initialiser::default(),
            down: Down::default(),
            state: TrackingState::NotInitialized,
            anchors: Vec::new(),
        })
    }

    /// The system with mapping and loop closing where `execution` says; the map, if any, is begun anew.
    ///
    /// # Errors
    /// If a thread cannot be started.
    pub fn with_execution(mut self, execution: Execution) -> Result<Self, SetupError> {
        let backend = Backend::new(self.sensor.clone(), self.config.clone(), Map::default());
        self.owner = MapOwner::new(backend, execution)?;
        self.execution = execution;
        Ok(self)
    }

    /// The system in a map from an earlier session: lost, until a frame is recognised.
    ///
    /// # Errors
    /// If the map's features were found with other settings, or it is to be extended with another camera.
    pub fn with_map(mut self, saved: SavedMap, map_use: MapUse) -> Result<Self, SetupError> {
        let (found, wanted) = (&saved.features, &self.config.features);
        if (found.levels, found.scale_factor) != (wanted.levels, wanted.scale_factor) {
            return Err(SetupError::MapFeatures {
                found: found.levels,
                found_scale: found.scale_factor,
                wanted: wanted.levels,
                wanted_scale: wanted.scale_factor,
            });
        }
        if map_use == MapUse::Extend && saved.camera != self.sensor.camera {
            return Err(SetupError::MapCamera(saved.camera.width, saved.camera.fx));
        }
        if self.sensor.measures_depth && saved.map.keyframe_count() > 0 && !saved.map.has_depths() {
            return Err(SetupError::MapWithoutScale);
        }
        self.first_keyframe = saved.map.keyframes_ever();
        let backend = Backend::new(self.sensor.clone(), self.config.clone(), saved.map);
        self.owner = MapOwner::new(backend, self.execution)?;
        self.map_use = Some(map_use);
        self.state = TrackingState::Lost;
        Ok(self)
    }

    /// Takes one frame through all stages.
    ///
    /// # Errors
    /// If the images do not have the camera's size, or the time stamp is not later than that of the last frame.
    pub fn track(&mut self, frame: &RgbdFrame) -> Result<Tracked, FrameRejected> {
        self.check(frame)?;
        let mut times = StageTimes::default();
        let mut clock = Stopwatch::start();
        let boxes_are_due = self.start_detector(frame);
        self.extract(frame);
        let depth = self.depth_image(frame);
        times.features = clock.lap();
        let looked = self.collect_boxes(frame, boxes_are_due);
        times.detector_wait = clock.lap();
        let features = &mut self.tracker.current.features;
        let evidence = Evidence {
            movable: &self.found.movable,
            looked,
            mask: frame.mask.as_deref().or(self.found.mask.as_ref()),
            gray: &self.gray,
            depth: &depth,
            sensor: &self.sensor,
        };
        self.filter.before_pose(&self.config.dynamic, &evidence, features);
        times.dynamic = clock.lap();
        let mut loop_closed = None;
        if let Some(inserted) = self.owner.poll() {
            self.tracker.gained_keyframe(inserted.keyframe);
            loop_closed = times.note(&inserted);
        }
        let mut made_map = false;
        let tracked = match self.state {
            TrackingState::NotInitialized if !self.sensor.measures_depth => {
                // Beside another submap it may come back to that one first.
                let found = self.find_again();
                times.places += clock.lap();
                if !found {
                    let begun = self.begin_from_two_views(frame);
                    made_map = begun.is_some_and(|begun| times.note(&begun).is_none());
                }
                found || made_map
            }
            TrackingState::NotInitialized => self.owner.is_free() && self.has_enough_to_start(),
            TrackingState::Tracking => {
                let tracked = self.follow(self.config.tracking.local_min_inliers) || self.follow_despite_boxes();
                if tracked && self.config.dynamic.method == Method::Full && !self.is_map_frozen() {
                    let map = self.owner.map();
                    self.tracker.look_through(&self.sensor, &self.config.dynamic.full, map, &depth);
                }
                tracked
            }
            TrackingState::Lost => {
                let found = self.find_again();
                times.places += clock.lap();
                found
            }
        };
        self.owner.note(&mut self.tracker.sightings);
        if tracked {
            self.tracker.accept(self.owner.map());
            self.down.see(&self.tracker.current.t_cam_world);
            if let Some(tie) = self.tracker.current.reference {
                self.filter.end_frame(&self.config.dynamic, frame.timestamp_ns, tie);
            }
            if self.state != TrackingState::Tracking {
                self.tracker.forget_motion();
            }
        } else {
            self.tracker.reject();
        }
        times.tracking = clock.lap();
        let is_keyframe = made_map || tracked && self.wants_keyframe();
        if is_keyframe && !made_map {
            self.tracker.offered_keyframe();
            let is_first = self.state == TrackingState::NotInitialized;
            if let Some(inserted) = self.owner.insert(&self.tracker.current, &frame.color, is_first) {
                self.tracker.became_keyframe(inserted.keyframe, self.owner.map());
                loop_closed = times.note(&inserted);
            }
        }
        self.state = match (tracked, self.state) {
            (true, _) => TrackingState::Tracking,
            (false, TrackingState::NotInitialized) => TrackingState::NotInitialized,
            (false, _) if self.is_elsewhere() => self.begin_submap(),
            (false, _) => TrackingState::Lost,
        };
        if tracked {
            self.unknown_frames = 0;
        }
        self.note_anchor(frame.timestamp_ns);
        Ok(Tracked {
            timestamp_ns: frame.timestamp_ns,
            state: self.state,
            t_world_cam: tracked.then(|| self.tracker.current.t_cam_world.inverse()),
            is_keyframe,
            inliers: self.tracker.inliers,
            loop_closed,
            times,
        })
    }

    /// Refuses a frame that no stage could work with.
    fn check(&mut self, frame: &RgbdFrame) -> Result<(), FrameRejected> {
        let (camera_width, camera_height) = (self.sensor.camera.width, self.sensor.camera.height);
        let sizes = [
            ("colour", frame.color.width(), frame.color.height()),
            ("depth", frame.depth.raw.width(), frame.depth.raw.height()),
        ];
        let right = frame.right.iter().map(|right| ("right", right.width(), right.height()));
        let mask = frame.mask.iter().map(|mask| ("mask", mask.width(), mask.height()));
        for (image, width, height) in sizes.into_iter().chain(right).chain(mask) {
            if (width, height) != (camera_width, camera_height) {
                return Err(FrameRejected::Size { image, width, height, camera_width, camera_height });
            }
        }
        if self.config.depth.source == DepthSource::Stereo && frame.right.is_none() {
            return Err(FrameRejected::NoRightPicture);
        }
        if let Some(last_ns) = self.last_timestamp_ns.filter(|last| *last >= frame.timestamp_ns) {
            return Err(FrameRejected::Time { timestamp_ns: frame.timestamp_ns, last_ns });
        }
        self.last_timestamp_ns = Some(frame.timestamp_ns);
        Ok(())
    }

    /// Hands the image to the detector if boxes are due and the frame does not bring its own. Returns whether they are.
    fn start_detector(&mut self, frame: &RgbdFrame) -> bool {
        let due = self.frames_seen.is_multiple_of(self.config.dynamic.detect_every);
        self.frames_seen += 1;
        let roll_deg = self.roll_deg();
        if let Some(detector) = self.detector.as_mut().filter(|_| due && frame.detections.is_none()) {
            detector.start(&frame.color, roll_deg);
        }
        due
    }

    /// How far the next picture has to be turned to be upright, degrees, as far as is known before its pose: what
    /// [`Upright::detect`](crate::Upright::detect) is to be given for boxes that come with the frame.
    pub fn roll_deg(&self) -> i32 {
        match self.state {
            TrackingState::NotInitialized => 0,
            _ => {
                let expected = self.tracker.predict(self.owner.map());
                self.down.roll_deg(&expected, self.config.dynamic.upright_roll_deg)
            }
        }
    }

    /// Boxes of movable objects for this frame. Returns whether anybody looked for them: not if the detector fails, is late, or none are
    /// due. Tracks carry such frames.
    fn collect_boxes(&mut self, frame: &RgbdFrame, due: bool) -> bool {
        self.found.clear();
        if let Some(known) = &frame.detections {
            self.found.movable.extend(known.iter().filter(|_| due));
            return due;
        }
        let Some(detector) = &mut self.detector else { return false };
        // A map is not begun before it is known who is in it.
        let waits = !self.config.dynamic.detect_async || self.state == TrackingState::NotInitialized;
        match if waits { detector.finish() } else { detector.poll() } {
            None => false,
            Some(Ok(seen)) => {
                self.found.take(seen);
                true
            }
            Some(Err(error)) => {
                tracing::warn!(timestamp_ns = frame.timestamp_ns, %error, "frame without boxes");
                self.detector_failures += 1;
                false
            }
        }
    }

    /// The depth image that all stages see.
    fn depth_image(&self, frame: &RgbdFrame) -> Arc<DepthImage> {
        if self.config.depth.source == DepthSource::Image { frame.depth.clone() } else { self.own_depth.clone() }
    }

    /// Features of the frame with depth, undistorted.
    fn extract(&mut self, frame: &RgbdFrame) {
        let count = self.features_wanted();
        if let (Some(right_eye), Some(right)) = (&mut self.right_eye, &frame.right) {
            right_eye.start(right, count);
        }
        gray_from_rgb(&frame.color, &mut self.gray);
        self.extractor.set_count(count);
        self.extractor.extract(&self.gray, &mut self.extracted);
        self.tracker.begin_frame(frame.timestamp_ns);
        let current = &mut self.tracker.current;
        let image = if self.config.depth.source == DepthSource::Image { &*frame.depth } else { &DepthImage::default() };
        current.features.fill(&self.extracted, image, &self.sensor.camera, self.sensor.bounds);
        if let (Some(right_eye), Some(spots)) = (&mut self.right_eye, Arc::get_mut(&mut self.own_depth)) {
            right_eye.finish(&self.extractor, &self.extracted, &mut current.features, spots);
        }
        current.clear_sights();
    }

    /// Features to ask for, so that about `features.count` are left when those on moving bodies are dropped: the share dropped in the
    /// last frame is expected again.
    fn features_wanted(&self) -> usize {
        let count = self.config.features.count as f64;
        let last = &self.tracker.current.features.features;
        let trusted = last.iter().filter(|f| f.trust > 0.0).count().max(1);
        let factor = (last.len() as f64 / trusted as f64).clamp(1.0, self.config.dynamic.max_extra_features);
        let begins = !self.sensor.measures_depth && self.is_young();
        (count * factor * if begins { self.config.monocular.start_features } else { 1.0 }) as usize
    }

    /// Tracks a frame whose neighbour was tracked: at least `min_inliers` landmarks must fit.
    fn follow(&mut self, min_inliers: usize) -> bool {
        let map = self.owner.map();
        if !self.tracker.estimate(&self.sensor, &self.config, map) {
            return false;
        }
        sharpen(self.filter.as_mut(), &mut self.tracker.current, &self.sensor, &self.config, map);
        self.tracker.track_local_map(&self.sensor, &self.config, map, min_inliers)
    }

    /// Tracks such a frame by what boxes speak against too: a false one that fills the picture must not take the ground from under
    /// tracking. Whoever really is there is on no map.
    fn follow_despite_boxes(&mut self) -> bool {
        // As sure as whoever was lost has to be.
        let min_inliers = self.config.places.relocalise_min_inliers;
        let tracked = self.filter.doubt_boxes(&self.config.dynamic, &mut self.tracker.current.features)
            && self.follow(min_inliers);
        self.tracker.current.settle_doubts();
        if tracked {
            self.filter.settle_doubts(&self.config.dynamic, &self.tracker.current.features);
        }
        tracked
    }

    /// Seeks the frame of a camera that was lost in the whole map, and tracks it there.
    fn find_again(&mut self) -> bool {
        let reach = self.reach();
        let recogniser = self.owner.recogniser();
        let mut recogniser = recogniser.lock().unwrap_or_else(PoisonError::into_inner);
        let map = self.owner.map();
        // Whoever was lost has to be surer than whoever was not.
        let min_inliers = self.config.places.relocalise_min_inliers;
        relocalise(&mut recogniser, &self.sensor, &self.config, map, &mut self.tracker.current, reach.as_ref())
            && self.tracker.track_local_map(&self.sensor, &self.config, map, min_inliers)
    }

    /// Where the camera can have come since it was lost; `None` after too long a time, or if it never was tracked.
    fn reach(&self) -> Option<Reach> {
        let c = &self.config.places;
        let last = self.anchors.last()?;
        let lost_s = self.tracker.current.timestamp_ns.saturating_sub(last.timestamp_ns) as f64 * 1e-9;
        let t_cam_world = self.owner.map().tied_pose(last.reference, &last.t_cam_reference)?;
        let center_world = t_cam_world.inverse_transform_point(&Point3::origin());
        // The longer it is lost, the less its last place says, until it says nothing.
        let forgotten = lost_s / c.max_reach_s;
        let gain = c.relocalise_min_likeness_beyond - c.relocalise_min_likeness;
        let reach = Reach {
            reference: last.reference,
            center_world,
            radius_m: c.max_speed_m_per_s * (lost_s + 1.0),
            min_likeness: c.relocalise_min_likeness + gain * forgotten,
        };
        (forgotten <= 1.0).then_some(reach)
    }

    /// Whether the map stays as it is.
    fn is_map_frozen(&self) -> bool {
        self.map_use == Some(MapUse::Localise)
    }

    /// Whether the frame is to become a keyframe, and can.
    fn wants_keyframe(&mut self) -> bool {
        if self.is_map_frozen() || !self.tracker.wants_keyframe(&self.sensor, &self.config, self.owner.map()) {
            return false;
        }
        let free = self.owner.is_free();
        self.passed_over += usize::from(!free);
        free
    }

    fn note_anchor(&mut self, timestamp_ns: i64) {
        if self.state == TrackingState::Tracking
            && let Some((reference, t_cam_reference)) = self.tracker.current.reference
        {
            self.anchors.push(Anchor { timestamp_ns, reference, t_cam_reference });
        }
    }
}

/// Compares the frame with the map by its first pose; what turns out to move is dropped, and the pose refined without it.
fn sharpen(
    filter: &mut dyn DynamicFilter,
    current: &mut TrackedFrame,
    sensor: &SensorModel,
    config: &Config,
    map: &Map,
) {
    let first = FirstPose { sensor, map, t_cam_world: &current.t_cam_world };
    if filter.after_pose(&config.dynamic, &first, &mut current.features) {
        current.drop_distrusted();
        current.refine_pose(sensor, &config.pose);
    }
}
