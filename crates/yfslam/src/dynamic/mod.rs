//! Dynamic filters: how far each feature is trusted to be static (YF-SLAM, section 3.3).
//!
//! In: detections of movable objects, the grey and the depth image, the features of the frame; later its first pose and the map.
//! Out: the trust of each feature, and the pixels that move. No other module of the core distinguishes people from the scene. Each
//! method is one file; [`filter_for`] makes the filter of a [`Method`].

mod baselines;
mod boxes;
pub(crate) mod depth_group;
mod full;
mod none;
mod region;
pub(crate) mod segment;
mod track;
mod tracks;
mod yf_slam;

use crate::config::{DynamicConfig, Method};
use crate::context::SensorModel;
use crate::detect::Detection;
use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::image::{DepthImage, GrayImage, Image};
use crate::map::{KeyframeRelativePose, Map};
pub use region::{MovingMask, Region};

/// Data of a frame before its pose is known.
#[non_exhaustive]
pub struct FilterInput<'a> {
    /// Detections of movable objects, of any score; boxes in px of the raw image.
    pub movable: &'a [Detection],
    /// Whether a detector processed this image. If not, `movable` is empty, which does not mean that the image shows no movable
    /// object.
    pub detected: bool,
    /// Segmentation of the movable objects, if the detector or the caller gives one: 0 where there is none, any other value where
    /// there is one.
    pub mask: Option<&'a Image<u8>>,
    /// The grey image as the camera delivers it, with lens distortion.
    pub gray: &'a GrayImage,
    /// The depth image, registered to the grey image; 0 is "not measured". With a stereo camera only the surroundings of matched
    /// features have depth, with a single camera no pixel has.
    pub depth: &'a DepthImage,
    /// The camera, and the scales of the pyramid levels.
    pub(crate) sensor: &'a SensorModel,
}

/// The first pose of a frame, and the map with which the frame can be compared.
#[non_exhaustive]
pub struct FirstPose<'a> {
    /// Time stamp of the frame, ns.
    pub timestamp_ns: i64,
    /// The camera, and the scales of the pyramid levels.
    pub(crate) sensor: &'a SensorModel,
    /// The map as it was before this frame.
    pub map: &'a Map,
    /// The pose of the frame, world to camera, from the features that were trusted so far.
    pub t_cam_world: &'a Pose,
}

/// Returns the filter of a method; its random draws start from `seed`.
pub(crate) fn filter_for(method: Method, seed: u64) -> Box<dyn DynamicFilter> {
    match method {
        Method::None => Box::new(none::NoFilter),
        Method::Boxes => Box::<boxes::Boxes>::default(),
        Method::YfSlam => Box::new(yf_slam::YfSlam::new(seed)),
        Method::DsSlam => Box::new(baselines::DsSlam::new(seed)),
        Method::DynaSlam => Box::new(baselines::DynaSlam::new(seed)),
        Method::DmsSlam => Box::<baselines::DmsSlam>::default(),
        Method::Full => Box::new(full::Full::new(seed)),
    }
}

/// A dynamic filter: decides for each feature of each frame how far it is trusted to be static.
///
/// Give it to [`SlamBuilder::filter`](crate::SlamBuilder::filter). For each frame the system calls
/// [`before_pose`](Self::before_pose), estimates a first pose from the trusted features, calls [`after_pose`](Self::after_pose),
/// refines the pose if the trust has changed, and calls [`end_frame`](Self::end_frame). A trust of 0 excludes a feature from
/// tracking and mapping; a value between 0 and 1 is the weight of its residuals. Only [`before_pose`](Self::before_pose) is
/// required. A filter should reuse its buffers, so that no call allocates memory after the first frames.
pub trait DynamicFilter: Send + Sync {
    /// Sets [`Feature::trust`](crate::Feature::trust) of the features before the pose is known. Each is 1 at the call.
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures);

    /// Changes the trust of features after the first pose was estimated from the last frame or the reference keyframe; it is not
    /// called while the map is initialised or the camera is relocalised. Returns whether something that moves was found: the pose
    /// is then refined again.
    fn after_pose(&mut self, _config: &DynamicConfig, _first: &FirstPose<'_>, _features: &mut FrameFeatures) -> bool {
        false
    }

    /// Returns the pose of the frame, world to camera, if [`after_pose`](Self::after_pose) has found that the first pose followed an object that
    /// moves. The frame is then matched with the map anew from there.
    fn corrected_pose(&self) -> Option<Pose> {
        None
    }

    /// Gives the trust `dynamic.full.doubted_box_trust` to features that only a bounding box excludes. Called when too few trusted features
    /// remain to track the frame, or when the camera is lost and recognises nothing; the frame is then tried again. Returns whether the trust
    /// of any feature has changed.
    fn doubt_boxes(&mut self, _config: &DynamicConfig, _features: &mut FrameFeatures) -> bool {
        false
    }

    /// Receives the time stamp, ns, and the final pose of a tracked frame, relative to a keyframe. It is not called for a frame
    /// that is lost.
    fn end_frame(&mut self, _config: &DynamicConfig, _timestamp_ns: i64, _pose: KeyframeRelativePose) {}

    /// Returns the regions of the last frame that move, for display and statistics.
    fn regions(&self) -> &[Region] {
        &[]
    }

    /// Returns the pixels of the last frame that move, for the dense map; `depth` is its depth image. They include regions whose
    /// features were trusted only because too few others remained.
    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        MovingMask::from_regions(self.regions().to_vec())
    }

    /// Removes everything remembered of earlier frames: the map was reset, poses refer to a new world.
    fn reset_history(&mut self) {}

    /// Returns whether the filter uses detections or masks of movable objects. If not, the system does not run the detector for it.
    fn needs_boxes(&self) -> bool {
        true
    }

    /// Returns whether the next image has to be searched for people although `dynamic.detect_max_gap_s` has not passed: the filter cannot tell
    /// from the last one where they are.
    fn wants_detections(&self) -> bool {
        true
    }

    /// Returns whether the visibility check removes landmarks from the map where the measured depth proves free space.
    fn checks_visibility(&self) -> bool {
        false
    }
}
