//! Which features may be trusted to be static (YF-SLAM, section 3.3).
//!
//! In: boxes of movable objects, the depth image, the frame's features. Out: each feature's trust. Nothing else in the core knows that
//! people exist. One file per method; [`Method::filter`] makes the filter that a name stands for.

mod baselines;
mod boxes;
pub(crate) mod depth_group;
mod full;
mod none;
mod region;
pub(crate) mod segment;
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

/// What is known about a frame before its pose.
#[non_exhaustive]
pub struct FilterInput<'a> {
    /// Detections of movable objects, at any score.
    pub movable: &'a [Detection],
    /// Whether the image was searched for such objects: without a search, a missing box means nothing.
    pub detected: bool,
    /// Pixels of movable objects, where a segmentation is at hand: 0 where there is none.
    pub mask: Option<&'a Image<u8>>,
    /// The grey image.
    pub gray: &'a GrayImage,
    /// The depth image; of a stereo camera it is zero but around features with a depth, of a single camera zero everywhere.
    pub depth: &'a DepthImage,
    /// The camera, and the scales of the pyramid levels.
    pub(crate) sensor: &'a SensorModel,
}

/// The first pose of a frame, and what it can be compared with.
#[non_exhaustive]
pub struct FirstPose<'a> {
    /// The camera, and the scales of the pyramid levels.
    pub(crate) sensor: &'a SensorModel,
    /// The map.
    pub map: &'a Map,
    /// The pose of the frame.
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

/// Decides for the features of one frame after another how far each is trusted to be static. Buffers are reused: after warm-up no call
/// allocates.
///
/// Only [`DynamicFilter::before_pose`] is required.
pub trait DynamicFilter: Send + Sync {
    /// Sets [`Feature::trust`](crate::Feature::trust) of each feature, which is 1 at first, before the pose is known.
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures);

    /// Changes the trust of features after a first pose was estimated. Returns whether any feature lost its trust.
    fn after_pose(&mut self, _config: &DynamicConfig, _first: &FirstPose<'_>, _features: &mut FrameFeatures) -> bool {
        false
    }

    /// Gives features that boxes alone exclude the trust `dynamic.full.doubted_box_trust`, because the frame cannot be tracked without them.
    /// Returns whether there are any.
    fn doubt_boxes(&mut self, _config: &DynamicConfig, _features: &mut FrameFeatures) -> bool {
        false
    }

    /// Ends the doubts about a frame that was tracked: features that boxes exclude have kept some trust if they match landmarks.
    fn settle_doubts(&mut self, _config: &DynamicConfig, _features: &FrameFeatures) {}

    /// Receives the pose of the tracked frame, relative to a keyframe.
    fn end_frame(&mut self, _config: &DynamicConfig, _timestamp_ns: i64, _pose: KeyframeRelativePose) {}

    /// Returns the regions of the last frame that were found to move.
    fn regions(&self) -> &[Region] {
        &[]
    }

    /// Returns what moves in the last frame, whose depth image is given, for the dense map: also what was trusted because too few features
    /// were left.
    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        MovingMask::from_regions(self.regions().to_vec())
    }

    /// Forgets earlier frames: a new world begins.
    fn reset_history(&mut self) {}

    /// Returns whether the filter uses bounding boxes or masks of movable objects.
    fn needs_boxes(&self) -> bool {
        true
    }

    /// Returns whether landmarks are removed from the map when measured depth shows free space where they were.
    fn checks_visibility(&self) -> bool {
        false
    }
}
