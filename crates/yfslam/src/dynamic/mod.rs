//! Which features may be trusted to be static (YF-SLAM, section 3.3).
//!
//! In: boxes of movable objects, the depth image, the frame's features. Out: each feature's trust. Nothing else in the core knows that
//! people exist. One file per method; [`Method::filter`] makes the filter that a name stands for.

mod body_depth;
mod body_mask;
mod boxes;
pub mod depth_group;
mod dms;
mod ds;
mod dyna;
mod full;
mod none;
mod outline;
mod region;
mod things;
mod tracks;
mod views;
mod yf;

use serde::{Deserialize, Serialize};

use crate::config::DynamicConfig;
use crate::detection::Detection;
use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::image::{DepthImage, GrayImage, Image};
use crate::map::{KeyFrameId, Map};
use crate::sensor::SensorModel;
pub use region::{MovingMask, Region};
pub use things::Things;

/// How moving things are kept out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Every feature is trusted, as in ORB-SLAM2.
    None,
    /// Every feature inside a box is dropped.
    Boxes,
    /// YF-SLAM: inside a box, the depth group of the body is dropped and the background stays.
    Yf,
    /// DS-SLAM: people are dropped while anything on them moves against the epipolar geometry.
    Ds,
    /// DynaSLAM: people are dropped, and what stands where earlier keyframes saw farther.
    Dyna,
    /// DMS-SLAM: features whose motion their neighbours do not share are dropped; no detector.
    Dms,
    /// Outlines of bodies in depth, and whatever has moved since earlier views.
    #[default]
    Full,
}

/// What is known of a frame before its pose.
pub struct Evidence<'a> {
    /// Boxes of movable objects, at any score.
    pub movable: &'a [Detection],
    /// Whether somebody looked for such boxes in this frame: without a look, no box tells nothing.
    pub looked: bool,
    /// Pixels of movable objects, where somebody knows them.
    pub mask: Option<&'a Image<u8>>,
    /// The picture.
    pub gray: &'a GrayImage,
    /// The depth image.
    pub depth: &'a DepthImage,
    /// The camera, and the scales of the pyramid's levels.
    pub sensor: &'a SensorModel,
}

/// A first pose, and what it can be compared with.
pub struct FirstPose<'a> {
    /// The camera.
    pub sensor: &'a SensorModel,
    /// The map.
    pub map: &'a Map,
    /// The pose of the frame.
    pub t_cam_world: &'a Pose,
}

/// A keyframe and the pose of a frame seen from there, `t_cam_reference`: it moves along when the map is corrected.
pub type Tie = (KeyFrameId, Pose);

impl Method {
    /// The filter of this name; its random draws start from `seed`.
    pub fn filter(self, seed: u64) -> Box<dyn DynamicFilter> {
        match self {
            Self::None => Box::new(none::NoFilter),
            Self::Boxes => Box::<boxes::Boxes>::default(),
            Self::Yf => Box::new(yf::Yf::new(seed)),
            Self::Ds => Box::new(ds::Ds::new(seed)),
            Self::Dyna => Box::new(dyna::Dyna::new(seed)),
            Self::Dms => Box::<dms::Dms>::default(),
            Self::Full => Box::new(full::Full::new(seed)),
        }
    }

    /// Whether boxes of movable objects tell it anything.
    pub fn needs_boxes(self) -> bool {
        !matches!(self, Self::None | Self::Dms)
    }
}

/// Decides about the features of one frame after another. Buffers are reused: after warm-up no call allocates.
pub trait DynamicFilter: Send + Sync {
    /// Sets the trust of `features` from what boxes, masks and pictures tell, before the pose is known.
    fn before_pose(&mut self, config: &DynamicConfig, evidence: &Evidence<'_>, features: &mut FrameFeatures);

    /// Sharpens the trust of `features` when a first pose stands. Returns whether any lost it.
    fn after_pose(&mut self, _config: &DynamicConfig, _first: &FirstPose<'_>, _features: &mut FrameFeatures) -> bool {
        false
    }

    /// Withdraws what boxes speak against, since the map cannot be followed without it: such features get the trust
    /// [`FullConfig::doubted_trust`](crate::config::FullConfig::doubted_trust). Returns whether there are any.
    fn doubt_boxes(&mut self, _config: &DynamicConfig, _features: &mut FrameFeatures) -> bool {
        false
    }

    /// Ends the doubts of a frame that was tracked: of what boxes speak against, the features that are landmarks have kept some trust.
    fn settle_doubts(&mut self, _config: &DynamicConfig, _features: &FrameFeatures) {}

    /// Takes note of the pose of the frame.
    fn end_frame(&mut self, _config: &DynamicConfig, _timestamp_ns: i64, _tie: Tie) {}

    /// The boxes in the last frame that were found to hold something that moves.
    fn regions(&self) -> &[Region];

    /// What moves in the last frame, whose depth image is given, pixel by pixel: more than features need, for whoever maps surfaces. What
    /// was given up for want of features counts, and bodies are outlined where the method has them.
    fn moving_mask(&self, config: &DynamicConfig, depth: &DepthImage) -> MovingMask;

    /// Forgets earlier views: the world begins anew.
    fn forget_views(&mut self) {}
}
