//! The whole path from a frame to its pose: sense, localise, map, finish.

mod builder;
mod detection_demand;
mod errors;
mod finish;
mod frame_detections;
mod health;
mod initialisation;
mod keyframes;
mod localise;
mod results;
mod saved_map;
mod sense;
mod shutter;
mod times;
mod tracked;

use std::sync::Arc;

use crate::backend::MapOwner;
use crate::context::Context;
use crate::dense::{DenseMapper, MapFrame};
use crate::detect::detector_worker::DetectorWorker;
use crate::detect::roll_compensation::GravityDirection;
use crate::dynamic::DynamicFilter;
use crate::features::rolling_shutter::FrameTimes;
use crate::features::stereo_worker::StereoWorker;
use crate::features::{Features, OrbExtractor};
use crate::frame::Frame;
use crate::geometry::Pose;
use crate::image::{DepthImage, GrayImage};
use crate::loops::LoopClosure;
use crate::map::KeyFrameId;
use crate::tracking::{Tracker, TrackingState, TwoViewInitialiser};
pub use builder::{MapUse, SlamBuilder};
use detection_demand::DetectionDemand;
pub use errors::{FrameRejected, SetupError};
use frame_detections::FrameDetections;
pub use health::FrameHealth;
use health::HealthCheck;
pub use results::Statistics;
pub use saved_map::SavedMap;
pub use shutter::Readout;
use shutter::ReadoutSearch;
pub use times::StageTimes;
use times::Stopwatch;
pub use tracked::Tracked;

/// Visual SLAM for one camera: frames in, poses out. [`Slam::builder`] makes one.
pub struct Slam {
    context: Arc<Context>,
    extractor: OrbExtractor,
    gray: GrayImage,
    /// When the rows of the images of a frame are read.
    frame_times: FrameTimes,
    /// Estimates the readout time while it is not known.
    readout_search: Option<ReadoutSearch>,
    readout: Readout,
    /// Matches right images, where depth comes from stereo.
    stereo: Option<StereoWorker>,
    /// The depth image of a camera that has none, or whose depth is not used: zero, but around features that have a depth from stereo.
    sparse_depth: Arc<DepthImage>,
    extracted: Features,
    tracker: Tracker,
    initialiser: TwoViewInitialiser,
    gravity: GravityDirection,
    owner: MapOwner,
    state: TrackingState,
    anchors: Vec<Anchor>,
    filter: Box<dyn DynamicFilter>,
    /// Whether the filter uses detections.
    needs_boxes: bool,
    detector: Option<DetectorWorker>,
    detections: FrameDetections,
    demand: DetectionDemand,
    dense: Option<DenseMapper>,
    /// The map frame of the saved map that this session continues.
    saved_frame: Option<MapFrame>,
    last_timestamp_ns: Option<i64>,
    /// Frames since the camera was lost that showed enough for a map and were not recognised.
    unknown_frames: usize,
    /// How a map from an earlier session is used; `None` if the map is all of this one.
    map_use: Option<MapUse>,
    /// Sequence number of the first keyframe of this session.
    first_keyframe: u64,
    health: HealthCheck,
    statistics: Statistics,
}

/// Pose of a tracked frame relative to a keyframe.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    timestamp_ns: i64,
    reference: KeyFrameId,
    t_cam_reference: Pose,
}

/// What the stages of one frame hand on to each other.
struct Pass {
    /// The depth image that all stages use.
    depth: Arc<DepthImage>,
    times: StageTimes,
    clock: Stopwatch,
    loop_closure: Option<LoopClosure>,
    /// Whether two views have made a map, so that the frame is a keyframe already.
    map_begun: bool,
}

impl Slam {
    /// Takes one frame through all stages.
    ///
    /// # Errors
    /// If an image does not have the camera's size, an image that the sensor needs is missing, or the time stamp is not later than that
    /// of the last frame. The next frame is handled as if this one had not come.
    pub fn track(&mut self, frame: &Frame) -> Result<Tracked, FrameRejected> {
        self.check(frame)?;
        // Features with depth, and how far each is trusted to be static.
        let mut pass = self.sense(frame);
        // The pose from the last frame and the local map, or from place recognition.
        let localised = self.localise(frame, &mut pass);
        // A keyframe, landmarks, local bundle adjustment, loops.
        let is_keyframe = self.extend_map(frame, localised.is_ok(), &mut pass);
        Ok(self.finish(frame, localised, is_keyframe, pass))
    }
}
