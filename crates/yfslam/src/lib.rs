//! RGB-D and stereo visual SLAM for scenes in which people walk.
//!
//! What a frame goes through ([`Slam::track`] has it on one page):
//!
//! ```text
//! Frame ─┬─► features ──────────► dynamic ──────► tracking ──pose──► Tracked
//!            │   corners, depth       who may move?   last frame, then local map
//!            └─► Detector ──boxes────►                    │ worth a keyframe?
//!                (a thread of its own, joined here)       ▼
//!                                                      mapping ──► map
//!                                                      landmarks, local bundle adjustment
//! ```
//!
//! | module | what it knows |
//! |---|---|
//! | [`image`], [`features`] | one image: pyramid, FAST, ORB; [`features::FrameFeatures`] adds depth, undistortion and a search grid; depth from stereo |
//! | [`geometry`], [`camera`], [`sensor`] | rigid motions, similarities, the lens, the noise of corners and depths |
//! | [`optimize`] | least squares: one pose, a window of poses and points, motions between poses |
//! | [`map`] | keyframes and landmarks, their invariants, the only code that changes them |
//! | [`dynamic`] | how far a feature may be trusted to be static; nothing else knows that people exist |
//! | [`tracking`] | the pose of each frame; when to make a keyframe |
//! | [`mapping`] | growth and refinement of the map |
//! | [`loops`] | places seen before: the way back when lost, and loops to close |
//! | [`dense`] | what people use a map for: occupancy, clouds, grids, meshes, the view without people |
//! | [`backend`] | the owner of the map, on the calling thread or its own |
//! | [`system`] | the whole path |
//!
//! Frames are named: `t_cam_world` maps points of the world into the camera. Lengths are metres, times integer nanoseconds. The same
//! frames give the same bits on every run.
//!
//! ```
//! use std::sync::Arc;
//! use yfslam::image::{DepthImage, Image, RgbImage};
//! use yfslam::{Camera, Config, Frame, Slam};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let camera = Camera {
//!     width: 640, height: 480, fx: 535.4, fy: 539.2, cx: 320.1, cy: 247.6,
//!     distortion: [0.0; 5], depth_factor: 5000.0, fps: 30.0, bf: 40.0,
//! };
//! let mut slam = Slam::new(Config::default(), &camera, None)?;
//! let frame = Frame {
//!     timestamp_ns: 0,
//!     color: Arc::new(RgbImage::new(640, 480)),
//!     depth: Arc::new(DepthImage { raw: Image::new(640, 480), metres_per_unit: 1.0 / 5000.0 }),
//!     right: None,
//!     detections: None,
//!     mask: None,
//! };
//! let tracked = slam.track(&frame)?;
//! assert!(tracked.t_world_cam.is_none(), "a blank picture starts no map");
//! # Ok(()) }
//! ```
#![deny(unreachable_pub)]
#![warn(missing_docs)]

mod backend;
mod camera;
pub mod config;
mod context;
pub mod dense;
mod detect;
mod dynamic;
mod features;
mod frame;
mod geometry;
mod image;
mod loops;
mod map;
mod mapping;
mod optimize;
mod system;
mod tracking;
pub mod unstable;
mod worker;

pub use nalgebra;

pub use camera::Camera;
pub use config::{Config, DepthSource, Method};
pub use detect::{BoundingBox, Detection, Detector, DetectorError, RollCompensation, mask_of_classes};
pub use dynamic::{DynamicFilter, FilterInput, FirstPose, MovingMask, Region};
pub use features::{Feature, FrameFeatures};
pub use frame::Frame;
pub use geometry::Pose;
pub use image::{DepthImage, Image, ImageError, RgbImage};
pub use loops::LoopClosure;
pub use map::{KeyFrame, KeyFrameId, KeyframeRelativePose, Landmark, LandmarkId, Map, MapError};
pub use system::{FrameRejected, MapUse, SavedMap, SetupError, Slam, SlamBuilder, StageTimes, Statistics, Tracked};
pub use tracking::{LostReason, TrackingState};
pub use worker::{Execution, Worker};
