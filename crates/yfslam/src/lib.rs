//! Visual SLAM for scenes in which people walk: RGB-D cameras first; stereo and single cameras.
//!
//! Frames go in, poses come out. A dynamic filter keeps what moves out of tracking and map; the same frames give the same bits on every
//! run.
//!
//! # The first program
//!
//! ```
//! use yfslam::{Camera, DepthImage, Frame, RgbImage, Slam};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (width, height) = (640, 480);
//! let camera = Camera::pinhole(width, height, 535.4, 539.2, 320.1, 247.6); // fx, fy, cx, cy in px
//! let mut slam = Slam::builder(camera).build()?;
//!
//! # let (color_bytes, depth_values) = (vec![0u8; 640 * 480 * 3], vec![0u16; 640 * 480]);
//! # let timestamp_ns = 0;
//! // For each pair of images that the camera delivers; the last number of each is the stride, then the depth unit in metres.
//! let color = RgbImage::from_rgb8(&color_bytes, width, height, 3 * width)?;
//! let depth = DepthImage::from_u16(&depth_values, width, height, width, 0.001)?;
//! let tracked = slam.track(&Frame::rgbd(timestamp_ns, color, depth))?;
//! match (tracked.t_world_cam, tracked.lost_reason) {
//!     (Some(pose), _) => println!("camera at {}", pose.translation.vector),
//!     (None, Some(reason)) => println!("no pose: {reason}"), // a black image has no features
//!     (None, None) => {}
//! }
//! # Ok(()) }
//! ```
//!
//! # What can be added
//!
//! | wish | how |
//! |---|---|
//! | a person detector | [`SlamBuilder::detector`] with `YoloFastestV2::embedded` of the crate `yfslam-detect`, or your own [`Detector`] |
//! | detections or masks from elsewhere | [`Frame::with_detections`], [`Frame::with_mask`] |
//! | your own dynamic filter | [`SlamBuilder::filter`] with a [`DynamicFilter`] |
//! | another filter of ours, any constant | [`SlamBuilder::config`] with a [`Config`]; [`Method`] lists the filters |
//! | stereo, a single camera | [`Frame::stereo`], [`Frame::mono`], and [`Config::depth`](config::Config::depth)`.source` |
//! | mapping beside tracking, for live cameras | [`SlamBuilder::execution`] with [`Execution::Threaded`] |
//! | a map that outlives the session | [`Slam::save_map`], [`SavedMap::from_bytes`], [`SlamBuilder::map`] |
//! | occupancy, point cloud, grid, mesh while driving | [`SlamBuilder::dense`], then [`Slam::dense`]; module [`dense`] |
//! | the trajectory at the end | [`Slam::finish_mapping`], [`Slam::trajectory`] |
//!
//! The numbered programs in the folder `examples` of the project show each of these.
//!
//! # What a frame goes through
//!
//! [`Slam::track`] has it on one page: sense, localise, map, finish.
//!
//! ```text
//! Frame ─┬─► features ──────────► dynamic filter ──► tracking ──pose──► Tracked
//!        │   ORB, depth           who is moving?     last frame, then local map
//!        └─► Detector ──boxes────►                       │ keyframe
//!            (a thread of its own, joined here)          ▼
//!                                                    local mapping ──► map ──► loop closing
//!                                                    landmarks, local bundle adjustment
//!                                                        └──► dense map
//! ```
//!
//! | module of the source | content |
//! |---|---|
//! | `image`, `features` | pyramid, FAST, ORB; depth, undistortion and a search grid; depth from stereo |
//! | `geometry`, `camera`, `context` | rigid motions, similarities, lens, noise of corners and depths |
//! | `optimize` | least squares: one pose, a window of poses and points, pose graphs |
//! | `map` | keyframes and landmarks, their invariants, the only code that changes them |
//! | `dynamic`, `detect` | how far each feature is trusted to be static; detections |
//! | `tracking`, `mapping`, `loops` | pose of each frame; growth of the map; relocalisation and loop closing |
//! | `dense` | occupancy, clouds, grids, meshes, images without people |
//! | `backend`, `worker`, `system` | the owner of the map, threads, the whole path |
//!
//! # Features
//!
//! | feature | content |
//! |---|---|
//! | `persist` (default) | saved maps and dense maps as bytes: [`Slam::save_map`], [`SavedMap::from_bytes`] |
//!
//! # Conventions
//!
//! `t_a_b` maps points of frame b into frame a. The camera frame has x to the right, y down and z forward; the world is the camera frame
//! of the first keyframe. Lengths are metres (of a single camera: in a unit of its own), times integer nanoseconds. [`nalgebra`] is
//! re-exported.
#![forbid(unsafe_code)]
#![deny(unreachable_pub)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]
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

pub use camera::{Camera, CameraError};
pub use config::{Config, DepthSource, Method};
pub use dense::MapFrame;
pub use detect::{BoundingBox, Detection, Detector, DetectorError, RollCompensation, mask_of_classes};
pub use dynamic::{DynamicFilter, FilterInput, FirstPose, MovingMask, Region};
pub use features::{Feature, FrameFeatures};
pub use frame::Frame;
pub use geometry::Pose;
pub use image::{DepthImage, Image, ImageError, RgbImage};
pub use loops::LoopClosure;
#[cfg(feature = "persist")]
pub use map::MapError;
pub use map::{KeyFrame, KeyFrameId, KeyframeRelativePose, Landmark, LandmarkId, Map};
pub use system::{
    FrameHealth, FrameRejected, MapUse, Readout, SavedMap, SetupError, Slam, SlamBuilder, StageTimes, Statistics,
    Tracked,
};
pub use tracking::{LostReason, TrackingStart, TrackingState};
pub use worker::Execution;
